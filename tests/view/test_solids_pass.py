"""Solids in the picture against their own distance functions."""

import numpy as np
import pytest

from wavetank import Box, HalfSpace, Mesh, Scene, Sphere, Tank
from wavetank.view.buffers import SOLID
from wavetank.view.camera import Camera
from wavetank.view.passes import nothing, solids, spheres
from wavetank.view.renderer import Renderer
from wavetank.view.style import Style

WIDTH, HEIGHT = 120, 90
FRONT = Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.5), height=1.5)


def buffers_of(frame, camera):
    """The buffers after particles and solids."""
    renderer = Renderer(WIDTH, HEIGHT)
    shot = renderer.shot(frame, camera, Style(radius=0.5))
    for draw in (nothing.draw, spheres.draw, solids.draw):
        draw(shot, renderer.buffers)
    return renderer.buffers


def drawn(frame, camera):
    """(depth, surface) after particles and solids."""
    pixels = buffers_of(frame, camera).pixels
    return pixels.depth.to_numpy().view(np.float32), pixels.surface.to_numpy()


def world(*shapes, size=(1.0, 1.0, 1.0)):
    return Scene(spacing=0.05, tank=Tank(size=size), solids=list(shapes))


def pixel_points():
    """x and y [m] of the pixels' rays from `FRONT`."""
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    metre = HEIGHT / FRONT.height
    return 0.5 + (columns - WIDTH / 2) / metre, 0.5 + (HEIGHT / 2 - rows) / metre


def test_a_ball_has_its_outline_and_depth(make_frame):
    depth, surface = drawn(make_frame(world(Sphere(center=(0.4, 0.6, 0.5), radius=0.3)), []), FRONT)
    x, y = pixel_points()
    square = 0.3**2 - (x - 0.4) ** 2 - (y - 0.6) ** 2
    assert (surface[square > 0.005] == SOLID).all()
    assert (surface[square < -0.005] != SOLID).all()
    inner = square > 0.005
    assert np.abs(depth[inner] - (2.5 - np.sqrt(square[inner]))).max() < 2e-3


def test_a_moved_and_turned_box_is_drawn_where_it_is(make_frame):
    frame = make_frame(world(Box(center=(0.1, 0.1, 0.5), size=(0.1, 0.4, 0.1))), [])
    pose = frame.solids.position.to_numpy()
    pose[-1] = (0.6, 0.5, 0.5)
    frame.solids.position.from_numpy(pose)
    turn = frame.solids.rotation.to_numpy()
    turn[-1] = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # a quarter turn about z: now it lies
    frame.solids.rotation.from_numpy(turn)
    _, surface = drawn(frame, FRONT)
    x, y = pixel_points()
    excess = np.maximum(np.abs(x - 0.6) - 0.2, np.abs(y - 0.5) - 0.05)
    assert (surface[excess < -0.01] == SOLID).all()
    assert (surface[excess > 0.01] != SOLID).all()


def test_the_nearer_of_particle_and_solid_is_seen(make_frame):
    scene = world(Box(center=(0.5, 0.5, 0.5), size=(0.4, 0.4, 0.1)))
    _, surface = drawn(make_frame(scene, [(0.4, 0.5, 0.2), (0.6, 0.5, 0.8)]), FRONT)
    assert 0 not in surface
    assert 1 in surface


def test_walls_of_the_tank_are_not_drawn(make_frame):
    _, surface = drawn(make_frame(world(), [(0.5, 0.5, 0.5)]), FRONT)
    assert SOLID not in surface
    assert 0 in surface


def test_a_half_space_ends_at_the_tank(make_frame):
    scene = world(HalfSpace(point=(0.0, 0.25, 0.0), normal=(0.0, 1.0, 0.0)))
    _, surface = drawn(make_frame(scene, []), FRONT)
    x, y = pixel_points()
    inside = (x > 0.02) & (x < 0.98) & (y > 0.02) & (y < 0.23)
    outside = (x < -0.02) | (x > 1.02) | (y < -0.02) | (y > 0.27)
    assert (surface[inside] == SOLID).all()
    assert (surface[outside] != SOLID).all()


@pytest.mark.parametrize("camera", [FRONT, Camera(eye=(0.5, 0.5, 2.5), target=(0.5, 0.5, 0.0), field_of_view=0.6)])
def test_a_plane_shows_the_cut_in_front_of_particles(make_frame, camera):
    scene = world(Sphere(center=(0.4, 0.6), radius=0.2), Box(center=(0.8, 0.2), size=(0.2, 0.1)), size=(1.0, 1.0))
    frame = make_frame(scene, [(0.4, 0.405), (0.1, 0.1)])
    depth, surface = drawn(frame, camera)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    scale = HEIGHT / (camera.height or 2.0 * 2.5 * np.tan(0.3))
    x, y = 0.5 + (columns - WIDTH / 2) / scale, 0.5 + (HEIGHT / 2 - rows) / scale
    ball = np.hypot(x - 0.4, y - 0.6) - 0.2
    distance = np.minimum(ball, np.maximum(np.abs(x - 0.8) - 0.1, np.abs(y - 0.2) - 0.05))
    assert (surface[distance < -0.01] == SOLID).all()
    assert (surface[distance > 0.01] != SOLID).all()
    assert depth[distance < -0.01] == pytest.approx(camera.eye[2] - 0.025, abs=1e-4)
    assert 1 in surface


def test_the_eye_inside_a_solid_sees_its_inside(make_frame):
    camera = Camera(eye=(0.5, 0.5, 0.5), target=(0.5, 0.5, 0.0))
    scene = world(Sphere(center=(0.5, 0.5, 0.55), radius=0.3))
    pixels = buffers_of(make_frame(scene, [(0.5, 0.5, 0.1)]), camera).pixels
    assert (pixels.surface.to_numpy() == SOLID).all()
    assert (pixels.normal.to_numpy()[..., 2] > 0.5).all()  # it faces the eye


def test_the_near_side_of_a_container_is_left_away(make_frame):
    """What is seen of a vase is its inside, from the far side: rays stopped a step within the near one."""
    vase = Mesh(path="wavetank/vase.obj", center=(0.5, 0.5, 0.5), size=0.9, invert=True)
    pixels = buffers_of(make_frame(world(vase), []), FRONT).pixels
    depth = pixels.depth.to_numpy().view(np.float32)
    x, y = pixel_points()
    hollow = np.hypot((x - 0.5) / 0.22, (y - 0.4) / 0.1) < 1.0  # its belly, 0.3 m wide
    assert (pixels.surface.to_numpy()[hollow] == SOLID).all()
    assert (depth[hollow] > 2.55).all()
    assert (pixels.normal.to_numpy()[hollow][:, 2] > 0.3).all()  # it faces the eye


def test_the_box_of_solids_is_empty_when_they_are_out_of_sight(make_frame):
    frame = make_frame(world(Sphere(center=(0.5, 0.5, 0.5), radius=0.1)), [])
    aside = buffers_of(frame, Camera(eye=(5.0, 0.5, 3.0), target=(5.0, 0.5, 0.0), height=1.0))
    first, last, _, _ = aside.solid_box.to_numpy()
    assert first > last
    before = buffers_of(frame, Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.0), height=1.0))
    first, last, _, _ = before.solid_box.to_numpy()
    assert 0 < first < last < WIDTH - 1
