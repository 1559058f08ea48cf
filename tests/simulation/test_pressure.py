"""`sim.pressure` and probes: the pressure at a place, against hydrostatics and linear waves."""

import json
import math

import numpy as np
import pytest

import wavetank as wt

RHO_G = 9810.0  # Pa / m


def at_rest(dim=2, spacing=0.02, solids=(), height=0.4, seconds=1.0, **keys):
    """A tank 1 m long that has stood, and the depth of its water [m] by the volume of its particles."""
    size, upper = (1.0, 0.8, 0.4)[:dim], (1.0, height, 0.4)[:dim]
    water, tank = wt.Block(lower=(0,) * dim, upper=upper), wt.Tank(size=size)
    sim = wt.Simulation(wt.Scene(spacing=spacing, tank=tank, fluids=[water], solids=[*solids], foam=0.0, **keys))
    sim.advance(seconds)
    return sim, sim.count * spacing**dim / (1.0 if dim == 2 else 0.4)


@pytest.mark.parametrize(("dim", "spacing"), [(2, 0.02), (2, 0.025), (3, 0.05)])
def test_water_at_rest_presses_by_its_depth(dim, spacing):
    """p = rho g (H - y), down to the floor and the corners, up to the surface; 0 above it."""
    sim, depth = at_rest(dim, spacing)
    heights = np.array([0.0, 0.003, 0.1, 0.2, depth - spacing, depth + 0.5 * spacing, 0.7])
    for x in (0.0, 0.3, 1.0):
        places = np.stack([np.full_like(heights, x), heights, np.full_like(heights, 0.4)], axis=1)[:, :dim]
        np.testing.assert_allclose(
            sim.pressure(places), RHO_G * np.maximum(depth - heights, 0.0), atol=0.005 * RHO_G * depth
        )


def test_one_point_gives_one_number_and_reading_changes_nothing():
    """It is asked for in any shape, and the water goes on to the same bits."""
    sim, _ = at_rest(seconds=0.2)
    other, _ = at_rest(seconds=0.2)
    one = sim.pressure((0.5, 0.1))
    assert one.shape == ()
    assert one.dtype == np.float32
    np.testing.assert_array_equal(sim.pressure([(0.5, 0.1)] * 3), [one] * 3)
    for world in (sim, other):
        world.advance(0.1)
    assert sim.digest() == other.digest()


@pytest.mark.parametrize("thick", [0.01, 0.02, 0.05])
def test_a_gate_has_water_on_one_side(thick):
    """Hydrostatics up to a wall half a spacing thick, and nothing behind it."""
    water = wt.Block(lower=(0, 0), upper=(0.5 - thick / 2, 0.4))
    gate = wt.Box(center=(0.5, 0.4), size=(thick, 0.8))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 0.8)), fluids=[water], solids=[gate], foam=0.0))
    sim.advance(2.0)
    depth, heights = sim.count * 0.02**2 / (0.5 - thick / 2), np.array([0.03, 0.15, 0.3])
    before = [(0.496 - thick / 2, y) for y in heights]
    behind = [(0.504 + thick / 2, y) for y in heights]
    np.testing.assert_allclose(sim.pressure(before), RHO_G * (depth - heights), atol=0.01 * RHO_G * depth)
    assert not sim.pressure(behind).any()


def test_layers_of_two_fluids_add_up():
    """p = sum of rho_k g h_k: 800 kg/m^3 on 1300."""
    materials = [wt.Material(name="oil", density=800.0), wt.Material(name="brine", density=1300.0)]
    below = wt.Block(lower=(0, 0), upper=(1, 0.2), material="brine")
    above = wt.Block(lower=(0, 0.2), upper=(1, 0.4), material="oil")
    tank = wt.Tank(size=(1, 0.8))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=tank, materials=materials, fluids=[below, above], foam=0.0))
    sim.advance(1.0)
    heights = np.array([0.0, 0.1, 0.3])
    expected = 9.81 * np.where(heights < 0.2, 800 * 0.2 + 1300 * (0.2 - heights), 800 * (0.4 - heights))
    np.testing.assert_allclose(sim.pressure([(0.5, y) for y in heights]), expected, atol=40.0)


