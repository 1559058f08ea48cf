"""What the water passes promise: flat where it is flat, darker where it is deep, the same from frame to frame."""

import dataclasses
import itertools

import numpy as np
import pytest
from test_ellipsoids import lattice

from wavetank import Block, Box, Scene, Simulation, Tank
from wavetank.device.compiler import qd
from wavetank.foundation.materials import Material
from wavetank.view.camera import Camera
from wavetank.view.lens import vector
from wavetank.view.look import pool as pool_look
from wavetank.view.optics.fluid import coarseness
from wavetank.view.optics.rays import OPEN, box
from wavetank.view.passes import ellipsoids, flatten, thickness
from wavetank.view.renderer import Renderer, affordable
from wavetank.view.style import Style

D = 0.05
CAMERA = Camera(eye=(0.7, 1.3, 2.6), target=(0.5, 0.3, 0.5))


def pool(make_frame, depth=0.5, noise=0.0, **scene):
    x = lattice((0, 0, 0), (1.0, depth, 1.0))
    x = x + np.random.default_rng(1).normal(0.0, noise * D, x.shape) if noise else x
    return make_frame(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), **scene), np.clip(x, 0.25 * D, 1 - 0.25 * D))


def smoothed(field, camera=CAMERA, walls=OPEN):
    """`field` of depths [m] after the filter, as `camera` sees it."""
    rows, columns = field.shape
    depth, spare = (qd.ndarray(qd.i32, shape=field.shape) for _ in range(2))
    depth.from_numpy(np.ascontiguousarray(field, np.float32).view(np.int32) & ~1)
    flatten.smooth_depth(depth, spare, camera.lens(columns, rows), walls, flatten.SIGMA * D, D)
    return depth.to_numpy().view(np.float32)


def slanted(camera=CAMERA, rows=90, columns=120):
    """Depths of a plane that is seen at a grazing angle."""
    lens = camera.lens(columns, rows)
    v = (0.5 * rows - np.arange(rows) - 0.5) * lens.pixel
    u = (np.arange(columns) + 0.5 - 0.5 * columns) * lens.pixel
    return 2.0 / (1.0 - 1.5 * v[:, None] - 0.4 * u)


def test_a_plane_passes_the_filter_at_any_slant():
    plane = slanted()
    assert np.abs(smoothed(plane) - plane).max() < 2e-6 * plane.max()


def test_bumps_are_taken_out():
    plane = slanted()
    bumps = 0.1 * D * np.sin(0.9 * np.arange(90))[:, None] * np.sin(0.9 * np.arange(120))
    left = (smoothed(plane + bumps) - plane)[20:-20, 20:-20]
    assert np.abs(left).max() < 0.08 * np.abs(bumps).max()


def test_an_edge_pulls_nothing_towards_itself():
    field = np.full((60, 80), 2.0)
    field[:, 40:] = 3.0
    field[:10] = 1.7e38
    out = smoothed(field)
    # Sums of float32 round differently on different processors: a mean of 3.0 was off by 12 of its last bits.
    np.testing.assert_allclose(out[10:, :40], 2.0, rtol=2e-6)
    np.testing.assert_allclose(out[10:, 40:], 3.0, rtol=2e-6)
    assert (out[:10] > 1e30).all()


