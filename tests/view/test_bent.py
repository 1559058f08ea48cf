"""Solids in a tank are seen where the bent ray meets them, once, and in the mirror of the surface; films cast shade."""

import numpy as np
import pytest
from test_ellipsoids import lattice
from worlds import frame_of

from wavetank import Box, Camera, Scene, Simulation, Sphere, Tank
from wavetank.view import strips
from wavetank.view.extent import extent_of
from wavetank.view.renderer import Renderer
from wavetank.view.strips import _strips

D = 0.05
SIZE = (240, 180)
MIDDLE, RADIUS = np.array([0.5, 0.35, 0.4]), 0.15
BALL = Sphere(center=tuple(MIDDLE), radius=RADIUS, color="#ff0000")


def filled(solids=(), height=0.6, **scene):
    x = lattice((0, 0, 0), (1.0, height, 1.0)) if height else np.zeros((0, 3))
    for solid in solids:
        if isinstance(solid, Sphere):
            x = x[np.linalg.norm(x - np.array(solid.center), axis=1) > solid.radius + 0.3 * D]
    return frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=list(solids), **scene), x)


def picture(frame, camera, **style):
    return Renderer(*SIZE).render(frame, camera, view="water", **style).astype(int)


def meets_the_ball(camera):
    """Which pixels' rays meet the ball once they are bent at the pane z = 1 (Snell, n = 1.33), and which pass it by.

    Passing by means a ray that enters below the surface and leaves through the back pane or meets the floor.
    """
    hit, past = np.zeros(SIZE[::-1], bool), np.zeros(SIZE[::-1], bool)
    for row in range(SIZE[1]):
        for column in range(SIZE[0]):
            origin, ahead = camera.ray(column + 0.5, row + 0.5, *SIZE)
            at = origin + (1.0 - origin[2]) / ahead[2] * ahead
            if not (0.04 < at[0] < 0.96 and 0.04 < at[1] < 0.5):
                continue
            bent = ahead / 1.33
            bent[2] = -np.sqrt(1.0 - bent[0] ** 2 - bent[1] ** 2)
            offset = MIDDLE - at
            miss = np.linalg.norm(offset - offset @ bent * bent)
            hit[row, column], past[row, column] = miss < RADIUS - 0.01, miss > RADIUS + 0.03
    return hit, past


@pytest.mark.parametrize("eye", [(0.5, 0.5, 3.0), (1.6, 0.7, 2.6)])
def test_a_ball_is_seen_where_the_bent_ray_meets_it_and_nowhere_else(eye):
    camera = Camera(eye=eye, target=(0.5, 0.35, 0.7))
    image, without = (picture(filled(solids), camera) for solids in ((BALL,), ()))
    hit, past = meets_the_ball(camera)
    assert hit.sum() > 500
    assert (np.abs(without - image).max(axis=2)[hit] > 25).mean() > 0.97, "the whole ball"
    darker = (without - image).max(axis=2)
    assert np.percentile(darker[past], 90) < 25 and (darker[past] > 60).mean() < 0.02, "and no ghost of it"


def test_the_surface_mirrors_what_stands_in_the_water():
    """Aslant, a red wall at the back of the water is mirrored by the surface before it."""
    wall = Box(center=(0.5, 0.75, 0.1), size=(0.8, 0.5, 0.05), color="#ff0000")
    camera = Camera(eye=(0.5, 0.85, 2.4), target=(0.5, 0.6, 0.5))
    column, row, _ = camera.project(np.array([0.5, 0.6, 0.6]), *SIZE)[0]
    place = slice(int(row) - 2, int(row) + 3), slice(int(column) - 8, int(column) + 9)
    seen = [picture(filled(solids), camera)[place].reshape(-1, 3).mean(axis=0) for solids in ((wall,), ())]
    warmer = (seen[0][0] - seen[0][2]) - (seen[1][0] - seen[1][2])
    assert warmer > 35


def test_the_floor_is_seen_in_the_mirror_of_a_pane_also_where_it_is_nearer_than_where_the_ray_went_in():
    """Rays that enter beside the far pane are mirrored there and meet the floor: 48 % were one flat colour."""
    frame = Simulation(Scene.load("still-tank").changed(spacing=0.05)).frame()
    camera = Camera.framing_extent(extent_of(frame.scene), 400 / 300)
    image = Renderer(400, 300).render(frame, camera, view="water", floor="tiles").astype(int)
    wide = frame.scene.tank.size[0]
    places = [(x * wide, 0.5, z) for x in np.linspace(0.04, 0.45, 120) for z in np.linspace(0.01, 0.05, 6)]
    columns, rows, _ = camera.project(np.array(places), 400, 300).T.astype(int)
    steps = np.abs(np.diff(image, axis=1)).max(axis=2)[rows, columns]
    assert (steps == 0).mean() < 0.25