@pytest.mark.parametrize("substeps", [1, 3])
def test_the_pressure_of_a_wave(substeps):
    """Airy: p' = rho g eta cosh(k y) / cosh(k H) below the antinode of the first mode, in phase with eta.

    In its second period: the lattice that the water starts as has to become water first.
    """
    length, depth, d = 1.0, 0.5, 0.02
    k = math.pi / length
    omega = math.sqrt(9.81 * k * math.tanh(k * depth))
    tank = wt.Tank(size=(length, 1.0))
    x = wt.Scene(spacing=d, tank=tank, fluids=[wt.Block(lower=(0, 0), upper=(length, depth))]).particles()[0]
    u = 0.02 * omega / math.sinh(k * depth)
    v = np.stack([-np.sin(k * x[:, 0]) * np.cosh(k * x[:, 1]), np.cos(k * x[:, 0]) * np.sinh(k * x[:, 1])], axis=1)
    water = wt.Points(positions=x, velocities=u * v)
    sim = wt.Simulation(wt.Scene(spacing=d, tank=tank, fluids=[water], foam=0.0, substeps=substeps))
    rows, period = [], 2.0 * math.pi / omega
    sim.advance(period)
    for _ in range(round(period * 60.0)):
        sim.step()
        eta = 2.0 * np.mean(np.cos(k * sim.positions[:, 0])) * depth
        rows.append((sim.time, eta, *sim.pressure([(0.0, 0.0), (0.0, 0.25)])))
    time, eta, *pressures = np.array(rows).T
    turn = np.exp(1j * omega * time)
    for height, pressure in zip((0.0, 0.25), pressures, strict=True):
        ratio = np.sum((pressure - RHO_G * (depth - height)) * turn) / np.sum(eta * turn) / RHO_G
        assert abs(ratio * math.cosh(k * depth) / math.cosh(k * height) - 1.0) < 0.1


@pytest.mark.parametrize(("dim", "spacing"), [(2, 0.02), (3, 0.05)])
def test_the_walls_of_a_tank_bear_its_water(dim, spacing):
    """The floor bears its weight, a side rho g H^2 / 2 at a third of its depth."""
    sim, depth = at_rest(dim, spacing, height=0.5)
    wide = 1.0 if dim == 2 else 0.4
    floor, side = sim.load_on("tank y lower"), sim.load_on("tank x upper")
    weight, push = RHO_G * depth * wide, RHO_G * depth**2 / 2.0 * wide
    np.testing.assert_allclose(floor.force, np.array((0.0, -weight, 0.0))[:dim], atol=0.005 * weight)
    np.testing.assert_allclose(side.force, np.array((push, 0.0, 0.0))[:dim], atol=0.005 * push)
    assert side.moment[2] / push == pytest.approx(0.4 - depth / 3.0, abs=0.005 * depth)
    assert floor.center.shape == (dim,)


@pytest.mark.parametrize("shift", [0.0, 0.013])
@pytest.mark.parametrize("thick", [0.01, 0.04])
def test_a_still_gate_feels_the_water_before_it(thick, shift):
    """rho g H^2 / 2, at a third of the depth, wherever it cuts the cells; it has no density and is no body."""
    x = 0.5 + shift
    water = wt.Block(lower=(0, 0), upper=(x - thick / 2, 0.4))
    gate = wt.Box(name="gate", center=(x, 0.4), size=(thick, 0.8))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 0.8)), fluids=[water], solids=[gate], foam=0.0))
    sim.advance(2.0)
    depth, load = sim.count * 0.02**2 / (x - thick / 2), sim.load_on("gate")
    push = RHO_G * depth**2 / 2.0
    assert load.force[0] == pytest.approx(push, rel=0.01)
    assert load.moment[2] == pytest.approx(push * (0.4 - depth / 3.0), abs=0.01 * push * depth)


def test_a_disc_below_water_is_lifted_by_its_volume():
    """Archimedes, of a still solid and of a body that floats by its own way of measuring."""
    disc = wt.Sphere(name="disc", center=(0.313, 0.117), radius=0.06)
    raft = wt.Box(name="raft", center=(0.7, 0.42), size=(0.2, 0.1), density=500.0)
    sim, _ = at_rest(solids=[disc, raft], seconds=4.0)
    lift = RHO_G * math.pi * 0.06**2
    np.testing.assert_allclose(sim.load_on("disc").force, (0.0, lift), atol=0.02 * lift)
    np.testing.assert_allclose(sim.load_on("raft").force, sim.bodies["raft"].force, atol=0.02 * 98.1)


def test_probes_are_measured_in_every_frame(tmp_path, wavetank):
    """`[[probes]]` in a file: in `stats()`, in the run's table, and with a solid that moves."""
    door = wt.Box(name="door", center=(0.2, 0.1), size=(0.04, 0.2), motion=wt.Motion(position=["0.2 + 0.1*t", 0.1]))
    probes = [wt.Probe(name="floor", at=(0.7, 0.0)), wt.Probe(name="door", at=(0.23, 0.1), solid="door")]
    probes += [wt.Probe(name="thrust", solid="door"), wt.Probe(name="side", solid="tank x upper")]
    sim, _ = at_rest(solids=[door], probes=probes, seconds=1.0)
    figures = sim.stats()
    moved = sim.solids["door"].position[0] - 0.2
    assert moved == pytest.approx(0.1, abs=0.002)
    assert figures["probes.door.pressure"] == pytest.approx(float(sim.pressure((0.23 + moved, 0.1))), abs=0.01)
    assert figures["probes.floor.pressure"] == pytest.approx(float(sim.pressure((0.7, 0.0))), abs=0.01)

    assert figures["probes.thrust.force_x"] == sim.load_on("door").force[0]
    assert figures["probes.side.moment_z"] == sim.load_on("tank x upper").moment[2]

    sim.scene.save(tmp_path / "probes.toml")
    assert wt.Scene.load(tmp_path / "probes.toml").probes == probes
    wavetank("run", str(tmp_path / "probes.toml"), "--seconds", "0.1", "--out", str(tmp_path / "out"))
    rows = [json.loads(line) for line in (tmp_path / "out" / "stats.jsonl").read_text().splitlines()]
    assert all(row["probes.floor.pressure"] > 3000.0 for row in rows[1:])


