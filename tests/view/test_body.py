"""A tank as a body of water: panes that mirror totally from within, edges that do not fade, the bent ray's end."""

import numpy as np
import pytest
from test_ellipsoids import lattice
from worlds import frame_of

from wavetank import Box, Camera, Capsule, Scene, Simulation, Sphere, Tank
from wavetank.device.compiler import download, qd, upload
from wavetank.solids.distance import SolidSet
from wavetank.view.lens import Lens, basis, lens_at, ray_direction, vec2, vec3, vec4, view_ray
from wavetank.view.optics.normals import normal_of, rise_at, unevenness
from wavetank.view.optics.rays import OPEN, box
from wavetank.view.optics.rays import Box as Walls
from wavetank.view.optics.water_volume import refract_out_blurred, solid_ahead
from wavetank.view.renderer import Renderer

D = 0.05
SIZE = (240, 180)


def filled(height=0.6, solids=()):
    x = lattice((0, 0, 0), (1.0, height, 1.0)) if height else np.zeros((0, 3))
    return frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=list(solids)), x)


def picture(frame, camera):
    return Renderer(*SIZE).render(frame, camera, view="water").astype(int)


def around(image, camera, point, half=2):
    column, row, _ = camera.project(point, *SIZE)[0]
    return image[int(row) - half : int(row) + half + 1, int(column) - half : int(column) + half + 1].reshape(-1, 3)


@pytest.mark.parametrize("x", [0.04, 0.96])
def test_water_does_not_fade_towards_the_edges_of_a_pane(x):
    """Seen aslant the straight way through the far corner is short; the bent ray is mirrored and goes on."""
    camera = Camera(eye=(2.6 if x < 0.5 else -1.6, 0.9, 2.6), target=(0.5, 0.3, 0.5))
    wet, dry = (picture(filled(height), camera) for height in (0.6, 0.0))
    change = [np.abs(around(wet, camera, p) - around(dry, camera, p)).mean() for p in ((x, 0.3, 1.0), (0.5, 0.3, 1.0))]
    assert change[0] > 0.5 * change[1] > 15


@pytest.mark.parametrize("eye", [(-1.6, 1.3, 2.9), (-1.2, 1.5, 2.2)])
def test_a_block_that_ends_before_the_tank_has_its_upper_corner(eye):
    """The sun's way through it ends in air, before the tank's wall: its colour was 0.26 and 0.22 of the middle's."""
    scene = Scene(spacing=D, tank=Tank(size=(2.4, 1.2, 1.0)))
    frame = frame_of(scene, lattice((0, 0, 0), (1.0, 1.0, 1.0)))
    bare = frame_of(scene, np.zeros((0, 3)))
    camera = Camera(eye=eye, target=(0.6, 0.5, 0.5))
    wet, dry = picture(frame, camera), picture(bare, camera)
    corner, middle = (
        np.abs(around(wet, camera, p) - around(dry, camera, p)).mean() for p in ((0.85, 0.85, 1.0), (0.4, 0.5, 1.0))
    )
    assert corner > 0.45 * middle > 15


def test_a_pane_mirrors_totally_what_comes_in_through_the_one_beside():
    """A red wall behind the right pane is not seen through the front pane: sin^2 + sin^2 > 1 for both angles (Snell).

    A ray that enters the front pane at any angle is within 48.6 degrees of its normal in the water, and at least 41.4
    degrees from that of the pane beside; it leaves there only where it came in at more than 62 degrees.
    """
    red = Box(center=(1.6, 0.5, 0.5), size=(0.1, 1.0, 2.4), color="#ff0000")
    camera = Camera(eye=(0.3, 0.45, 2.6), target=(0.9, 0.3, 1.0), field_of_view=0.5)

    def change(height):
        seen = [around(picture(filled(height, solids), camera), camera, (0.92, 0.3, 1.0), 3) for solids in ((red,), ())]
        return np.abs(seen[0] - seen[1]).mean()

    assert change(0.0) > 40
    assert change(0.6) < 3


