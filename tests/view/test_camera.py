import math

import numpy as np
import pytest
from worlds import frame_of

from wavetank import Block, Scene, Sphere, Tank
from wavetank.foundation.errors import WavetankError
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of, extent_of_water

CAMERA = Camera(eye=(1.0, 2.0, 3.0), target=(0.2, 0.1, -0.3))


@pytest.mark.parametrize(("azimuth", "elevation"), [(0.7, 0.2), (-2.0, 5.0), (9.0, -7.0)])
def test_orbit_keeps_distance_and_target(azimuth, elevation):
    moved = CAMERA.orbit(azimuth, elevation)
    assert moved.target == CAMERA.target
    assert moved.distance == pytest.approx(CAMERA.distance, rel=1e-9)
    assert abs(moved.eye[1] - moved.target[1]) < moved.distance  # never over the pole


def test_orbit_turns_around_the_vertical():
    flat = Camera(eye=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0))
    assert flat.orbit(math.pi / 2, 0.0).eye == pytest.approx((2.0, 0.0, 0.0), abs=1e-12)
    assert flat.orbit(0.0, math.pi / 6).eye == pytest.approx((0.0, 1.0, math.sqrt(3.0)), abs=1e-12)


def test_zoom_scales_what_is_in_view():
    for camera in (CAMERA, Camera(eye=(0, 0, 2), target=(0, 0, 0), height=1.5)):
        assert camera.zoom(0.5).visible_height == pytest.approx(0.5 * camera.visible_height)
    assert CAMERA.zoom(1e-9).distance > 0.0


def test_pan_moves_the_picture_by_a_share_of_its_height():
    moved = CAMERA.pan(0.25, -0.1)
    assert moved.distance == pytest.approx(CAMERA.distance)
    column, row, _ = moved.project(CAMERA.target, 200, 100)[0]
    assert (column, row) == pytest.approx((100 - 25, 50 - 10), abs=1e-3)


@pytest.mark.parametrize("height", [None, 2.0])
def test_ray_goes_through_the_point_that_projects_there(height):
    camera = Camera(eye=(1.0, 2.0, 3.0), target=(0.2, 0.1, -0.3), height=height)
    point = np.array([0.4, 0.3, 0.1])
    column, row, depth = camera.project(point, 320, 240)[0]
    origin, direction = camera.ray(column, row, 320, 240)
    offset = point - origin
    assert depth > 0.0
    assert np.linalg.norm(np.cross(offset, direction)) < 1e-6


def test_what_is_behind_the_eye_has_no_pixel():
    assert np.isnan(CAMERA.project((2.0, 4.0, 7.0), 64, 64)[0, :2]).all()


@pytest.mark.parametrize("size", [(1.6, 0.8, 0.8), (0.1, 3.0, 0.1), (20.0, 1.0, 5.0), (1.6, 0.9), (0.2, 2.0)])
@pytest.mark.parametrize("aspect", [16 / 9, 1.0, 0.5])
def test_framing_shows_all_of_the_tank_and_little_else(size, aspect):
    scene = Scene(spacing=0.05, tank=Tank(size=size))
    pixels = Camera.framing(scene, aspect).project(extent_of(scene).corners, int(1000 * aspect), 1000)
    share = pixels[:, :2] / (1000 * aspect, 1000)
    assert share.min() > 0.0
    assert share.max() < 1.0
    assert np.ptp(share, axis=0).max() > 0.7
    if scene.dim == 3:
        assert share.min(axis=0) + share.max(axis=0) == pytest.approx([1.0, 1.0], abs=0.003)
    assert (pixels[:, 2] > 0.0).all()


def test_framing_of_a_plane_is_orthographic_and_straight():
    camera = Camera.framing(Scene(spacing=0.05, tank=Tank(size=(1.6, 0.9))))
    assert camera.height is not None
    assert camera.eye[:2] == camera.target[:2]


def test_framing_without_a_tank_shows_fluids_and_solids():
    scene = Scene(
        spacing=0.05, fluids=[Block(lower=(0, 0, 0), upper=(1, 1, 1))], solids=[Sphere(center=(3, 0, 0), radius=0.5)]
    )
    extent = extent_of(scene)
    assert extent.lower.tolist() == [0, -0.5, -0.5]
    assert extent.upper.tolist() == [3.5, 1, 1]
    empty = extent_of(Scene(spacing=0.05))
    assert (empty.upper > empty.lower).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"target": (1.0, 2.0, 3.0)},
        {"eye": (math.nan, 0, 0)},
        {"eye": (0, 0)},
        {"field_of_view": 0.0},
        {"field_of_view": 4.0},
        {"near": 0.0},
        {"height": -1.0},
        {"up": (0, 0, 0)},
    ],
)
def test_impossible_cameras_are_refused(wrong):
    with pytest.raises(WavetankError, match="camera"):
        Camera(**({"eye": (1.0, 2.0, 3.0), "target": (0.0, 0.0, 0.0)} | wrong))


def test_impossible_zoom_is_refused():
    with pytest.raises(WavetankError, match="zoom"):
        CAMERA.zoom(0.0)


def test_a_still_frames_the_water_and_the_solids_but_no_single_drop():
    """A puddle in a tall tank fills the picture; a drop that flies high is no reason to step back."""
    scene = Scene(spacing=0.05, tank=Tank(size=(2, 3, 1)), solids=[Sphere(center=(1.7, 0.2, 0.5), radius=0.1)])
    puddle = np.random.default_rng(2).uniform((0.2, 0.0, 0.3), (0.8, 0.2, 0.6), (2000, 3))
    box = extent_of_water(frame_of(scene, np.concatenate([puddle, [(1.0, 2.9, 0.5)]])))
    assert (box.lower <= (0.22, 0.0, 0.32)).all() and (box.lower >= (0.05, 0.0, 0.15)).all()
    assert (box.upper >= (1.8, 0.3, 0.6)).all() and (box.upper <= (2.0, 0.45, 0.75)).all()
    pixels = Camera.framing_extent(box).project(puddle, 1600, 900)
    assert (pixels[:, :2] > 0).all() and (pixels[:, 0] < 1600).all() and (pixels[:, 1] < 900).all()


def test_a_still_frames_the_floor_below_what_floats_and_all_of_an_empty_tank():
    scene = Scene(spacing=0.05, tank=Tank(size=(1, 2, 1)))
    assert extent_of_water(frame_of(scene, [(0.5, 1.5, 0.5)])).lower[1] == 0.0
    np.testing.assert_array_equal(extent_of_water(frame_of(scene, np.zeros((0, 3)))).upper, (1, 2, 1))
    plane = Scene(spacing=0.05, tank=Tank(size=(2, 3)))
    np.testing.assert_array_equal(extent_of_water(frame_of(plane, [(0.1, 0.1)])).upper, (2, 3, 0))
