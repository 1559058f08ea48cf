"""What water mirrors: a sky without edges, and a ground as bright as it is."""

import numpy as np
import pytest

from wavetank import Camera
from wavetank.device.compiler import qd
from wavetank.view.lens import vec3
from wavetank.view.look import Look, pool
from wavetank.view.optics.radiance import environment, glint
from wavetank.view.renderer import Renderer


@qd.kernel
def mirror(found: qd.types.ndarray(), directions: qd.types.ndarray(), look: Look):
    for k in range(directions.shape[0]):
        found[k] = environment(look, directions[k])


def mirrored(directions):
    """Radiance [n, 3] that water mirrors from unit directions [n, 3]."""
    directions = np.asarray(directions, np.float32)
    arrays = [qd.ndarray(vec3, shape=(len(directions),)) for _ in range(2)]
    arrays[1].from_numpy(directions)
    mirror(*arrays, pool())
    return arrays[0].to_numpy()


@qd.kernel
def glints(found: qd.types.ndarray(), directions: qd.types.ndarray(), look: Look, rough: qd.f32):
    for k in range(directions.shape[0]):
        found[k] = glint(look, directions[k].y, rough)


def half_sphere(count=4000):
    up = (np.arange(count) + 0.5) / count
    around, flat = 2.3999632297 * np.arange(count), np.sqrt(1.0 - up * up)
    return np.stack([flat * np.cos(around), up, flat * np.sin(around)], axis=1)


def test_a_rough_surface_spreads_the_image_of_the_sun():
    """Toksvig 2005: as many normals, over more of the surface, as bright in all and fainter in its middle."""
    normals = half_sphere(20000).astype(np.float32)
    arrays = [qd.ndarray(vec3, shape=(len(normals),)) for _ in range(2)]
    arrays[1].from_numpy(normals)
    sums, peaks = [], []
    for rough in (0.0, 0.005, 0.02):
        glints(*arrays, pool(), rough)
        light = arrays[0].to_numpy().sum(axis=1)
        sums.append(light.sum())
        peaks.append(light.max() * (1.0 + 600.0 * rough))
    assert np.ptp(sums) < 0.1 * sums[0]
    assert np.ptp(peaks) < 0.05 * peaks[0]


def test_nothing_in_the_sky_has_an_edge():
    """Along great circles no degree changes the mirrored light by more than a fifteenth of a white surface's."""
    steps = np.radians(np.arange(4.0, 177.0))
    for turn in np.radians(np.arange(0.0, 180.0, 5.0)):
        arc = np.stack([np.cos(steps) * np.cos(turn), np.sin(steps), np.cos(steps) * np.sin(turn)], axis=1)
        assert np.abs(np.diff(mirrored(arc), axis=0)).max() < 0.066


def test_the_sky_is_the_models():
    """Preetham et al. 1999, above the haze: to 15 % of the largest, in the mean to 6 %; it is the models' shape."""
    from wavetank.view import sky

    directions = half_sphere()
    directions = directions[directions[:, 1] > 0.35]
    to_sun = np.asarray(pool().to_sun, float)
    model, seen = sky.preetham(directions, to_sun, 3.5), mirrored(directions)
    model *= (model * seen).sum(axis=0) / (model * model).sum(axis=0)  # each colour to its level
    assert np.abs(seen - model).mean() < 0.06 * seen.max()
    assert np.abs(seen - model).max() < 0.2 * seen.max()


def test_the_zenith_of_the_model_is_blue_and_its_sun_side_bright():
    """Published behaviour: luminance rises towards the sun, the darkest sky is some 90 degrees from it."""
    from wavetank.view import sky

    to_sun = np.array([0.0, np.sin(0.9), np.cos(0.9)])
    up, at_sun, across = (0.0, 1.0, 0.0), to_sun, (0.0, np.cos(0.67), -np.sin(0.67))
    zenith, bright, dark = sky.preetham(np.array([up, at_sun, across]), to_sun, 3.0)
    assert zenith[2] > 2.0 * zenith[0]
    assert bright.sum() > 2.0 * zenith.sum() > 2.0 * dark.sum()


def test_the_mirrored_ground_is_as_bright_as_the_lit_floor(make_frame, tank_scene):
    """Radiance of the floor where nothing shades it, and of what a surface that looks down mirrors."""
    renderer = Renderer(64, 48)
    renderer.render(make_frame(tank_scene, []), view="water")
    floor = renderer.buffers.pixels.surface.to_numpy() == -2
    lit = np.median(renderer.buffers.water.backdrop.behind.to_numpy()[floor], axis=0)
    below = mirrored([(0.0, -1.0, 0.0), (0.8, -0.6, 0.0)])
    assert below == pytest.approx(np.tile(lit, (2, 1)), rel=0.15)


def test_the_sun_stands_in_the_sky(make_frame, tank_scene):
    """An eye that looks at the sun sees a white disc, and nothing so bright ten degrees beside it."""
    eye = np.array([0.5, 0.5, 0.5])
    camera = Camera(eye=tuple(eye), target=tuple(eye + np.asarray(pool().to_sun, float)), field_of_view=0.5)
    image = Renderer(120, 90).render(make_frame(tank_scene, []), camera, view="water").astype(int)
    assert image[43:47, 58:62].min() > 248
    assert image[:8].min(axis=2).max() < 225
    assert (image.min(axis=2) > 248).sum() < 400
