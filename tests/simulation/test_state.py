"""The state of a world from outside: its digest, copies of it, arrays that are set."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.scene.forces import Wind
from wavetank.simulation.simulation import Simulation


def dam(**more) -> wt.Simulation:
    scene = wt.Scene(
        spacing=0.04,
        tank=wt.Tank(size=(1.2, 0.8)),
        fluids=[wt.Block(lower=(0, 0), upper=(0.4, 0.5))],
        solids=[wt.Box(name="gate", center=(0.8, 0.1), size=(0.1, 0.2))],
        **more,
    )
    return wt.Simulation(scene)


def advanced(sim: wt.Simulation, frames: int) -> wt.Simulation:
    for _ in range(frames):
        sim.step()
    return sim


def changed(sim: wt.Simulation, name: str, row: int, value) -> str:
    """Return the digest with another value of one particle's array on the device."""
    array = getattr(sim.world.particles, name)
    before = download(array).copy()
    after = before.copy()
    after[row] = value
    array.from_numpy(after)
    result = sim.digest()
    array.from_numpy(before)
    return result


def test_digest_is_that_of_a_run_and_not_of_its_order():
    sim, other = advanced(dam(), 6), advanced(dam(), 6)
    assert len(sim.digest()) == 64 and set(sim.digest()) <= set("0123456789abcdef")
    before = sim.digest()
    ids = download(sim.world.particles.id)[: sim.count].copy()
    sim.frame()  # sorts
    assert not np.array_equal(ids, download(sim.world.particles.id)[: sim.count]), "the test needs another order"
    assert sim.digest() == before == other.digest()


def test_digest_tells_all_that_is_there():
    sim = advanced(dam(materials=[{"name": "oil", "density": 900.0}]), 3)
    digests = {sim.digest()}
    for name, value in (("x", 0.3), ("v", 0.3), ("dye", 5), ("frozen", 1), ("material", 1), ("id", 9999)):
        digests.add(changed(sim, name, 2, value))
    sim.counters.time += 1e-9
    digests.add(sim.digest())
    sim.solids.poses[-1] = (sim.solids.poses[-1][0] + 1e-9, sim.solids.poses[-1][1])
    digests.add(sim.digest())
    assert len(digests) == 9


def test_digest_tells_foam():
    sim = wt.Simulation(wt.Scene.load("dam-break-2d").changed(spacing=0.03))
    while not len(sim.foam_ages):
        sim.step()
    before = sim.digest()
    sim.world.pool.now.age.fill(0.123)
    assert sim.digest() != before


def test_clone_goes_on_to_the_same_bits():
    sim = dam()
    sim.forces.append(Wind(velocity=(3.0, 0.0)))
    sim.viscosity, sim.gravity = 0.3, (1.0, -9.0)
    advanced(sim, 8)
    sim.move("gate", (0.7, 0.1))
    sim.push(Wind(velocity=(-2.0, 0.0)))
    sim.advance(1e-5)  # too short for a frame: owed
    copy = sim.clone()
    assert isinstance(copy, Simulation) and copy.digest() == sim.digest()
    for world in (sim, copy):
        advanced(world, 6)
        world.add([[0.6, 0.7]])
        world.advance(0.031)
    assert copy.digest() == sim.digest()
    assert copy.scene == sim.scene and copy.viscosity == 0.3


def test_clone_is_a_world_of_its_own():
    sim = advanced(dam(forces=[Wind(velocity=(3.0, 0.0))]), 4)
    copy, before = sim.clone(), sim.digest()
    copy.gravity, copy.forces[0].velocity = (0.0, 0.0), (0.0, 0.0)
    copy.remove_solid("gate")
    copy.remove(range(20))
    advanced(copy, 3)
    assert sim.digest() == before
    assert sim.gravity == (0.0, -9.81) and "gate" in sim.solids.names
    assert sim.forces[0].velocity == (3.0, 0.0) and sim.scene.forces[0].velocity == (3.0, 0.0)


def test_clone_of_water_that_solids_have_come_into():
    """A scene as it is now may be one that no world can begin with."""
    sim = dam()
    sim.add_solid(wt.Box(center=(0.2, 0.25), size=(0.5, 0.6)))
    copy = sim.clone()
    assert advanced(copy, 2).digest() == advanced(sim, 2).digest()


def test_velocities_and_positions_are_set_by_id():
    sim = advanced(dam(), 4)
    sim.frame()  # sorted: the device has another order
    x, v = sim.positions.copy(), sim.velocities.copy()
    v[3], x[5] = (1.0, 2.0), (0.9, 0.7)
    sim.velocities, sim.positions = v, x
    assert np.array_equal(sim.velocities, v) and np.array_equal(sim.positions, x)
    assert sim.densities[5] < 0.8 * sim.scene.rest_density, "densities are those of the new places"


def test_velocities_that_are_set_are_not_cut():
    """The speed limit makes room for what a person gives the water."""
    sim = wt.Simulation(
        wt.Scene(
            spacing=0.1, tank=wt.Tank(size=(9, 1)), gravity=(0, 0), fluids=[wt.Block(lower=(0, 0), upper=(1, 0.5))]
        )
    )
    sim.velocities = np.tile([8.0, 0.0], (sim.count, 1))
    sim.step()
    assert sim.velocities[:, 0].mean() > 7.0


def test_setting_what_is_there_changes_nothing():
    sim, other = (advanced(wt.Simulation(wt.Scene.load("honey-2d")), 4) for _ in range(2))
    sim.positions, sim.velocities = sim.positions, sim.velocities
    assert advanced(sim, 3).digest() == advanced(other, 3).digest()


@pytest.mark.parametrize("name", ["positions", "velocities"])
def test_arrays_that_are_set_are_checked(name):
    sim = dam()
    before, values = sim.digest(), getattr(sim, name).copy()
    with pytest.raises(
        wt.WavetankError, match=rf"^{name} have shape \[3, 2\]; they must have \[{sim.count}, 2\], a row"
    ):
        setattr(sim, name, values[:3])
    with pytest.raises(wt.WavetankError, match=rf"^{name} must be an array of numbers"):
        setattr(sim, name, "water")
    values[7, 1] = np.nan
    with pytest.raises(wt.WavetankError, match=rf"^{name}\[7\] = .* is not finite"):
        setattr(sim, name, values)
    assert sim.digest() == before


def test_the_package_has_what_scripts_need():
    from wavetank import commands

    assert commands.Pause().on and wt.commands is commands
    for name in ("Recording", "replay", "Session", "render", "Camera", "show"):
        assert callable(getattr(wt, name)) and name in dir(wt) and name in wt.__all__
    with pytest.raises(AttributeError, match="no attribute 'recording_of'"):
        _ = wt.recording_of