@pytest.mark.parametrize("deep", [0.2, 0.5, 0.9])
def test_thickness_is_that_of_the_water(make_frame, deep):
    renderer = Renderer(120, 90)
    frame = pool(make_frame, deep)
    shot = renderer.shot(frame, Camera(eye=(0.5, 4.0, 0.5), target=(0.5, 0.0, 0.5)))
    for draw in (ellipsoids.draw, thickness.draw):
        draw(shot, renderer.buffers)
    seen = renderer.buffers.water.thickness.water.to_numpy() * D / 4096.0
    coarse = coarseness(shot)
    middle = seen[45 // coarse - 2 : 45 // coarse + 3, 60 // coarse - 2 : 60 // coarse + 3]
    assert middle == pytest.approx(deep, rel=0.06)
    assert np.ptp(middle) < 0.08 * deep


def test_a_surface_at_rest_has_no_bumps(make_frame):
    """Normals of a noisy flat surface, seen at a slant, all point up."""
    renderer = Renderer(240, 160)
    renderer.render(pool(make_frame, noise=0.05), CAMERA)
    depth = renderer.buffers.water.surface.depth.to_numpy()
    top = CAMERA.project([(0.3, 0.5, 0.3), (0.7, 0.5, 0.7)], 240, 160)
    rows, columns = np.sort(top[:, 1]).astype(int), np.sort(top[:, 0]).astype(int)
    heights = world_heights(renderer, CAMERA)[rows[0] : rows[1], columns[0] : columns[1]]
    assert heights.size > 100
    assert (depth[rows[0] : rows[1], columns[0] : columns[1]] < 0x7F000000).all()
    assert heights.std() < 0.04 * D
    assert heights.mean() == pytest.approx(0.5, abs=0.35 * D)


def world_heights(renderer, camera):
    """Height [m] of the water at every pixel."""
    depth = renderer.buffers.water.surface.depth.to_numpy().view(np.float32)
    lens = camera.lens(depth.shape[1], depth.shape[0])
    rows, columns = np.mgrid[: depth.shape[0], : depth.shape[1]] + 0.5
    v, u = (depth.shape[0] / 2 - rows) * lens.pixel, (columns - depth.shape[1] / 2) * lens.pixel
    return lens.eye[1] + depth * (u * lens.right[1] + v * lens.up[1] + lens.forward[1])


def test_deeper_water_is_darker_and_has_its_colour(make_frame):
    camera = Camera(eye=(0.5, 4.0, 0.5), target=(0.5, 0.0, 0.5))
    red = [Renderer(60, 60).render(pool(make_frame, deep), camera)[27:33, 27:33, 0].mean() for deep in (0.1, 0.4, 0.9)]
    assert red[0] > red[1] + 8 > red[2] + 16
    green = Renderer(60, 60).render(pool(make_frame), camera, view="water", color_by="#40d060")[27:33, 27:33]
    assert green[..., 1].mean() > green[..., 2].mean() + 15


def test_dye_colours_the_water_where_it_is(make_frame):
    """Half of a pool is dyed red, that to which the sunlight goes: that half is red, the other keeps its colour."""
    frame = pool(make_frame)
    dye = frame.dye.to_numpy()
    dye[: frame.count] = np.where(frame.positions[:, 0] > 0.5, (127 << 24) | (230 << 16) | (30 << 8) | 40, 0)
    above = Camera(eye=(0.5, 4.0, 0.5), target=(0.5, 0.0, 0.5))
    clear = Renderer(64, 48).render(frame, above).astype(int)
    frame.dye.from_numpy(dye)
    dyed = Renderer(64, 48).render(frame, above).astype(int)
    left, right = (slice(20, 28), slice(24, 28)), (slice(20, 28), slice(36, 40))
    assert dyed[right][..., 0].mean() > dyed[right][..., 2].mean() + 40
    assert np.abs(dyed[left] - clear[left]).max() <= 2


def test_a_coloured_world_that_was_saved_has_its_colours(tmp_path):
    """A state that comes back shows the very picture that it was saved with; its scene has no fluids any more."""
    red = Material(name="ink", color="#c03020")
    blocks = [
        Block(lower=(0, 0, 0), upper=(0.5, 0.4, 0.5), material="ink"),
        Block(lower=(0.5, 0, 0), upper=(1, 0.4, 0.5)),
    ]
    scene = Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 0.5)), fluids=blocks, materials=[red])
    sim = Simulation(scene, arch="cpu")
    sim.step()
    before = Renderer(96, 64).render(sim.frame()).astype(int)
    sim.save(tmp_path / "state.npz")
    after = Renderer(96, 64).render(Simulation.restore(tmp_path / "state.npz").frame()).astype(int)
    assert (before[..., 0] - before[..., 2]).max() > 40
    assert (after == before).all()