def test_a_restored_world_reads_the_same(tmp_path):
    """What probes read goes on from is part of a state, and not of its digest."""
    sim, _ = at_rest(probes=[wt.Probe(name="floor", at=(0.5, 0.0))], seconds=0.1)
    bare, _ = at_rest(seconds=0.1)
    sim.velocities = bare.velocities = np.tile(np.float32((0.3, 0.0)), (sim.count, 1))
    sim.stats()
    assert sim.digest() == bare.digest()
    sim.advance(0.1)
    sim.save(tmp_path / "state.npz")
    again = wt.Simulation.restore(tmp_path / "state.npz")
    assert math.isnan(again.stats()["probes.floor.pressure"])
    for world in (sim, again):
        world.advance(0.1)
    assert again.stats()["probes.floor.pressure"] == sim.stats()["probes.floor.pressure"] > 0.0


def test_mistakes_are_told():
    """Where there is no pressure, a sentence says why."""
    sim, _ = at_rest(seconds=0.05)
    with pytest.raises(wt.WavetankError, match=r"points have shape \[3\]; give finite numbers of shape \[n, 2\]"):
        sim.pressure((0.1, 0.2, 0.3))
    with pytest.raises(wt.WavetankError, match="points"):
        sim.pressure([(0.1, math.nan)])
    fresh = wt.Simulation(
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1)), fluids=[wt.Block(lower=(0, 0), upper=(1, 0.5))])
    )
    with pytest.raises(wt.WavetankError, match=r"no pressure yet; .* call step\(\) first"):
        fresh.pressure((0.5, 0.1))
    with pytest.raises(wt.WavetankError, match="probes read the pressure grid"):
        wt.Scene(spacing=0.05, fluids=[wt.Ball(center=(0, 0), radius=0.1)], probes=[wt.Probe(name="a", at=(0, 0))])
    with pytest.raises(wt.WavetankError, match=r"probes\[0\]\.solid = 'gate' is not a solid of the scene; .*: none"):
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1)), probes=[wt.Probe(name="a", at=(0, 0), solid="gate")])
    with pytest.raises(wt.WavetankError, match=r"the probe 'a' needs a place, at = \[...\], or a solid"):
        wt.Probe(name="a")
    ground = wt.HalfSpace(name="ground", point=(0.0, 0.1), normal=(0.0, 1.0))
    with pytest.raises(wt.WavetankError, match=r"probes\[0\]\.solid = 'ground' has no end, .* give a place"):
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1)), solids=[ground], probes=[wt.Probe(name="a", solid="ground")])
    held, _ = at_rest(solids=[wt.Box(name="box", center=(0.5, 0.2), size=(0.1, 0.1))], seconds=0.05)
    held.scene.probes = [wt.Probe(name="a", solid="box")]
    with pytest.raises(wt.WavetankError, match="the probe 'a' measures 'box'; take it out"):
        held.remove_solid("box")
    held.add_solid(wt.Box(name="late", center=(0.2, 0.2), size=(0.1, 0.1)), grow=2.0)
    held.step()
    with pytest.raises(wt.WavetankError, match="'late' is still growing"):
        held.load_on("late")
    with pytest.raises(wt.WavetankError, match="there is no solid named 'gate'"):
        sim.load_on("gate")
    with pytest.raises(wt.WavetankError, match=r"probes\[0\]\.at = .* has 3 components in a 2-D world"):
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1)), probes=[wt.Probe(name="a", at=(0, 0, 0))])


