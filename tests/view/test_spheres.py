"""Particles against the projection of balls worked out in double precision."""

import numpy as np
import pytest

from wavetank import Scene, Tank
from wavetank.view.buffers import NOTHING
from wavetank.view.camera import Camera
from wavetank.view.passes import nothing, spheres
from wavetank.view.renderer import Renderer
from wavetank.view.style import Style

WIDTH, HEIGHT, RADIUS = 120, 90, 0.05


def entry_depths(camera, center, radius=RADIUS):
    """Depth [height, width] at which the ray of each pixel enters the ball; inf where it misses."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    lens = camera.lens(WIDTH, HEIGHT)
    right, up, forward = (np.array([v[k] for k in range(3)], float) for v in (lens.right, lens.up, lens.forward))
    u, v = (columns - WIDTH / 2) / lens.focal, (HEIGHT / 2 - rows) / lens.focal
    across = u[..., None] * right + v[..., None] * up
    origin, direction = np.array(camera.eye) + 0.0 * across, forward + across
    if camera.height is not None:
        origin, direction = np.array(camera.eye) + across, forward + 0.0 * across
    a = np.sum(direction * direction, -1)
    b = np.sum(direction * (origin - center), -1)
    c = np.sum((origin - center) ** 2, -1) - radius**2
    square = b * b - a * c
    return np.where(square >= 0.0, (-b - np.sqrt(np.maximum(square, 0.0))) / a, np.inf)


def drawn(frame, camera):
    """(depth, surface) of the spheres pass, [height, width]."""
    renderer = Renderer(WIDTH, HEIGHT)
    shot = renderer.shot(frame, camera, Style(radius=RADIUS / frame.scene.spacing))
    for draw in (nothing.draw, spheres.draw):
        draw(shot, renderer.buffers)
    pixels = renderer.buffers.pixels
    return pixels.depth.to_numpy().view(np.float32), pixels.surface.to_numpy()


CAMERAS = [
    Camera(eye=(0.5, 0.7, 2.0), target=(0.5, 0.5, 0.5), field_of_view=0.8),
    Camera(eye=(1.2, 1.4, 1.3), target=(0.5, 0.5, 0.5), field_of_view=1.2),  # wide: balls become ellipses
    Camera(eye=(0.45, 0.4, 1.1), target=(0.5, 0.5, 0.5), field_of_view=2.2),  # and wider still
    Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.5), height=1.2),
]


@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("center", [(0.5, 0.5, 0.5), (0.2, 0.8, 0.4), (0.85, 0.15, 0.9), (0.2, 0.9, 0.85)])
def test_a_ball_covers_the_pixels_whose_rays_meet_it(make_frame, tank_scene, camera, center):
    depth, surface = drawn(make_frame(tank_scene, [center]), camera)
    exact, grown, shrunk = (entry_depths(camera, center, RADIUS * size) for size in (1.0, 1.001, 0.999))
    covered = surface == 0
    assert np.isfinite(exact).sum() > 5 or camera is CAMERAS[1]  # which may not see it
    assert not (covered & ~np.isfinite(grown)).any()
    assert not (~covered & np.isfinite(shrunk)).any()
    assert (surface[~covered] == NOTHING).all()
    inner = np.isfinite(shrunk)
    assert np.abs(depth[inner] - exact[inner]).max() < 2e-5


@pytest.mark.parametrize("camera", CAMERAS)
def test_the_nearest_of_many_is_at_every_pixel(make_frame, tank_scene, camera):
    centers = np.random.default_rng(1).uniform(0.2, 0.8, (150, 3)).astype(np.float32)
    _, surface = drawn(make_frame(tank_scene, centers), camera)
    depths = np.stack([entry_depths(camera, center) for center in centers])
    expected = np.where(np.isfinite(depths.min(axis=0)), depths.argmin(axis=0), NOTHING)
    assert (surface != expected).mean() < 2e-3  # rims, where rounding decides


def test_a_particle_of_a_plane_is_a_disc_at_its_place(make_frame):
    scene = Scene(spacing=0.05, tank=Tank(size=(1.0, 0.75)))
    camera = Camera.framing(scene, WIDTH / HEIGHT)
    _, surface = drawn(make_frame(scene, [(0.3, 0.6)]), camera)
    rows, columns = np.nonzero(surface == 0)
    column, row, _ = camera.project((0.3, 0.6, 0.0), WIDTH, HEIGHT)[0]
    assert (columns.mean() + 0.5, rows.mean() + 0.5) == pytest.approx((column, row), abs=0.3)
    assert len(rows) == pytest.approx(np.pi * (RADIUS * HEIGHT / camera.height) ** 2, rel=0.1)


def test_what_is_behind_the_eye_or_at_it_is_not_drawn(make_frame, tank_scene):
    camera = Camera(eye=(0.5, 0.5, 0.5), target=(0.5, 0.5, 0.0))
    _, surface = drawn(make_frame(tank_scene, [(0.5, 0.5, 0.6), (0.5, 0.5, 0.9), (0.5, 0.5, 0.5)]), camera)
    assert (surface == NOTHING).all()


def test_a_ball_that_the_near_plane_cuts_is_left_out(make_frame, tank_scene):
    camera = Camera(eye=(0.5, 0.5, 0.5), target=(0.5, 0.5, 0.0), near=0.1)
    depth, surface = drawn(make_frame(tank_scene, [(0.5, 0.5, 0.37), (0.5, 0.5, 0.2)]), camera)
    assert (surface != 0).all()
    assert (depth > 0.1).all()
    assert 1 in surface


def test_a_ball_at_the_eye_is_bounded(make_frame, tank_scene):
    camera = Camera(eye=(0.5, 0.5, 0.561), target=(0.5, 0.5, 0.0), near=0.01)
    _, surface = drawn(make_frame(tank_scene, [(0.5, 0.5, 0.5)]), camera)
    rows, _ = np.nonzero(surface == 0)
    assert 0.3 * HEIGHT < np.ptp(rows) <= 0.7 * HEIGHT
