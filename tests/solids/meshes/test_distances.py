"""Distances to meshes whose distances are known."""

import numpy as np
import pytest
from surfaces import CUBE, ball, cup

import wavetank as wt
from wavetank.device.compiler import qd
from wavetank.solids.build import build, resize
from wavetank.solids.distance import SolidSet, lift, signed_distance


@qd.kernel
def evaluate(solid_set: SolidSet, x: qd.types.ndarray(), out: qd.types.ndarray()):
    for i in range(x.shape[0]):
        out[i] = signed_distance(solid_set, 0, lift(x[i]))


def distances(solid, points, spacing=0.05):
    """Gradient [n, 3] and distance [n] of one solid at `points` [n, 3], as the device finds them."""
    x = qd.ndarray(qd.types.vector(3, qd.f32), shape=(len(points),))
    out = qd.ndarray(qd.types.vector(4, qd.f32), shape=(len(points),))
    x.from_numpy(np.asarray(points, np.float32))
    evaluate(build([solid], 0, 0.0, spacing), x, out)
    values = out.to_numpy()
    return values[:, :3], values[:, 3]


POSE = {"center": (0.1, 0.2, -0.1), "rotation": (0.9, 0.1, 0.3, -0.2)}
BOX = wt.Mesh.of(*CUBE, size=(0.5, 0.4, 0.3), **POSE)
BALL = wt.Mesh.of(*ball(), size=0.5, **POSE)
TWINS = {
    "box": (BOX, wt.Box(size=(0.5, 0.4, 0.3), **POSE)),
    "ball": (BALL, wt.Sphere(center=POSE["center"], radius=0.25)),
}
each = pytest.mark.parametrize("name", TWINS)


def cloud(count, width=1.5, seed=0):
    return np.random.default_rng(seed).uniform(-width, width, (count, 3)).astype(np.float32)


@each
def test_distances_are_those_of_the_shape(name):
    """Around a mesh as far as water feels a wall, within a tenth of a cell but for edges, which lose half a cell."""
    mesh, twin = TWINS[name]
    points, cell = cloud(20000, 0.5), 0.05 / 4
    _, found = distances(mesh, points)
    _, exact = distances(twin, points)
    near = np.abs(exact) < 3.0 * 0.05
    error = np.abs(found - exact)[near]
    assert near.sum() > 4000
    assert np.mean(error < 0.1 * cell) > 0.95
    assert error.max() < 0.5 * cell
    np.testing.assert_array_equal((found < 0)[np.abs(exact) > 0.5 * cell], (exact < 0)[np.abs(exact) > 0.5 * cell])


def test_triangles_without_area_say_nothing_about_thickness():
    """Those at the poles of a ball: rounded corners give each a normal of its own, which sees a thin solid."""
    vertices, faces = ball()
    corners = vertices[faces] + np.random.default_rng(1).normal(0.0, 1e-7, (*faces.shape, 3))
    mesh = wt.Mesh.of(corners.reshape(-1, 3), np.arange(faces.size).reshape(-1, 3), size=0.5, **POSE)
    points = cloud(20000, 0.5)
    near = np.abs(exact := distances(TWINS["ball"][1], points)[1]) < 3.0 * 0.05
    assert np.abs(distances(mesh, points)[1] - exact)[near].max() < 0.5 * 0.05 / 4


@each
def test_gradients_are_those_of_the_shape(name):
    mesh, twin = TWINS[name]
    points = cloud(20000, 0.5)
    found, distance = distances(mesh, points)
    exact, _ = distances(twin, points)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-4)
    near = np.abs(distance) < 3.0 * 0.05
    assert np.mean(np.sum(found * exact, axis=1)[near] > 0.99) > 0.95


@each
def test_no_distance_is_too_long_far_out(name):
    """Contact and light march by these distances: beyond the grid, too, they may fall short but not reach too far."""
    mesh, twin = TWINS[name]
    points = cloud(20000, 4.0)
    _, found = distances(mesh, points)
    _, exact = distances(twin, points)
    outside = exact > 0
    assert np.all(found[outside] <= exact[outside] + 1e-3)
    assert np.all(found[outside] >= 0.5 * exact[outside] - 1e-3)


def test_sharing_turning_and_growing():
    """Equal meshes share a grid; a set operation places it; a growing one is smaller, not wrong."""
    pair = [BALL, BALL.model_copy(update={"center": (1.0, 0.0, 0.0)}), BOX]
    device = build(pair, 0, 0.0, 0.05)
    assert device.grid.shape == (2,)
    points = cloud(2000, 0.5)
    shifted = wt.Union(parts=[BALL, BALL], center=(0.3, 0.0, 0.0))
    np.testing.assert_allclose(
        distances(shifted, points + np.float32((0.3, 0, 0)))[1], distances(BALL, points)[1], atol=1e-5
    )
    device = build([BALL], 0, 0.0, 0.05)
    resize(device, [BALL], [0.5])
    x, out = (qd.ndarray(qd.types.vector(n, qd.f32), shape=(1,)) for n in (3, 4))
    x.from_numpy(np.array([[0.1, 0.2 + 0.175, -0.1]], np.float32))
    evaluate(device, x, out)
    assert out.to_numpy()[0, 3] == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize("wall", [0.0005, 0.005, 0.02])