def test_the_shadow_of_dyed_water_has_its_colour(make_frame):
    """Light that has gone through red water falls on the floor beside the tank (law of Beer and Lambert)."""
    frame = pool(make_frame)
    above = Camera(eye=(1.3, 4.0, 0.5), target=(1.3, 0.0, 0.5))
    spot = Renderer(64, 48, supersample=1)
    row, column = above.project((1.06, 0.0, 0.5), 64, 48)[0, 1::-1].astype(int)
    dye = np.zeros_like(frame.dye.to_numpy())
    shown = []
    for own in (0, (127 << 24) | (230 << 16) | (30 << 8) | 40):
        dye[: frame.count] = own
        frame.dye.from_numpy(dye)
        shown.append(spot.render(frame, above)[row, column].astype(int))
    clear, dyed = shown
    assert clear[2] > clear[0]
    assert dyed[0] > dyed[2] + 15


def test_what_stands_behind_the_water_is_seen_through_it_and_moved(make_frame):
    pillar = [Box(center=(0.5, 0.2, 0.3), size=(0.15, 0.4, 0.15))]
    x = lattice((0, 0, 0), (1.0, 0.5, 1.0))
    x = x[np.abs(x[:, [0, 2]] - (0.5, 0.3)).max(axis=1) > 0.1]
    scene = Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=pillar)
    camera = Camera(eye=(0.5, 0.3, 4.0), target=(0.5, 0.3, 0.0)).orbit(0.3, 0.0)
    wet = Renderer(160, 120).render(make_frame(scene, x), camera).astype(int)
    dry = Renderer(160, 120).render(make_frame(scene, []), camera).astype(int)
    row = int(camera.project((0.5, 0.2, 0.3), 160, 120)[0, 1])

    def middle(picture):
        columns = np.nonzero(
            picture[row, :, 0] - picture[row, :, 2] > np.median(picture[row, :, 0] - picture[row, :, 2]) + 25
        )[0]
        assert len(columns) > 3
        return columns.mean()

    assert abs(middle(wet) - middle(dry)) > 1.0


def test_the_waters_shadow_is_coloured(make_frame, tank_scene):
    camera = Camera(eye=(2.2, 1.6, 2.6), target=(1.2, 0.0, 0.5))
    wet, dry = (
        Renderer(160, 120).render(f, camera).astype(int) for f in (pool(make_frame), make_frame(tank_scene, []))
    )
    column, row, _ = camera.project((1.15, 0.0, 0.5), 160, 120)[0]
    change = (dry - wet)[int(row) - 1 : int(row) + 2, int(column) - 1 : int(column) + 2].reshape(-1, 3).mean(axis=0)
    assert change[0] > change[2] + 4 > 4


def test_the_eye_under_water_sees_through_it(make_frame):
    frame = pool(make_frame, 0.8)
    inside = Camera(eye=(0.5, 0.4, 0.7), target=(0.5, 0.2, 0.0), field_of_view=1.0)
    wet = Renderer(64, 48).render(frame, inside).reshape(-1, 3).astype(float)
    dry = Renderer(64, 48).render(make_frame(frame.scene, []), inside).reshape(-1, 3).astype(float)
    assert wet[:, 0].mean() < dry[:, 0].mean() - 20
    assert wet[:, 2].mean() > wet[:, 0].mean() + 30