def test_the_floor_is_lifted_as_snell_has_it():
    """From straight above, the floor below the depth h appears at 3/4 of it: a stripe is 4/3 of a spread nearer.

    The ray at the angle t from the vertical meets the floor h (tan t - tan asin(sin t / 1.33)) nearer to the middle.
    """
    camera = Camera(eye=(0.5, 2.0, 0.5), target=(0.5, 0.0, 0.5))
    stripe = Box(center=(0.8, -0.02, 0.5), size=(0.03, 0.05, 0.9), color="#000000")
    x = lattice((0, 0, 0), (1.0, 0.6, 1.0))
    columns = []
    for water in (x, np.zeros((0, 3))):
        frame = frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=[stripe]), water)
        row = picture(frame, camera)[88:92].sum(axis=(0, 2)).astype(float)
        window = row[150:215] - np.median(row[150:215])
        columns.append(150 + int(np.argmin(window)))
    lens = camera.lens(*SIZE)
    slope = (columns[0] + 0.5 - 120) * lens.pixel  # tan of the angle at which the wet stripe is seen
    angle = np.arctan(slope)
    met = 0.5 + slope * (2.0 - 0.6) + 0.6 * np.tan(np.arcsin(np.sin(angle) / 1.33))
    assert columns[0] != columns[1]
    assert met == pytest.approx(0.8, abs=0.02)


@pytest.mark.parametrize("angle", [61.5, 62.0, 63.0, 66.0])
def test_what_leaves_by_a_pane_fades_as_fresnel_has_it(angle):
    """A ray comes in through the front pane, and leaves by the one beside where it came in at more than 61.3 degrees.

    There the pane begins to mirror all of it: without a step, by Fresnel's equations for light without polarisation;
    where it enters they are Schlick's. What is mirrored by 5 % is let out as a whole.
    """
    walls = [Box(center=(1.1, 0.5, -2.1), size=(0.1, 4.0, 6.0), color=color) for color in ("#808080", "#000000")]

    def leaves(turn):
        at = np.array([0.9, 0.4, 1.0])
        camera = Camera(eye=tuple(at + 1.5 * np.array([-np.sin(turn), 0.02, np.cos(turn)])), target=tuple(at))
        seen = []
        for wall in walls:
            renderer = Renderer(*SIZE)
            renderer.render(filled(0.8, (wall,)), camera, view="water")
            seen.append(download(renderer.buffers.pixels.color)[90, 120])
        cosi, cost = np.sin(turn) / 1.33, np.sqrt(1.0 - 1.33**2 + np.sin(turn) ** 2)
        sides = (1.33 * cosi - cost) / (1.33 * cosi + cost), (cosi - 1.33 * cost) / (cosi + 1.33 * cost)
        out = (1.0 - np.mean(np.square(sides))) / 0.95
        return (seen[0] - seen[1])[2] / (out * (0.98 - 0.98 * (1.0 - np.cos(turn)) ** 5))

    assert leaves(np.radians(angle)) == pytest.approx(leaves(np.radians(75.0)), rel=0.08)


def test_pixels_that_share_a_bent_ray_are_other_pairs_in_every_second_sample():
    """What is found for two pixels at once must not leave stairs two pixels wide in a picture of many samples."""
    camera = Camera(eye=(1.9, 1.4, 2.2), target=(0.5, 0.3, 0.5))
    image = Renderer(*SIZE).render(filled(), camera, view="water", floor="tiles", samples=16).astype(int)
    steps = np.abs(np.diff(image, axis=1)).sum(axis=(0, 2))
    within, between = steps[::2].sum(), steps[1::2].sum()
    assert within == pytest.approx(between, rel=0.02)


@qd.kernel
def cross_all(found: qd.types.ndarray(), angles: qd.types.ndarray(), spread: qd.f32, count: qd.i32):
    for k in range(count):
        up = vec3(0.0, 1.0, 0.0)
        found[k] = refract_out_blurred(vec3(qd.sin(angles[k]), qd.cos(angles[k]), 0.0), up, spread)


def crossing(angles, spread):
    """(Direction outside, share that is mirrored) of rays from below at these angles [rad] from the vertical."""
    found, given = qd.ndarray(vec4, shape=(len(angles),)), qd.ndarray(qd.f32, shape=(len(angles),))
    upload(given, np.asarray(angles, np.float32))
    cross_all(found, given, spread, len(angles))
    rays = download(found).reshape(-1, 4)
    assert np.allclose(np.linalg.norm(rays[rays[:, 3] < 1.0, :3], axis=1), 1.0, atol=1e-4)
    return rays.copy()


