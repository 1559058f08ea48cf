"""Shadows, ambient occlusion, tone mapping: what light does to the finished picture."""

import numpy as np
import pytest

from wavetank import Box, Scene, Sphere, Tank
from wavetank.device.compiler import download, qd
from wavetank.foundation.rotations import turned
from wavetank.view.buffers import allocate
from wavetank.view.camera import Camera
from wavetank.view.lens import vec3
from wavetank.view.look import studio
from wavetank.view.passes import tonemap
from wavetank.view.renderer import Renderer

SIZE = (160, 120)
BALL = (0.5, 0.5, 0.5)
CAMERA = Camera(eye=(0.5, 3.0, 3.0), target=(0.5, 0.2, 0.5))


def brightness_at(image, point):
    """Mean value of the pixels around where `point` is seen."""
    column, row, _ = CAMERA.project(point, *SIZE)[0]
    row, column = round(row), round(column)
    return image[row - 1 : row + 2, column - 1 : column + 2].mean()


def below_ball():
    """Where the sun's ray through the ball meets the floor."""
    to_sun = studio().to_sun
    return np.array(BALL) - to_sun * (BALL[1] / to_sun[1])


@pytest.mark.parametrize("caster", ["particles", "solid"])
def test_the_floor_is_dark_where_something_hides_the_sun(make_frame, tank_scene, caster):
    renderer = Renderer(*SIZE)
    options = {"camera": CAMERA, "legend": False, "radius": 3.0}
    solids = [Sphere(center=BALL, radius=0.15)] if caster == "solid" else []
    scene = Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)), solids=solids)
    empty = renderer.render(make_frame(tank_scene, []), **options)
    full = renderer.render(make_frame(scene, [] if solids else [BALL]), **options)
    place = below_ball()
    assert brightness_at(full, place) < 0.85 * brightness_at(empty, place)
    bright = place + [-0.5, 0.0, 0.3]
    assert brightness_at(full, bright) == pytest.approx(brightness_at(empty, bright), abs=1.0)


def test_a_shadow_is_softer_the_higher_what_casts_it(make_frame, tank_scene):
    def rim(height):
        renderer = Renderer(320, 240)
        frame = make_frame(tank_scene, [(0.5, height, 0.5)])
        renderer.render(frame, camera=CAMERA, legend=False, radius=2.0)
        share = renderer.buffers.light.share.to_numpy()[..., 0]
        floor = renderer.buffers.pixels.surface.to_numpy() == -2
        return ((share > 0.1) & (share < 0.9) & floor).sum()

    assert rim(0.9) > 1.5 * rim(0.12)


def test_a_crease_is_darker_than_the_open_floor(make_frame):
    scene = Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)), solids=[Sphere(center=(0.5, 0.1, 0.5), radius=0.1)])
    renderer = Renderer(*SIZE)
    renderer.render(make_frame(scene, []), camera=CAMERA, view="particles")
    sky = renderer.buffers.light.share.to_numpy()[..., 1]
    column, row, _ = CAMERA.project((0.5, 0.0, 0.61), *SIZE)[0]
    assert sky[int(row), int(column)] < 0.96
    far_column, far_row, _ = CAMERA.project((0.5, 0.0, 1.2), *SIZE)[0]
    assert sky[int(far_row), int(far_column)] == pytest.approx(1.0, abs=0.02)


def developed(colors, samples=1):
    """The bytes [n, 3] of radiances [n, 3], each a row of samples."""
    colors = np.asarray(colors, np.float32)
    field = np.repeat(np.repeat(colors[None], samples, axis=0), samples, axis=1)
    array = qd.ndarray(vec3, shape=field.shape[:2])
    array.from_numpy(field)
    buffers = allocate(len(colors), 1, samples)
    tonemap.write(buffers, array, 0)
    return buffers.host_picture()[0]


def test_tone_mapping_keeps_grey_grey_and_order():
    radiances = np.concatenate([np.linspace(0.0, 2.0, 41), [10.0, 1e6, 1e30]])
    shown = developed(np.repeat(radiances[:, None], 3, axis=1)).astype(int)
    assert (shown[:, 0] == shown[:, 2]).all()
    assert (np.diff(shown[:, 0]) >= 0).all()
    assert shown[0, 0] == 0
    assert shown[-1, 0] == 255
    assert developed([[0.25, 0.25, 0.25]])[0].tolist() == [126] * 3  # sRGB of 0.25 - 0.04


def test_tone_mapping_survives_what_is_no_colour():
    shown = developed([[np.nan, 0.5, 0.5], [-1.0, -1.0, -1.0], [np.inf, 1.0, 0.0]], samples=2)
    assert shown.shape == (3, 3)
    assert shown[1].tolist() == [0, 0, 0]


@pytest.mark.parametrize("slope", [35, 60, 75])
def test_a_face_aslant_to_the_sun_does_not_shade_itself(make_frame, slope):
    """All of a plane stands in the sun: from 35 degrees on it was striped by its own depths in the sun's map."""
    to_sun = studio().to_sun
    turn = np.arctan2(-to_sun[0], -to_sun[2])  # the face leans away from the sun
    axis = np.cross((0.0, 1.0, 0.0), (np.sin(turn), 0.0, np.cos(turn)))
    lean = np.radians(slope) - np.arccos(to_sun[1])
    rotation = (float(np.cos(0.5 * lean)), *(float(part) for part in np.sin(0.5 * lean) * axis))
    ground = Box(center=(0.5, 0.5, 0.5), size=(0.8, 0.02, 0.8), rotation=rotation)
    renderer = Renderer(*SIZE)
    renderer.render(
        make_frame(Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)), solids=[ground]), []), CAMERA, view="particles"
    )
    buffers = renderer.buffers
    normal = turned(np.array(rotation), np.array((0.0, 1.0, 0.0)))
    face = download(buffers.pixels.normal) @ normal > 0.999
    face &= download(buffers.pixels.surface) == -1
    share = download(buffers.with_light().share)[..., 0][face]
    assert abs(normal @ to_sun - np.cos(np.radians(slope))) < 1e-3
    assert len(share) > 500
    assert (share > 0.999).mean() > 0.95