@pytest.mark.parametrize("view", ["particles", "slice"])
def test_pictures_show_the_pressure(view):
    """`color_by = "pressure"`: water at rest goes from the end of the colour map, at the floor, to its start."""
    sim, depth = at_rest(spacing=0.025, seconds=0.5)
    picture = wt.render(sim, view=view, color_by="pressure", legend=False, limits=(0.0, 0.9 * RHO_G * depth), lit=False)
    column = picture[:, picture.shape[1] // 2].astype(int)
    yellow = np.abs(column - (253, 231, 37)).sum(axis=1)
    violet = np.abs(column - (68, 1, 84)).sum(axis=1)
    assert yellow.min() < 100, "balls are shaded"
    assert violet.min() < 100
    assert violet.argmin() < yellow.argmin(), "rows of a picture are counted from the top"
    below_air = wt.Simulation(sim.scene)
    assert not np.asarray(below_air.frame().pressure.to_numpy()).any(), "nothing is known before the first step"


def test_pictures_of_a_world_with_z_up_show_it_too():
    """A turned copy of the frame has its particles in another order; deep ones are yellow, those on top violet."""
    water, tank = wt.Block(lower=(0, 0, 0), upper=(1.0, 0.4, 0.4)), wt.Tank(size=(1.0, 0.4, 0.8))
    sim = wt.Simulation(wt.Scene(spacing=0.05, gravity=(0.0, 0.0, -9.81), tank=tank, fluids=[water], foam=0.0))
    sim.advance(0.5)
    frame, x = sim.frame(), sim.positions
    np.testing.assert_allclose(frame.pressure_by_id, sim.pressure(x), rtol=1e-6)
    picture = wt.render(sim, view="particles", color_by="pressure", legend=False, limits=(0.0, 3500.0)).astype(int)
    yellow = picture[..., 0] + picture[..., 1] - 2 * picture[..., 2] > 150
    violet = picture[..., 2] - picture[..., 1] > 30
    rows = [np.flatnonzero(mask.any(axis=1)) for mask in (violet, yellow)]
    assert len(rows[0]) > 10
    assert len(rows[1]) > 10
    assert rows[0].mean() < rows[1].mean()


def test_what_is_beyond_the_tank_bears_nothing():
    """A gate that goes through the floor, and a place below it: there is no water."""
    water = wt.Block(lower=(0, 0), upper=(0.48, 0.4))
    gate = wt.Box(name="gate", center=(0.5, 0.35), size=(0.04, 0.9))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1, 0.8)), fluids=[water], solids=[gate], foam=0.0))
    sim.advance(2.0)
    push = RHO_G * (sim.count * 0.02**2 / 0.48) ** 2 / 2.0
    np.testing.assert_allclose(sim.load_on("gate").force, (push, 0.0), atol=0.01 * push)
    assert not sim.pressure([(0.2, -0.1), (-0.1, 0.1), (0.2, 0.9)]).any()


def test_places_in_a_periodic_tank_repeat():
    """A place and its images read the same."""
    tank, water = wt.Tank(size=(1.0, 0.8), periodic=["x"]), wt.Block(lower=(0, 0), upper=(1.0, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=tank, fluids=[water], foam=0.0))
    sim.advance(0.5)
    at, first, second = sim.pressure([(0.2, 0.1), (1.2, 0.1), (-2.8, 0.1)])
    assert at > 2000.0
    np.testing.assert_allclose([first, second], at, rtol=1e-3)


def test_more_water_does_not_forget_the_pressure():
    """An emitter makes the arrays grow between two steps; nothing of what was read is lost."""
    tap = wt.Emitter(name="tap", shape="line", position=(0.5, 0.7), direction=(0, -1), width=0.1, speed=1.0)
    sim, _ = at_rest(spacing=0.025, seconds=0.0, emitters=[tap], probes=[wt.Probe(name="floor", at=(0.1, 0.0))])
    before = sim.count
    for _ in range(30):
        sim.step()
        assert sim.stats()["probes.floor.pressure"] > 3500.0
    assert sim.count > before


def test_air_where_water_was_has_no_pressure():
    """The node keeps a part of what it had for many steps, and is no liquid."""
    sim, _ = at_rest(spacing=0.025, seconds=0.3)
    sim.pressure((0.5, 0.1))
    sim.remove(np.flatnonzero(sim.positions[:, 1] > 0.1))
    sim.step()
    assert sim.pressure((0.5, 0.1)) < 1500.0
    assert not sim.pressure([(0.5, 0.2), (0.5, 0.3)]).any()


def test_ice_has_no_pressure_and_water_has_it_again():
    """Steps without the grid leave nothing behind."""
    sim, depth = at_rest(spacing=0.025, seconds=0.3)
    sim.freeze_inside((0.0, 0.0), (0.1, 0.0), 0.05)
    with pytest.raises(wt.WavetankError, match="there is no pressure to read"):
        sim.pressure((0.5, 0.1))
    sim.step()
    sim.freeze_inside((0.0, 0.0), (0.1, 0.0), 0.05, frozen=False)
    with pytest.raises(wt.WavetankError, match="no pressure yet"):
        sim.pressure((0.5, 0.1))
    sim.advance(0.5)
    assert sim.pressure((0.5, 0.1)) == pytest.approx(RHO_G * (depth - 0.1), rel=0.02)