def test_total_reflection_begins_gradually_where_rays_spread():
    """A tenth of a degree changes little, the flatter the more is mirrored, and far from there all is exact."""
    angles = np.radians(np.arange(35.0, 60.0, 0.1))
    exact, blurred = (crossing(angles, spread)[:, 3] for spread in (0.0, 0.3 / 3.9))
    assert np.diff(exact).max() > 0.1
    assert np.diff(blurred).max() < 0.02
    assert np.diff(blurred).min() > -1e-3
    far = np.abs(1.0 - 1.33**2 * np.sin(angles) ** 2) > 0.31
    assert np.array_equal(exact[far], blurred[far])
    assert exact[np.searchsorted(np.sin(angles), 1.0 / 1.33) + 1] == 1.0


def test_broken_water_lets_nothing_out_straight_up_that_it_should_mirror():
    """However much rays spread, those beyond the critical angle leave at 50 degrees from the normal or more."""
    rays = crossing(np.radians(np.arange(49.0, 85.0, 1.0)), 2.0)
    out = rays[rays[:, 3] < 1.0]
    assert len(out) > 10
    assert out[:, 1].max() < np.cos(np.radians(50.0))


@qd.kernel
def rough_of(found: qd.types.ndarray(), depth: qd.types.ndarray(), lens: Lens, walls: Walls, spacing: qd.f32):
    for row, column in qd.ndrange((40, 41), (40, 41)):
        z = qd.bit_cast(depth[row, column], qd.f32)
        n = normal_of(lens, row, column, z, rise_at(row, column, z, 3.0 * spacing, depth))
        direction = ray_direction(lens, view_ray(lens, row, column))
        found[0] = unevenness(lens, walls, row, column, z, n, direction, spacing, depth)


def uneven(depth_of, walls=OPEN):
    """`unevenness` in the middle of a map of 81 x 81 pixels of 0.05 spacings, by a function of u and v [m]."""
    lens = lens_at(
        np.zeros(3),
        basis(np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])),
        81,
        81,
        400.0,
        perspective=False,
        near=0.0,
    )
    u, v = np.meshgrid((np.arange(81) - 40) / 400.0, (40 - np.arange(81)) / 400.0)
    depth, found = qd.ndarray(qd.i32, shape=(81, 81)), qd.ndarray(qd.f32, shape=(1,))
    upload(depth, np.asarray(depth_of(u, v), np.float32).view(np.int32))
    rough_of(found, depth, lens, walls, D)
    return float(download(found)[0])


def test_a_plane_is_even_and_a_ball_as_uneven_as_it_is_round():
    """On a ball normals a spacing away are turned by spacing / radius: that by the root of 6 is their deviation."""

    def ball(u, v):
        return 2.0 - np.sqrt(0.25**2 - u * u - v * v)

    assert uneven(lambda u, v: 2.0 + 1.5 * u - 0.7 * v) < 1e-3
    assert uneven(ball) == pytest.approx(D / 0.25 / np.sqrt(6.0), rel=0.1)
    # Where the surface ends on one side the other counts, and where it does on both it is broken.
    assert uneven(lambda u, v: np.where(u > 0.02, 1e38, ball(u, v))) == pytest.approx(uneven(ball), rel=0.1)
    assert uneven(lambda u, v: np.where(abs(u) > 0.02, 1e38, ball(u, v))) > np.sqrt(1.0 / 12.0)


def test_a_plane_is_even_beside_the_edge_of_its_tank_whatever_lies_beyond():
    """The map goes on behind the panes, and bends there; in a corner nothing is known of either axis."""

    def bent_beyond(u, v):
        return 2.0 + 30.0 * np.maximum(u - 0.01, 0.0) ** 2 + 30.0 * np.maximum(v - 0.01, 0.0) ** 2

    assert uneven(bent_beyond) > 0.05
    assert uneven(bent_beyond, box((-1.0, -1.0, -3.0), (0.012, 0.012, 0.0))) < 1e-3
    assert uneven(bent_beyond, box((-0.02, -0.02, -3.0), (0.012, 0.012, 0.0))) < 1e-3


@qd.kernel
def meet(
    found: qd.types.ndarray(),
    solids: SolidSet,
    paints: qd.types.ndarray(),
    heights: qd.types.ndarray(),
    wide: qd.f32,
    count: qd.i32,
):
    for k in range(count):
        hit, _, cover = solid_ahead(solids, paints, vec3(0.0, heights[k], 0.5), vec3(1.0, 0.0, 0.0), 2.0, 0.001, wide)
        found[k] = vec2(hit.w, cover)