def film(seed):
    x = lattice((0.1, 0.75, 0.1), (0.9, 0.85, 0.9))
    x += np.random.default_rng(seed).uniform(-0.45, 0.45, x.shape) * D
    return frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), x)


def test_the_shadow_of_a_film_does_not_boil():
    """A film two particles thick whose particles are pushed about: its shadow on the floor hardly shows it.

    The standard deviation of what changes is 1.0 % of the light there; where every lump was a lens it was 2.5 %.
    """
    camera = Camera(eye=(0.5, 0.5, 4.0), target=(1.05, 0.0, 0.5))
    places = np.array([(x, 0.0, z) for x in np.linspace(1.1, 1.35, 12) for z in np.linspace(0.3, 0.7, 12)])
    columns, rows, _ = camera.project(places, *SIZE).T.astype(int)
    light = [picture(film(seed), camera, floor="plain")[rows, columns].sum(axis=1) for seed in range(3, 9)]
    changes = [np.std(one - other) / np.mean(one) for one, other in zip(light[::2], light[1::2], strict=True)]
    assert np.mean(changes) < 0.016


def test_breaking_water_hardly_flickers():
    """Pixels that jump by more than 40 of 255 against both neighbours, with foam, in half a second: 0.28 %."""
    sim = Simulation(Scene.load("dam-break"))
    sim.advance(0.6)
    renderer, pictures = Renderer(640, 360), []
    for _ in range(34):
        pictures.append(renderer.render(sim.frame(), view="water").astype(np.int16))
        sim.advance(1.0 / 60.0)
    film = np.array(pictures)
    before, after = film[1:-1] - film[:-2], film[1:-1] - film[2:]
    jumps = ((np.abs(before) > 40) & (np.abs(after) > 40) & (before * after > 0)).any(axis=-1)
    assert sim.frame().foam_count > 100
    assert jumps.mean() < 0.003


@pytest.mark.parametrize("supersample", [1, 2])
def test_a_picture_is_the_same_however_it_is_cut_into_strips(monkeypatch, supersample):
    """What lies between two rays needs the one of the strip before: it is followed again there."""
    x = lattice((0, 0, 0), (1.0, 0.5, 1.0))
    x[:, 1] *= 1.0 + 0.2 * np.sin(9.0 * x[:, 0]) * np.cos(8.0 * x[:, 2])
    frame = frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), x)
    whole = None
    for threads in (1, 5, 0):  # 0: a graphics processor
        monkeypatch.setattr(strips, "threads", lambda threads=threads: threads)
        for samples in (1, 4):  # each of four has other groups
            image = Renderer(321, 97, supersample).render(frame, view="water", samples=samples)
            whole = {**(whole or {}), samples: image} if threads == 1 else whole
            assert np.array_equal(image, whole[samples]), (threads, samples)


@pytest.mark.parametrize("samples", [1, 2, 3, 4])
def test_strips_cut_no_pixel_on_any_number_of_threads(samples):
    """What is seen through water is kept for the samples of a pixel: cut in two it came out otherwise."""
    for width, height in ((400, 225), (641, 97), (7, 5)):
        for threads in (0, 1, 2, 3, 8):  # 0: a graphics processor
            rows, columns = height * samples, width * samples
            cut = _strips(rows, columns, threads, 4 * samples)
            assert cut.width % samples == 0 and (cut.width % (4 * samples) == 0 or cut.parts == 1)
            assert cut.parts * cut.width >= columns > (cut.parts - 1) * cut.width
            assert cut.count >= rows * cut.parts


def test_thin_rods_in_water_have_no_gaps():
    """Rays that lie between two others do not see what neither met: of eight pixels to a group, rods were lost."""
    places = 0.3 + 0.0817 * np.arange(8)
    rods = [Box(center=(x, 0.2, 0.25), size=(0.014, 0.4, 0.014), color="#c02020") for x in places]
    x = lattice((0.0, 0.0, 0.0), (1.5, 0.38, 0.5))
    frame = frame_of(Scene(spacing=D, tank=Tank(size=(1.5, 0.7, 0.5)), solids=rods), x)
    camera = Camera(eye=(0.75, 0.45, 2.6), target=(0.75, 0.2, 0.25))
    image = Renderer(640, 360).render(frame, camera, view="water").astype(int)
    for place in places:
        ends = camera.project([(place, 0.05, 0.5), (place, 0.32, 0.5)], 640, 360)
        top, bottom, middle = int(ends[1, 1]), int(ends[0, 1]), int(ends[:, 0].mean())
        rows = image[top:bottom, middle - 14 : middle + 14, 2]
        assert len(rows) > 40
        assert (rows.min(axis=1) < 0.75 * np.median(rows)).all(), place
