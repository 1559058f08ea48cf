"""The shapes that particles get from their neighbours, and the surface these make."""

import numpy as np
import pytest
from test_spheres import HEIGHT, WIDTH, entry_depths

from wavetank import Scene, Tank
from wavetank.view.camera import Camera
from wavetank.view.passes import ellipsoids, surface
from wavetank.view.renderer import Renderer
from wavetank.view.water_buffers import water_of

D = 0.05
CAMERA = Camera(eye=(0.5, 0.7, 2.0), target=(0.5, 0.5, 0.5), field_of_view=0.8)


def lattice(lower, upper):
    axes = [np.arange(a + 0.5 * D, b, D) for a, b in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


def shapes(frame):
    """(B^2 [n, 3, 3], centers, sizes) in the order of ids."""
    renderer = Renderer(16, 16)
    shot = renderer.shot(frame)
    ellipsoids.draw(shot, renderer.buffers)
    water = water_of(renderer.buffers, shot)
    fields = [getattr(water.ellipsoids, name).to_numpy()[: frame.count] for name in ("axes", "mixed", "center", "size")]
    order = np.argsort(water.cells.order.to_numpy()[: frame.count])  # particles of tests stand in the order of ids
    axes, mixed, center, size = (field[order] for field in fields)
    matrix = np.zeros((frame.count, 3, 3))
    for k in range(3):
        matrix[:, k, k] = axes[:, k]
    for (a, b), column in zip(((0, 1), (0, 2), (1, 2)), mixed.T, strict=True):
        matrix[:, a, b] = matrix[:, b, a] = column
    return matrix, center, size


def radii(matrix):
    return np.sqrt(np.linalg.eigvalsh(matrix)) / D


def open_water(x, make_frame):
    return make_frame(Scene(spacing=D, gravity=(0.0, -9.81, 0.0)), x)


def test_a_lone_particle_is_a_ball(make_frame):
    matrix, center, _ = shapes(open_water([(0.5, 0.5, 0.5)], make_frame))
    assert radii(matrix[0]) == pytest.approx([ellipsoids.BALL] * 3, rel=1e-4)
    assert center[0] == pytest.approx((0.5, 0.5, 0.5), abs=1e-6)


def test_a_sheet_is_flat_and_a_thread_is_long(make_frame):
    sheet = lattice((0, 0.5, 0), (0.6, 0.5 + D, 0.6))
    matrix, _, _ = shapes(open_water(sheet, make_frame))
    middle = np.linalg.norm(sheet - sheet.mean(axis=0), axis=1).argmin()
    values, vectors = np.linalg.eigh(matrix[middle])
    assert abs(vectors[1, 0]) > 0.99
    assert np.sqrt(values[1] / values[0]) > 2.0
    thread = lattice((0, 0.5, 0.5), (0.8, 0.5 + D, 0.5 + D))
    along = radii(shapes(open_water(thread, make_frame))[0][8])
    assert along[2] > 1.3 * along[1]


def test_a_surface_stays_where_it_is_and_bumps_are_pulled_in(make_frame):
    block = lattice((0, 0, 0), (0.6, 0.4, 0.6))
    top = np.nonzero((block[:, 1] > 0.35) & (np.abs(block[:, [0, 2]] - 0.3).max(axis=1) < 0.1))[0]
    matrix, center, _ = shapes(open_water(block, make_frame))
    assert np.abs(center[top] - block[top]).max() < 0.1 * D
    assert (np.abs(np.linalg.eigh(matrix[top])[1][:, 1, 0]) > 0.98).all()
    raised = block.copy()
    raised[top[0], 1] += 0.5 * D
    moved = shapes(open_water(raised, make_frame))[1][top[0], 1] - center[top[0], 1]
    assert 0.0 < moved < 0.45 * D


def test_the_inside_of_a_tank_is_left_out_and_its_skin_is_not(make_frame):
    size = (1.0, 0.8, 1.0)
    x = lattice((0, 0, 0), (1.0, 0.6, 1.0))
    _, _, sizes = shapes(make_frame(Scene(spacing=D, tank=Tank(size=size)), x))
    depth = np.minimum(np.minimum(x, np.array(size) - x).min(axis=1), 0.6 - x[:, 1])
    assert (sizes[depth < 1.01 * D] > 0).all()
    assert (sizes < 0).mean() > 0.1


def see_all(shot, water):
    """Fill the depth and the outlines of the water, lone particles included."""
    surface.splat_surface(shot, water.ellipsoids, shot.lens, water.surface.depth, water.surface.rim, True)


@pytest.mark.parametrize("height", [None, 1.2])
def test_a_drop_is_drawn_as_the_ball_it_is(make_frame, height):
    camera = Camera(eye=CAMERA.eye, target=CAMERA.target, field_of_view=0.8, height=height)
    frame = open_water([(0.45, 0.55, 0.5)], make_frame)
    renderer = Renderer(WIDTH, HEIGHT)
    shot = renderer.shot(frame, camera)
    ellipsoids.draw(shot, renderer.buffers)
    see_all(shot, renderer.buffers.water)
    depth = renderer.buffers.water.surface.depth.to_numpy().view(np.float32)
    radius = ellipsoids.BALL * D
    exact = entry_depths(camera, (0.45, 0.55, 0.5), radius)
    inner = np.isfinite(entry_depths(camera, (0.45, 0.55, 0.5), 0.95 * radius))
    assert inner.sum() > 5
    assert np.abs(depth - exact)[inner].max() < 0.02 * radius
    outer = 1.06 * radius + 0.5 * float(shot.lens.pixel) * (exact[inner].min() if height is None else 1.0)
    outside = ~np.isfinite(entry_depths(camera, (0.45, 0.55, 0.5), outer))
    assert (depth[outside] > 1e30).all()


@pytest.mark.parametrize("height", [None, 1.2])
def test_an_outline_covers_its_share_of_a_pixel(make_frame, height):
    """The cover of all pixels adds up to the area of the drop, wherever it lies between them."""
    camera = Camera(eye=CAMERA.eye, target=CAMERA.target, field_of_view=0.8, height=height)
    renderer, areas = Renderer(2 * WIDTH, 2 * HEIGHT), []
    for shift in np.linspace(0.0, 1.0, 7):
        frame = open_water([(0.45 + 0.03 * shift, 0.55 + 0.02 * shift, 0.5)], make_frame)
        shot = renderer.shot(frame, camera)
        ellipsoids.draw(shot, renderer.buffers)
        see_all(shot, renderer.buffers.water)
        seen = renderer.buffers.water.surface
        there, rim = seen.depth.to_numpy() < 0x7F000000, seen.rim.to_numpy() >> 24
        areas.append(np.where(rim > 0, (rim + 0.5) / 127.0, 1.0)[there].sum())
        depth = seen.depth.to_numpy().view(np.float32)[there].mean()
    pixel = float(shot.lens.pixel) * (depth if height is None else 1.0)
    assert np.array(areas) == pytest.approx(np.pi * (ellipsoids.BALL * D / pixel) ** 2, rel=0.03)


@pytest.mark.parametrize(("eye", "shown"), [((0.5, 0.4, 3.0), 2.0), ((0.5, 1.6, 3.0), None)])
def test_water_against_a_pane_is_as_flat_as_the_pane(make_frame, eye, shown):
    frame = make_frame(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), lattice((0, 0, 0), (1.0, 0.8, 1.0)))
    camera = Camera(eye=eye, target=(0.5, 0.4, 1.0), height=0.5)
    renderer = Renderer(64, 48)
    renderer.render(frame, camera)
    depth = renderer.buffers.water.surface.nearest.to_numpy().view(np.float32)
    lens = camera.lens(64, 48)
    v = (24 - np.arange(48) - 0.5)[:, None] * lens.pixel
    pane = (1.0 - lens.eye[2] - v * lens.up[2]) / lens.forward[2]
    height = lens.eye[1] + v * lens.up[1] + pane * lens.forward[1]
    below = np.broadcast_to(height < 0.8 - 0.5 * D, depth.shape) if shown is None else np.ones(depth.shape, bool)
    assert below.mean() > 0.5
    assert np.abs(depth - pane)[below].max() < 1e-5


def test_the_surface_meets_a_pane_along_a_straight_line(make_frame):
    """Noisy water at rest, seen against the front pane: the edge of the wet part is level to a small part of d."""
    x = lattice((0, 0, 0), (1.0, 0.6, 1.0))
    x = np.clip(x + np.random.default_rng(2).normal(0.0, 0.08 * D, x.shape), 0.25 * D, 1.0 - 0.25 * D)
    camera = Camera(eye=(0.5, 1.1, 3.0), target=(0.5, 0.5, 1.0), height=0.6)
    renderer = Renderer(320, 240)
    renderer.render(make_frame(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), x), camera)
    seen = renderer.buffers.water.surface.nearest.to_numpy().view(np.float32)
    lens = camera.lens(320, 240)
    v = (120 - np.arange(240) - 0.5)[:, None] * lens.pixel
    pane = (1.0 - lens.eye[2] - v * lens.up[2]) / lens.forward[2]
    wet = np.abs(seen - pane) < 1e-4
    line = wet[:, 40:-40].argmax(axis=0) * lens.pixel * float(lens.up[1])
    assert wet.any(axis=0).all()
    assert line.std() < 0.08 * D