def test_a_solid_beside_rays_that_spread_has_a_share_of_them():
    """A ball of 0.1 m, a metre away: a single ray meets it or not; a cone of the slope 0.1 meets it 0.1 m beside it."""
    solids = filled(0.0, (Sphere(center=(1.0, 0.5, 0.5), radius=0.1),)).solids
    paints, given = qd.ndarray(vec3, shape=(solids.count,)), qd.ndarray(qd.f32, shape=(40,))
    paints.fill(0.5)
    heights = np.linspace(0.5, 0.75, 40)
    upload(given, heights.astype(np.float32))
    covers = []
    for wide in (0.0, 0.1):
        found = qd.ndarray(vec2, shape=(40,))
        meet(found, solids, paints, given, wide, 40)
        covers.append(download(found).reshape(-1, 2)[:, 1].copy())
    inside, outside = heights < 0.599, heights > 0.602
    assert (covers[0][inside] == 1.0).all() and (covers[0][outside] == 0.0).all()
    assert (covers[1][inside] == 1.0).all() and (covers[1][heights > 0.71] == 0.0).all()
    near = covers[1][outside & (heights < 0.695)]
    assert (np.diff(near) < 0.0).all() and near[0] > 0.9 and near[-1] < 0.1


def test_the_outline_of_a_solid_in_the_water_has_no_specks():
    """Where a bent ray met a solid next to its outline, half of what was shown lay behind it: teeth and pale specks."""
    frame = filled(0.6, [Sphere(center=(0.5, 0.3, 0.6), radius=0.18, color="#200000")])
    camera = Camera(eye=(0.9, 0.8, 2.4), target=(0.5, 0.3, 0.5), field_of_view=0.45)
    image = picture(frame, camera)
    column, row, _ = camera.project((0.5, 0.3, 0.6), *SIZE)[0]
    part = image[int(row) - 38 : int(row) + 44, int(column) - 52 : int(column) + 52].sum(axis=2)
    dark = part < 0.5 * (np.median(part[36:44, 48:56]) + np.median(part[:, :6]))
    ends = np.diff(np.pad(dark, ((0, 0), (1, 1))).astype(int), axis=1)
    assert dark[40].sum() > 40
    assert (ends > 0).sum(axis=1).max() == 1


def test_a_slanted_outline_in_the_water_has_no_teeth_where_there_are_many_samples():
    """Of two pixels that share a ray it is the left one's in one pair, the right one's in the next: teeth of four."""
    rod = Capsule(start=(0.35, 0.05, 0.6), end=(0.55, 0.55, 0.6), radius=0.1, color="#200000")
    camera = Camera(eye=(0.5, 0.32, 2.6), target=(0.5, 0.3, 0.5), field_of_view=0.4)
    image = Renderer(*SIZE).render(filled(0.6, [rod]), camera, view="water", samples=16).astype(float)
    top, bottom = (int(row) for row in camera.project([(0.5, 0.42, 1.0), (0.4, 0.16, 1.0)], *SIZE)[:, 1])
    light = image[top:bottom, : SIZE[0] // 2].sum(axis=2)
    rows, half = np.arange(bottom - top), 0.5 * (light.min(axis=1) + np.median(light[:, :50], axis=1))
    first = (light < half[:, None]).argmax(axis=1)
    before, after = light[rows, first - 1], light[rows, first]
    place = first - (half - after) / (before - after)
    off = place - np.polyval(np.polyfit(rows, place, 1), rows)
    assert np.ptp(place) > 15.0
    assert off.std() < 0.15, "0.58 with two kinds of pairs"


def test_what_lies_beyond_the_ground_does_not_shine_through_it():
    """No water is above where a ray would end beyond the ground: it left the water next to the ground, and passed it.

    Dotted rings of sky lay over the deep end of the mountain lake.
    """
    frame = Simulation(Scene.load("mountain-lake").changed(spacing=0.04)).frame()
    camera = Camera(eye=(1.95, 2.2, 1.45), target=(0.6, 0.35, -0.35))
    image = Renderer(640, 360).render(frame, camera, view="water").astype(int).sum(axis=2)
    deep = image[55:165, 95:280]
    brighter = deep[3:-3] - np.maximum(deep[:-6], deep[6:])
    assert (brighter > 60).sum() < 10, "174 before"
