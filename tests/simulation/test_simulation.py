import re
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.state import LASTING
from wavetank.physics.foam.pool import ROWS
from wavetank.simulation.instant import COLUMNS, FOAM
from wavetank.simulation.simulation import Simulation


def small(dim: int = 3, **keys) -> wt.Scene:
    size = (0.6, 0.4, 0.3)[:dim]
    return wt.Scene(
        **{
            "spacing": 0.04,
            "tank": wt.Tank(size=size),
            "fluids": [wt.Block(lower=(0.0,) * dim, upper=(0.3, 0.3, 0.3)[:dim])],
            **keys,
        }
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_the_contract(dim):
    sim = Simulation(small(dim))
    assert sim.time == 0.0
    sim.step()
    assert sim.time == pytest.approx(1 / 60)
    sim.advance(0.11)
    assert sim.time == pytest.approx(1 / 60 + 0.11)
    assert sim.positions.shape == sim.velocities.shape == (sim.count, dim)
    assert sim.densities.shape == (sim.count,)
    assert {a.dtype for a in (sim.positions, sim.velocities, sim.densities)} == {np.dtype(np.float32)}
    times = [frame.time for frame in sim.frames(seconds=0.1, fps=30)]
    np.testing.assert_allclose(np.diff(times), 1 / 30, atol=1e-9)
    assert len(times) == 4
    keys = {
        "density_error_mean",
        "density_error_p99",
        "density_error_max",
        "kinetic_energy",
        "speed_max",
        "neighbors_mean",
        "milliseconds_per_frame",
        "time",
        "count",
    }
    assert keys <= set(sim.stats())


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("count", [0, 1, 2])
def test_any_number_of_particles(dim, count):
    x = np.full((count, dim), 0.2) + 0.01 * np.arange(count)[:, None]
    sim = Simulation(small(dim, fluids=[wt.Points(positions=x)] if count else []))
    sim.advance(0.5)
    assert sim.count == count
    assert np.isfinite(sim.positions).all()
    assert sim.stats()["count"] == count


@pytest.mark.parametrize("dim", [2, 3])
def test_free_fall_is_exact(dim):
    """Symplectic Euler of a free particle: v = g n dt, x = x0 + g dt^2 n (n + 1) / 2, to rounding."""
    g = (0.5, -9.81, 1.0)[:dim]
    world = wt.Scene(spacing=0.1, courant=100, gravity=g, fluids=[wt.Points(positions=[(0.0,) * dim])])
    sim = Simulation(world)
    sim.advance(1.0)
    n = 60 * sim.time_steps
    dt = 1 / n
    np.testing.assert_allclose(sim.velocities[0], np.array(g) * n * dt, rtol=2e-6)
    np.testing.assert_allclose(sim.positions[0], np.array(g) * dt**2 * n * (n + 1) / 2, rtol=2e-5)


def test_ids_keep_their_particle():
    """Positions are ordered by id, whatever the order on the device."""
    x = np.random.default_rng(0).uniform(-5, 5, (300, 3)).astype(np.float32)
    v = np.random.default_rng(1).normal(0, 3, (300, 3)).astype(np.float32)
    sim = Simulation(wt.Scene(spacing=0.01, gravity=(0, 0, 0), fluids=[wt.Points(positions=x, velocities=v)]))
    sim.advance(0.5)
    np.testing.assert_allclose(sim.positions, x + 0.5 * v, atol=5e-4)


def test_runs_repeat_bit_for_bit():
    def run() -> np.ndarray:
        sim = Simulation(small())
        sim.advance(0.3)
        return sim.positions

    np.testing.assert_array_equal(run(), run())


def test_looking_does_not_change_the_motion():
    looked, alone = Simulation(small()), Simulation(small())
    for _ in range(10):
        looked.step()
        looked.stats()
        alone.step()
    np.testing.assert_array_equal(looked.positions, alone.positions)


def test_reset_starts_again():
    sim = Simulation(small())
    first = sim.positions
    sim.advance(0.2)
    after = sim.positions
    sim.reset()
    assert sim.time == 0.0
    np.testing.assert_array_equal(sim.positions, first)
    sim.advance(0.2)
    np.testing.assert_array_equal(sim.positions, after)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_saved_state_continues_exactly(dim, tmp_path):
    box = wt.Box(name="lid", center=(0.5, 0.3, 0.15)[:dim], size=(0.08,) * dim)
    sim = Simulation(small(dim, solids=[box]))
    sim.viscosity = 0.02
    sim.advance(0.15)
    sim.move("lid", position=(0.45, 0.2, 0.15)[:dim])
    sim.save(tmp_path / "state.npz")
    again = Simulation.restore(tmp_path / "state.npz")
    assert again.time == sim.time
    assert again.scene.viscosity == 0.02
    for world in (sim, again):
        world.advance(0.15)
    np.testing.assert_array_equal(again.positions, sim.positions)
    np.testing.assert_array_equal(again.velocities, sim.velocities)


def test_a_state_from_before_pressure_was_carried_on_is_read(tmp_path):
    sim = Simulation(small(2))
    sim.step()
    sim.save(tmp_path / "now.npz")
    with np.load(tmp_path / "now.npz") as file:
        before = {name: file[name] for name in file.files if name not in ("a", "seal")}
        np.savez(tmp_path / "then.npz", **before | {"format": 2})
    again = Simulation.restore(tmp_path / "then.npz")
    np.testing.assert_array_equal(again.positions, sim.positions)
    again.step()
    assert np.isfinite(again.positions).all()


def test_a_file_that_is_no_state(tmp_path):
    (tmp_path / "x.npz").write_bytes(b"nothing")
    with pytest.raises(wt.WavetankError, match=r"x\.npz: this is not a state.*File is not a zip file\.$"):
        Simulation.restore(tmp_path / "x.npz")
    with pytest.raises(wt.WavetankError, match=r"y\.npz: the state .* cannot be read: No such file"):
        Simulation.restore(tmp_path / "y.npz")


def test_live_parameters():
    sim = Simulation(small(gravity=(0, 0, 0)))
    sim.gravity = (1.0, 0.0, 0.0)
    sim.substeps = 2
    assert sim.gravity == (1.0, 0.0, 0.0)
    sim.step()
    assert sim.velocities[:, 0].mean() > 0.005
    with pytest.raises(wt.WavetankError, match="viscosity = -1 is not allowed; .*at least 0"):
        sim.viscosity = -1
    with pytest.raises(wt.WavetankError, match="gravity.*3"):
        sim.gravity = (0.0, -9.81)
    assert sim.gravity == (1.0, 0.0, 0.0)
    with pytest.raises(AttributeError):
        _ = sim.no_such_thing
    with pytest.raises(wt.WavetankError, match=r"'viscositty' is not a parameter; did you mean 'viscosity'\?"):
        sim.viscositty = 0.5
    with pytest.raises(wt.WavetankError, match="spacing cannot change during a simulation.*changed"):
        sim.spacing = 0.5
    with pytest.raises(wt.WavetankError, match="a Simulation has no attribute 'note'"):
        sim.note = "of my own"


def test_a_name_is_no_scene():
    with pytest.raises(wt.WavetankError, match="'drop' is not a Scene; use wt.Scene.load"):
        Simulation("drop")


def test_bad_times_are_refused():
    sim = Simulation(small())
    for seconds in (-1.0, float("nan"), float("inf")):
        with pytest.raises(wt.WavetankError, match="seconds"):
            sim.advance(seconds)
    with pytest.raises(wt.WavetankError, match="fps"):
        next(sim.frames(1.0, fps=0))


def test_a_moving_solid_pushes_the_water():
    paddle = wt.Box(name="paddle", center=(0.02, 0.2, 0.15), size=(0.02, 0.4, 0.3))
    sim = Simulation(small(solids=[paddle], fluids=[wt.Block(lower=(0.04, 0, 0), upper=(0.3, 0.12, 0.3))]))
    for k in range(60):
        sim.move("paddle", position=(0.02 + 0.003 * (k + 1), 0.2, 0.15))
        sim.step()
    assert sim.positions[:, 0].min() > 0.2 + 0.01 - 1e-4
    with pytest.raises(wt.WavetankError, match="no solid named 'cup'; named solids: paddle"):
        sim.move("cup", position=(0, 0, 0))
    with pytest.raises(wt.WavetankError, match="3 finite numbers"):
        sim.move("paddle", position=(0, float("nan"), 0))


def test_a_back_end_that_is_not_there_is_an_error():
    code = "import wavetank as wt; wt.Simulation(wt.Scene.load('drop-2d'), arch='metal')"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "arch = 'metal' cannot be started on this machine; available:" in result.stderr
    with pytest.raises(wt.WavetankError, match="'opengl' is not a back end; use one of cpu"):
        Simulation(small(), arch="opengl")


def test_odd_time_steps_do_not_shake_the_water():
    """Still water sampled at any rate stays still: a tiny step must not turn density error into velocity."""
    for fps in (59.999, 60.001, 97.0, 5000.0):
        sim = Simulation(wt.Scene.load("still-tank-2d").changed(spacing=0.05, viscosity=0.3))
        sim.advance(1.0)
        for _ in sim.frames(0.1, fps):
            pass
        assert sim.time == pytest.approx(1.1, abs=0.01)
        assert sim.stats()["speed_rms"] < 0.03, fps


@pytest.mark.parametrize("dim", [2, 3])
def test_particles_come_and_go_and_the_others_keep_their_ids(dim):
    sim = Simulation(small(dim))
    first = sim.frame().ids
    sim.advance(0.05)
    new = sim.add(np.full((3, dim), 0.22) + 0.04 * np.arange(3)[:, None] * np.eye(dim)[0], np.ones((3, dim)))
    assert new.tolist() == [len(first), len(first) + 1, len(first) + 2]
    assert sim.count == len(first) + 3
    place = dict(zip(sim.frame().ids.tolist(), sim.positions.tolist(), strict=True))
    assert sim.remove(first[::2]) == len(first[::2])
    assert sim.remove(first[::2]) == 0
    np.testing.assert_array_equal(sim.frame().ids, [*first[1::2], *new])
    for number, at in zip(sim.frame().ids.tolist(), sim.positions.tolist(), strict=True):
        assert place[number] == at
    sim.advance(0.2)
    assert np.isfinite(sim.positions).all()
    assert sim.add(np.full((1, dim), 0.25)) == new[-1] + 1, "an id is not used again"
    sim.remove(sim.frame().ids)
    assert sim.count == 0
    sim.advance(0.05)


@pytest.mark.parametrize("viscosity", [0.0, 100.0])
def test_a_world_grows_without_a_trace(viscosity):
    """Room made on the way changes nothing: the same water as with all of it from the start."""
    scene = small(dynamic_viscosity=viscosity)
    late, early = Simulation(scene), Simulation(scene)
    early.particles.enlarge(10 * early.count)
    for sim in (late, early):
        sim.advance(0.1)
        sim.add(np.array([[0.5, 0.35 + 0.001 * k, 0.05 + 0.04 * k] for k in range(4)]))
        sim.advance(0.1)
    np.testing.assert_array_equal(late.positions, early.positions)


def test_bad_particles_are_refused():
    sim = Simulation(small())
    for x in (np.zeros((2, 2)), np.full((1, 3), np.nan), np.zeros(3)):
        with pytest.raises(wt.WavetankError, match="positions"):
            sim.add(x)
    assert sim.count == len(small().particles()[0])


def test_a_state_keeps_all_that_tools_left_behind(tmp_path):
    sim = Simulation(small())
    sim.advance(0.05)
    sim.remove(sim.frame().ids[::7])
    sim.add([[0.5, 0.3, 0.1]])
    center = np.array([0.1, 0.1, 0.1])
    sim.paint_inside(center, center, 0.08, 0x7F00FF00)
    sim.freeze_inside(center, center, 0.06)
    name = sim.add_solid(wt.Sphere(center=(0.45, 0.1, 0.15), radius=0.06), grow=0.2)
    sim.advance(0.1)
    sim.save(tmp_path / "state.npz")
    again = Simulation.restore(tmp_path / "state.npz")
    assert name in again.solids.names
    for world in (sim, again):
        world.advance(0.15)
        world.add([[0.55, 0.35, 0.2]])
        world.advance(0.05)
    for what in ("ids", "positions", "velocities", "dyes"):
        np.testing.assert_array_equal(getattr(again.frame(), what), getattr(sim.frame(), what))
    assert again.world.frozen == sim.world.frozen > 0


def test_a_look_after_growth_changes_nothing():
    """What viscosity did has room where particles are sorted to, with viscosity and after it."""
    found = []
    for looks in (True, False):
        sim = Simulation(small(dynamic_viscosity=100.0))
        sim.step()
        sim.particles.enlarge(20 * sim.count)
        if looks:
            assert sim.frame().densities.all()
        sim.advance(0.05)
        found.append(sim.positions)
        sim.dynamic_viscosity = 0.0
        sim.particles.enlarge(40 * sim.count)
        sim.advance(0.02)
        assert not sim.world.remembers_viscosity
    np.testing.assert_array_equal(*found)


def test_thawed_dough_falls_at_once():
    """What held the ice does not hold what becomes of it: free fall, as water's."""
    block = wt.Block(lower=(0.4, 0.4), upper=(0.6, 0.6))
    sim = Simulation(
        wt.Scene(spacing=0.02, gravity=(0, -9.81), dynamic_viscosity=1e3, tank=wt.Tank(size=(1, 1)), fluids=[block])
    )
    ends = np.array([0.0, 0.5, 0.0]), np.array([1.0, 0.5, 0.0])
    sim.freeze_inside(*ends, 0.5)
    assert sim.world.frozen == sim.count
    sim.advance(0.2)
    sim.freeze_inside(*ends, 0.5, frozen=False)
    sim.advance(0.1)
    assert sim.velocities[:, 1].mean() == pytest.approx(-0.981, rel=0.02)
    sim.freeze_inside(*ends, 0.5)
    sim.remove_inside(*ends, 0.5)
    assert (sim.count, sim.world.frozen) == (0, 0)


def test_the_second_of_two_solids_is_forgotten_like_the_first():
    """Which solid the fluid lies on is asked where it is, not when neighbours were last searched for."""
    falls = []
    for others in ((), ("far",)):
        plates = [wt.Box(name=name, center=(0.5, y), size=(1.0, 0.1)) for name, y in (("far", 0.9), ("shelf", 0.3))]
        block = wt.Block(lower=(0.3, 0.35), upper=(0.7, 0.55))
        tank = wt.Tank(size=(1, 1))
        sim = Simulation(
            wt.Scene(
                spacing=0.02, gravity=(0, -9.81), dynamic_viscosity=300.0, tank=tank, fluids=[block], solids=plates
            )
        )
        sim.advance(0.1)
        for name in (*others, "shelf"):
            sim.remove_solid(name)
        before = sim.velocities[:, 1].mean()
        sim.advance(0.1)
        falls.append(sim.velocities[:, 1].mean() - before)
    assert falls == pytest.approx([-0.981, -0.981], abs=0.02)


@pytest.mark.parametrize("viscosity", [0.0, 1e3, 1e5])
def test_what_lay_on_a_solid_falls_freely_without_it(viscosity):
    """Neither the pressure that thick fluids carry on nor the drag they start from outlives the solid."""
    plate = wt.Box(name="plate", center=(0.15, 0.1), size=(4.0, 0.2))
    block = wt.Block(lower=(0.0, 0.2), upper=(0.3, 0.5), velocity=(3.0, 0.0))
    sim = Simulation(
        wt.Scene(spacing=0.02, gravity=(0, -9.81), dynamic_viscosity=viscosity, fluids=[block], solids=[plate])
    )
    for _ in range(3):
        sim.step()
    sim.remove_solid("plate")
    before, start = sim.velocities.mean(axis=0), sim.time
    sim.advance(0.1)
    fall = [0.0, -9.81 * (sim.time - start)]
    np.testing.assert_allclose(sim.velocities.mean(axis=0) - before, fall, atol=1e-2)


def test_solids_come_and_go():
    sim = Simulation(small(solids=[wt.Box(center=(0.5, 0.1, 0.15), size=(0.1, 0.2, 0.1))]))
    assert sim.solids.names[6:] == ["solid 1"]
    name = sim.add_solid(wt.Sphere(center=(0.15, 0.15, 0.15), radius=0.09), grow=0.2)
    assert name == "solid 2"
    sim.advance(0.3)
    distance = np.linalg.norm(sim.positions - [0.15, 0.15, 0.15], axis=1)
    assert distance.min() > 0.09
    sim.remove_solid("solid 1")
    sim.move("solid 2", position=(0.2, 0.2, 0.15))
    sim.step()
    assert sim.solids.poses[6][0].tolist() == [0.2, 0.2, 0.15]
    for wrong in ("solid 1", "tank x lower"):
        with pytest.raises(wt.WavetankError):
            sim.remove_solid(wrong)
    with pytest.raises(wt.WavetankError, match="components"):
        sim.add_solid(wt.Sphere(center=(0.1, 0.1), radius=0.1))


@pytest.mark.parametrize("name", sorted(p.name for p in wt.PARAMETERS if p.live and p.low is not None))
def test_water_survives_a_slider_at_either_end(name):
    """Set while a dam breaks and a particle flies alone: all stay finite numbers inside the tank."""
    parameter = next(p for p in wt.PARAMETERS if p.name == name)
    dam = wt.Scene.load("dam-break-2d").changed(spacing=0.05)
    alone = wt.Points(positions=[[0.9 * dam.tank.size[0], 0.9 * dam.tank.size[1]]])
    sim = wt.Simulation(dam.changed(fluids=[*dam.fluids, alone]))
    sim.advance(0.2)
    start = sim.snapshot()
    for value in (parameter.low, parameter.high):
        sim.resume(start)
        setattr(sim, name, value)
        for _ in range(5):
            sim.step()
        assert np.isfinite(sim.velocities).all()
        assert (np.abs(sim.positions / sim.scene.tank.size - 0.5) <= 0.5).all()


def test_places_in_a_plane_are_two_numbers_and_what_is_no_place_is_one_sentence():
    sim = wt.Simulation(wt.Scene.load("drop-2d"))
    middle = sim.frame().positions.mean(axis=0)
    sim.freeze_inside(middle, middle, 0.06)
    frozen = sim.frame().frozen_count
    sim.freeze_inside([*middle, 0.0], (*middle, 0.0), 0.06)
    assert 0 < frozen == sim.frame().frozen_count < sim.count
    for start, radius, words in (
        ("here", 0.1, "start = 'here'"),
        ([0.1, np.nan], 0.1, "nan"),
        ([0.1], 0.1, "two or three"),
        (middle, -1.0, "radius = -1.0"),
        (middle, "wide", "radius = 'wide'"),
    ):
        for act in (sim.remove_inside, lambda *where: sim.paint_inside(*where, 1), sim.freeze_inside):
            with pytest.raises(wt.WavetankError, match=re.escape(words)):
                act(start, middle, radius)


@pytest.mark.parametrize("body", [False, True])
def test_a_solid_that_cannot_be_built_changes_nothing(body):
    """What the grid of a shape refuses was half in the world, which ended a frame later."""
    sim = wt.Simulation(wt.Scene.load("drop-2d").model_copy(update={"spacing": 0.05}))
    sim.step()
    before, names = sim.digest(), [*sim.solids.names]
    wide = wt.Polygon(points=[(1e9, -1.0), (1e9, 0.0), (0.0, 0.0)], density=500.0 if body else None)
    for grow in (0.0, 0.35):
        with pytest.raises(wt.WavetankError, match="nodes"):
            sim.add_solid(wide, grow)
    assert (sim.digest(), sim.solids.names, len(sim.solids.reaches)) == (before, names, len(names))
    sim.step()


def test_a_simulation_is_composed_of_parts():
    """Live parameters by both faces, solids by name, and one sentence for an attribute that is not there."""
    scene = wt.Scene(
        spacing=0.1,
        tank=wt.Tank(size=(1, 1)),
        fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.5))],
        solids=[wt.Box(name="gate", center=(0.8, 0.5), size=(0.1, 0.2))],
    )
    sim = wt.Simulation(scene)
    sim.parameters.viscosity = 0.2
    assert sim.viscosity == sim.scene.viscosity == 0.2 and {"viscosity", "solids"} <= set(dir(sim))
    sim.viscosity = 0.3
    assert sim.parameters.viscosity == 0.3 and sim.parameters.spacing == 0.1 and "spacing" in dir(sim.parameters)
    with pytest.raises(wt.WavetankError, match="spacing cannot change during a simulation"):
        sim.parameters.spacing = 0.2
    with pytest.raises(wt.WavetankError, match="viscosity = -1"):
        sim.parameters.viscosity = -1.0
    with pytest.raises(AttributeError, match="'foo'"):
        sim.parameters.foo = 3
    assert list(sim.solids) == ["gate"] and len(sim.solids) == 1 and sim.solids["gate"].solid.name == "gate"
    sim.solids["gate"].move(position=(0.7, 0.5))
    sim.step()
    assert sim.solids["gate"].position == pytest.approx((0.7, 0.5))
    with pytest.raises(wt.WavetankError, match="there is no solid named 'door'; named solids: gate"):
        sim.solids["door"]


def test_every_saved_array_is_declared_once():
    assert set(LASTING) <= set(COLUMNS)
    assert {field.name: field.column for field in FOAM} == ROWS
