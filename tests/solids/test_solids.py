import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import qd
from wavetank.solids.build import build
from wavetank.solids.distance import SolidSet, lift, signed_distance


@qd.kernel
def evaluate(number: qd.i32, solid_set: SolidSet, x: qd.types.ndarray(), out: qd.types.ndarray()):
    for i in range(x.shape[0]):
        out[i] = signed_distance(solid_set, number, lift(x[i]))


def distances(solid, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gradient [n, 3] and distance [n] of one solid at `points` [n, 2 or 3], as the device finds them."""
    points = np.atleast_2d(np.asarray(points, np.float32))
    x = qd.ndarray(qd.types.vector(points.shape[1], qd.f32), shape=(len(points),))
    out = qd.ndarray(qd.types.vector(4, qd.f32), shape=(len(points),))
    x.from_numpy(points)
    evaluate(0, build([solid], 0, 0.0, 0.05), x, out)
    values = out.to_numpy()
    return values[:, :3], values[:, 3]


BALL = wt.Sphere(center=(0, 0, 0), radius=0.5)
PLATE = wt.Box(center=(0.2, 0, 0), size=(0.4, 2, 2))
ALL = [
    wt.Box(center=(0.1, 0.2, 0.3), size=(1.0, 0.6, 0.4), rotation=(0.8, 0.1, 0.5, -0.2)),
    BALL,
    wt.Capsule(start=(-0.3, 0, 0.1), end=(0.4, 0.2, -0.3), radius=0.2),
    wt.Cylinder(start=(-0.3, 0, 0.1), end=(0.4, 0.2, -0.3), radius=0.3),
    wt.HalfSpace(point=(0, 0.1, 0), normal=(1, 2, -1)),
    wt.Union(parts=[BALL, PLATE], center=(0.1, 0, 0)),
    wt.Intersection(parts=[BALL, PLATE]),
    wt.Difference(parts=[BALL, PLATE, wt.Sphere(center=(-0.5, 0, 0), radius=0.2)]),
]
each = pytest.mark.parametrize("solid", ALL, ids=lambda solid: solid.shape)


@each
def test_gradient_is_the_slope_of_the_distance(solid):
    points = np.random.default_rng(0).uniform(-1, 1, (500, 3)).astype(np.float32)
    gradient, distance = distances(solid, points)
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-4)
    step = 2e-3
    slope = np.stack(
        [
            (distances(solid, points + step * axis)[1] - distances(solid, points - step * axis)[1]) / (2 * step)
            for axis in np.eye(3, dtype=np.float32)
        ],
        axis=1,
    )
    # Edges and medial surfaces, where the slope jumps, are a small share of all points.
    assert np.mean(np.abs(slope - gradient).max(axis=1) < 0.02) > 0.97
    assert distance.min() < 0 < distance.max()


@each
def test_distance_never_exceeds_the_way_to_the_surface(solid):
    """Marching along a distance field is safe only if no point of the surface is nearer than it says."""
    rng = np.random.default_rng(1)
    a, b = (rng.uniform(-1, 1, (1000, 3)).astype(np.float32) for _ in range(2))
    way = np.linalg.norm(a - b, axis=1)
    assert np.all(np.abs(distances(solid, a)[1] - distances(solid, b)[1]) <= way + 1e-5)


def test_known_distances():
    assert distances(wt.Box(center=(0, 0, 0), size=(2, 2, 2)), [4, 5, 1])[1] == pytest.approx(5.0)
    assert distances(wt.Cylinder(start=(0, 0, 0), end=(0, 2, 0), radius=1), [4, 6, 0])[1] == pytest.approx(5.0)
    assert distances(wt.Capsule(start=(0, 0, 0), end=(0, 2, 0), radius=1), [3, 6, 0])[1] == pytest.approx(4.0)
    assert distances(wt.HalfSpace(point=(0, 1, 0), normal=(0, 2, 0)), [7, 3.5, 2])[1] == pytest.approx(2.5)


def test_set_operations_decide_by_membership():
    points = np.random.default_rng(2).uniform(-1, 1, (2000, 3)).astype(np.float32)
    ball, plate = distances(BALL, points)[1] < 0, distances(PLATE, points)[1] < 0

    def inside(solid) -> np.ndarray:
        return distances(solid, points)[1] < 0

    np.testing.assert_array_equal(inside(wt.Union(parts=[BALL, PLATE])), ball | plate)
    np.testing.assert_array_equal(inside(wt.Intersection(parts=[BALL, PLATE])), ball & plate)
    np.testing.assert_array_equal(inside(wt.Difference(parts=[BALL, PLATE])), ball & ~plate)


def test_two_numbers_make_a_prism():
    flat = wt.Box(center=(0.5, 0.5), size=(0.4, 0.2), rotation=np.pi / 2)
    gradient, distance = distances(flat, [[0.5, 0.9], [0.9, 0.5]])
    np.testing.assert_allclose(distance, [0.2, 0.3], atol=1e-6)
    np.testing.assert_allclose(gradient, [[0, 1, 0], [1, 0, 0]], atol=1e-6)


def test_too_deep_nesting_is_refused():
    solid = BALL
    for _ in range(9):
        solid = wt.Union(parts=[BALL, solid])
    with pytest.raises(wt.WavetankError, match=r"nests set operations \d+ deep; at most 8"):
        build([solid], 0, 0.0, 0.05)


def test_reach_holds_the_solid():
    points = np.random.default_rng(3).uniform(-2, 2, (3000, 3)).astype(np.float32)
    for solid in ALL:
        inside = points[distances(solid, points)[1] < 0]
        assert np.all(np.linalg.norm(inside - solid.origin, axis=1) <= solid.reach() + 1e-6)