def test_a_drop_shows_the_world_upside_down(make_frame):
    """An orange box to the right of a drop is seen in its left half: a ball turns the picture around."""
    scene = Scene(spacing=0.2, solids=[Box(center=(0.45, 1.0, -0.4), size=(0.5, 0.8, 0.2))])
    frame = make_frame(scene, [(0.0, 1.0, 0.0)])
    camera = Camera(eye=(0.0, 1.0, 1.2), target=(0.0, 1.0, 0.0))
    picture = Renderer(320, 180).render(frame, camera).astype(float)
    left, _, right = (round(c) for c in camera.project([(-0.1, 1, 0), (0, 1, 0), (0.1, 1, 0)], 320, 180)[:, 0])
    orange = (picture[..., 0] - picture[..., 2])[80:100, left:right].mean(axis=0)
    half = len(orange) // 2
    assert orange[: half - 2].max() > 60 and orange[: half - 2].mean() > orange[half + 2 :].mean() + 10


def test_the_sky_is_seen_from_below_through_a_window_of_its_size(make_frame, monkeypatch):
    """Light enters flat water within asin(1 / 1.33) = 48.75 degrees of the zenith, and none from the sky beyond."""
    frame = pool(make_frame, 0.6)
    camera = Camera(eye=(0.5, 0.3, 0.4), target=(0.5, 0.6, 0.38), field_of_view=2.2)
    pictures = []
    for color in (0.0, 3.0):
        look = dataclasses.replace(
            pool_look(),
            zenith=vector(color, color, color),
            horizon=vector(color, color, color),
            lamp=vector(0.0, 0.0, 0.0),
            sparkle=0.0,
            outdoors=0,
        )
        monkeypatch.setattr(Style, "look", lambda style, frame, look=look: look)
        pictures.append(Renderer(160, 120).render(frame, camera).astype(int))
    change = np.abs(pictures[1] - pictures[0]).max(axis=2)
    rays = np.array([[camera.ray(c + 0.5, r + 0.5, 160, 120)[1] for c in range(160)] for r in range(120)])
    angle = np.degrees(np.arccos(rays[..., 1]))
    reach = np.abs(0.3 / rays[..., 1:2] * rays[..., ::2] + (0.5, 0.4) - 0.5).max(
        axis=2
    )  # on the surface, from its middle
    surface = (rays[..., 1] > 0.1) & (reach < 0.42)  # a fillet of water climbs the panes
    assert (surface & (angle > 51)).sum() > 300 and (surface & (angle < 46)).sum() > 300
    assert change[surface & (angle < 46)].min() > 40
    assert np.percentile(change[surface & (angle > 51)], 95) <= 3


def test_many_samples_agree_with_one_but_are_smoother(make_frame):
    frame = pool(make_frame)
    one = Renderer(160, 120).render(frame, CAMERA).astype(float)
    renderer = Renderer(160, 120)
    many = renderer.render(frame, CAMERA, samples=8).astype(float)
    assert np.abs(one - many).mean() < 3.0
    assert (renderer.render(frame, CAMERA, samples=8) == many).all()
    assert (renderer.render(frame, CAMERA) == one).all()
    assert np.abs(np.diff(many, axis=1)).mean() < np.abs(np.diff(one, axis=1)).mean()


def test_the_filter_fades_before_a_pane():
    """What a pane hides is not smoothed; moving the pane by a little must change what is seen by a little."""
    camera = Camera(eye=(0.0, 0.0, 2.0), target=(0.0, 0.0, 0.0))
    bumps = 0.2 * D * np.sin(1.3 * np.arange(90))[:, None] * np.sin(1.3 * np.arange(120))
    field = 2.0 + bumps + np.linspace(-2.5 * D, 0.5 * D, 120)  # the pane is at z = 0, at a depth of 2
    moved = [smoothed(field, camera, box(OPEN.lower, (9.0, 9.0, z))) for z in np.linspace(0.0, 0.1 * D, 21)]
    steps = [np.abs(b - a).max() for a, b in itertools.pairwise(moved)]
    assert np.abs(moved[-1] - moved[0]).max() > 0.01 * D
    assert max(steps) < 0.1 * D
    np.testing.assert_allclose(moved[0][:, :20], field[:, :20], atol=4e-6)
    assert np.abs(moved[0] - 2.0 - np.linspace(-2.5 * D, 0.5 * D, 120))[20:-20, 85:-15].max() < 0.05 * D