def test_thin_walls_stay(wall):
    """Whatever its thickness, on every way out of a cup lies a wall of at least a quarter of a spacing."""
    d = 0.02
    solid = wt.Mesh.of(*cup(0.12, 0.2, wall), center=(0, 0.1, 0), size=0.24)
    t = np.linspace(0.0, 2.0 * np.pi, 400)
    deep = np.linspace(0.08, 0.16, 400)
    for height in (0.03, 0.1, 0.17):
        ways = np.stack([np.outer(np.cos(t), deep), np.full((400, 400), height), np.outer(np.sin(t), deep)], axis=-1)
        _, found = distances(solid, ways.reshape(-1, 3), d)
        inside = (found < 0).reshape(400, 400)
        thick = inside.sum(axis=1) * (deep[1] - deep[0])
        assert thick.min() > 0.25 * d
        assert thick.max() < max(wall, 0.375 * d) + 0.2 * d
    floor = np.stack([np.zeros(400), np.linspace(-0.05, 0.05, 400), np.zeros(400)], axis=1)
    assert (distances(solid, floor, d)[1] < 0).sum() * 0.1 / 400 > 0.25 * d


def test_faces_of_an_open_surface_become_walls():
    """A plate of thickness 0.1 from two triangles."""
    corners = [(-0.5, 0, -0.5), (0.5, 0, -0.5), (0.5, 0, 0.5), (-0.5, 0, 0.5)]
    plate = wt.Mesh.of(corners, [(0, 1, 2), (0, 2, 3)], center=(0, 0, 0), size=1.0, thickness=0.1)
    height = np.linspace(-0.1, 0.1, 41)
    _, found = distances(plate, np.stack([0.2 + 0 * height, height, 0 * height], axis=1), 0.04)
    np.testing.assert_allclose(found, np.abs(height) - 0.05, atol=5e-3)


def test_up_turns_the_file():
    """What points along z in a file whose up is z points along y in the world."""
    vertices = np.array(CUBE[0]) * (1, 1, 3) + (0, 0, 7)
    vertices[vertices[:, 2] > 7, 0] *= 0.2
    solid = wt.Mesh.of(vertices, CUBE[1], center=(0, 0, 0), size=0.6, up="z")
    _, found = distances(
        solid, [(0.08, -0.25, 0), (0.08, 0.25, 0), (0, 0.29, 0), (0, 0.31, 0), (0, 0, 0.08), (0, 0, 0.12)]
    )
    np.testing.assert_array_equal(found < 0, [True, False, True, False, True, False])


def dirty(vertices, faces):
    """The same surface as the worst of exporters writes it: no corner shared, some faces twice, cracks, specks."""
    rng = np.random.default_rng(0)
    soup = vertices[faces].reshape(-1, 3) + rng.normal(0, 1e-5, (3 * len(faces), 3))
    numbers = np.arange(len(soup)).reshape(-1, 3)
    return soup, np.concatenate([numbers, numbers[::7], [[0, 0, 5]]])


def test_dirt_does_no_harm():
    points = cloud(20000, 0.5)
    clean, twin = distances(BALL, points)[1], wt.Mesh.of(*dirty(*ball()), size=0.5, **POSE)
    found = distances(twin, points)[1]
    near = np.abs(clean) < 3.0 * 0.05
    error = np.abs(found - clean)[near]
    assert np.median(error) < 5e-5
    assert error.max() < 0.0125, "a speck that looks like a thin wall swells, by less than a cell"
    np.testing.assert_array_equal((found < 0)[~near], (clean < 0)[~near])


def test_a_small_hole_is_closed():
    vertices, faces = ball()
    points = cloud(20000, 0.5)
    found, whole = (distances(solid, points)[1] for solid in (wt.Mesh.of(vertices, faces[5:], size=0.5, **POSE), BALL))
    near = np.abs(whole) < 3.0 * 0.05
    np.testing.assert_allclose(found[near], whole[near], atol=0.02)
    np.testing.assert_array_equal((found < 0)[~near], (whole < 0)[~near])


def test_all_faces_may_be_turned_and_parts_may_overlap():
    vertices, faces = CUBE
    points = cloud(5000, 0.5)
    np.testing.assert_allclose(
        distances(wt.Mesh.of(vertices, faces[:, ::-1], size=0.5, **POSE), points)[1],
        distances(wt.Mesh.of(vertices, faces, size=0.5, **POSE), points)[1],
        atol=1e-6,
    )
    twice = wt.Mesh.of([*vertices, *(vertices + (0.5, 0, 0))], [*faces, *(faces + 8)], center=(0, 0, 0), size=0.75)
    _, found = distances(twice, [(0, 0, 0), (0.3, 0.2, 0.2), (0.4, 0, 0)])
    np.testing.assert_array_equal(found < 0, [True, True, False])
    hollow = wt.Mesh.of([*vertices, *(0.8 * vertices)], [*faces, *(faces[:, ::-1] + 8)], center=(0, 0, 0), size=1.0)
    _, found = distances(hollow, [(0, 0, 0), (0.45, 0, 0), (0.55, 0, 0)])
    np.testing.assert_array_equal(found < 0, [False, True, False])