def test_a_still_tank_does_not_flicker():
    """From frame to frame of resting water next to nothing changes: only outlines that cross a pixel do.

    It rests from 3 s on (notebook/calm.md, "The contract"); half a second before three pixels change by 16.
    """
    sim = Simulation(Scene.load("still-tank").changed(spacing=0.05))
    sim.advance(3.0)
    renderer = Renderer(320, 180, 2)
    first = renderer.render(sim.frame()).astype(int)
    sim.step()
    change = np.abs(renderer.render(sim.frame()).astype(int) - first).max(axis=2)
    assert change.max() <= 8
    assert (change > 2).mean() < 0.0005
    assert change.mean() < 0.05


def test_timings_name_every_pass(make_frame):
    spent = {}
    Renderer(32, 24).render(pool(make_frame), CAMERA, timings=spent)
    assert {"ellipsoids", "surface", "flatten", "thickness", "water", "tonemap", "backdrop"} <= set(spent)
    assert min(spent.values()) >= 0.0


def test_large_pictures_are_affordable(make_frame):
    assert affordable(8192, 4320, 2) == 1
    assert affordable(3840, 2160, 2) == 2
    image = Renderer(8192, 64).render(pool(make_frame, 0.2))
    assert image.shape == (64, 8192, 3)


def test_the_sun_of_a_sample_moves_within_its_size(make_frame):
    renderer = Renderer(32, 24)
    shot = renderer.shot(pool(make_frame))
    moved = [renderer._moved(shot, k) for k in range(32)]
    angles = [np.arccos(min(1.0, float(m.look.to_sun @ shot.look.to_sun))) for m in moved]
    assert max(angles) <= np.arctan(shot.look.sun_size) + 1e-4
    assert max(angles) > 0.5 * shot.look.sun_size
    offsets = np.array([m.lens.middle - shot.lens.middle for m in moved])
    assert np.abs(offsets).max() <= 0.5
    assert np.abs(offsets.mean(axis=0)).max() < 0.06
    assert dataclasses.replace(moved[0], lens=shot.lens, sun=shot.sun, water_sun=shot.water_sun, look=shot.look) == shot


def test_a_drop_on_the_glass_is_nearly_as_clear_as_the_glass(make_frame):
    """Seen aslant it would mirror what is around, which the glass does not: a grey disc."""
    tank = Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)))
    place = np.array([[0.5, 0.6, 1.0 - 0.25 * D]], np.float32)
    camera = Camera(eye=(2.5, 0.9, 1.6), target=tuple(place[0]), field_of_view=0.2)
    with_drop, without = (
        Renderer(64, 48).render(make_frame(tank, x), camera).astype(int) for x in (place, np.zeros((0, 3), np.float32))
    )
    change = np.abs(with_drop - without).max(axis=-1)
    assert change[24, 26:30].max() < 20  # what lies flat on the glass: 46 when it mirrored
    assert change.max() > 15  # its bulge on the other side is seen, though there are no lamps that it could mirror


def test_the_filter_is_the_same_for_one_pixel_as_for_eight(monkeypatch):
    """Pixels go together where all take the same steps; edges, far water and what is left of a row go alone."""
    field = slanted(columns=123) + 0.1 * D * np.sin(0.7 * np.arange(90))[:, None] * np.sin(0.8 * np.arange(123))
    field[20:40, 31:60] -= 0.5
    field[60:, 90:] = 1.7e38
    together = smoothed(field)
    monkeypatch.setattr(flatten, "lanes", lambda: 1)
    alone = smoothed(field)
    assert np.abs(alone - field)[field < 1e30].max() > 0.05 * D
    np.testing.assert_allclose(together, alone, rtol=3e-6)
