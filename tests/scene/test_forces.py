"""Forces against what they are defined by."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.forces import FORCES, Attract, Burst, Drag, Sway, Vortex, Wind
from wavetank.simulation.simulation import Simulation


def alone(dim: int, at, velocity=None) -> Simulation:
    """One particle in the open, without gravity."""
    zero = (0.0,) * dim
    return Simulation(
        wt.Scene(spacing=0.01, gravity=zero, fluids=[wt.Points(positions=[at], velocities=[velocity or zero])])
    )


@pytest.mark.parametrize("dim", [2, 3])
def test_wind_pulls_with_an_exact_exponential(dim):
    """dv/dt = k (u - v): v = u (1 - exp(-k t))."""
    sim = alone(dim, (0.0,) * dim)
    sim.forces.append(Wind(velocity=(3.0, 1.0, -2.0)[:dim], drag=2.0))
    sim.advance(0.5)
    np.testing.assert_allclose(sim.velocities[0], np.array((3.0, 1.0, -2.0)[:dim]) * (1 - np.exp(-1.0)), rtol=1e-4)


def test_a_jet_blows_only_in_its_tube():
    for y, share in ((0.0, 1.0), (0.1, (1 - 0.25) ** 2), (0.25, 0.0)):
        sim = alone(2, (0.3, y))
        sim.push(Wind(velocity=(1.0, 0.0), drag=30.0, center=(0.0, 0.0), radius=0.2))
        sim.step()
        assert sim.velocities[0, 0] == pytest.approx(1 - np.exp(-0.5 * share), abs=1e-4)
        sim.step()
        assert sim.velocities[0, 0] == pytest.approx(1 - np.exp(-0.5 * share), abs=1e-4), "it acted for one frame"


@pytest.mark.parametrize("dim", [2, 3])
def test_attraction_points_at_the_center(dim):
    sim = alone(dim, (0.1, 0.1, 0.1)[:dim])
    sim.forces.append(Attract(center=(0.0,) * dim, radius=1.0, strength=5.0, drag=0.0))
    sim.step()
    v = sim.velocities[0]
    r = 0.1 * np.sqrt(dim)
    assert np.linalg.norm(v) == pytest.approx(5.0 * (1 - r * r) ** 2 / 60, rel=0.02)
    np.testing.assert_allclose(v, v[0], rtol=1e-5)
    assert v[0] < 0


def test_a_vortex_turns_like_a_body():
    sim = alone(3, (0.1, 0.4, 0.0))
    sim.forces.append(Vortex(center=(0.0, 0.0, 0.0), radius=1e3, speed=2e3, axis=(0.0, 5.0, 0.0), drag=1e4))
    sim.courant, sim.largest_substeps, sim.substeps = 100.0, 1, 1
    sim.step()
    np.testing.assert_allclose(sim.velocities[0], [0.0, 0.0, -0.2], atol=1e-5)


def test_a_hand_takes_along_and_a_burst_throws():
    sim = alone(2, (0.0, 0.0))
    sim.push(Drag(center=(0.0, 0.0), radius=0.1, velocity=(0.5, 0.0), drag=1e4))
    sim.step()
    assert sim.velocities[0, 0] == pytest.approx(0.5, rel=0.02)
    sim = alone(2, (0.1, 0.0))
    sim.push(Burst(center=(0.0, 0.0), radius=10.0, speed=1.0))
    sim.step()
    assert sim.velocities[0, 0] == pytest.approx(1.0, rel=0.01)


def test_a_swaying_tank_throws_water_the_other_way():
    """The mean of a sin over half a period is 2 a / pi."""
    sim = alone(2, (0.0, 0.0))
    sim.forces.append(Sway(acceleration=(1.0, 0.0), frequency=1.0))
    sim.advance(0.5)
    assert sim.velocities[0, 0] == pytest.approx(-0.5 * 2 / np.pi, rel=1e-3)


def test_forces_live_in_scene_files(tmp_path):
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1, 1)),
        fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.5))],
        forces=[Wind(velocity=(2, 0)), Attract(center=(0.5, 0.5), radius=0.2, strength=3)],
    )
    scene.save(tmp_path / "windy.toml")
    again = wt.Scene.load(tmp_path / "windy.toml")
    assert again == scene
    calm, windy = Simulation(again.changed(forces=[])), Simulation(again)
    for sim in (calm, windy):
        sim.advance(0.2)
    assert windy.velocities[:, 0].mean() > calm.velocities[:, 0].mean() + 0.1
    with pytest.raises(wt.WavetankError, match="forces.0..velocity .* 3 components in a 2-D world"):
        again.changed(forces=[{"kind": "wind", "velocity": [1, 0, 0]}])
    with pytest.raises(wt.WavetankError, match=r"kind|wind"):
        again.changed(forces=[{"kind": "storm"}])
    assert {force.model_fields["kind"].default for force in FORCES} == {
        "wind",
        "attract",
        "vortex",
        "drag",
        "burst",
        "sway",
    }


def test_the_speed_limit_makes_room_for_forces():
    scene = wt.Scene(
        spacing=0.05, gravity=(0, 0), tank=wt.Tank(size=(2, 1)), fluids=[wt.Points(positions=[[0.3, 0.5]])]
    )
    sim = Simulation(scene)
    sim.push(Burst(center=(0.2, 0.5), radius=5.0, speed=3.0))
    sim.step()
    sim.step()
    assert sim.velocities[0, 0] == pytest.approx(3.0, rel=0.01)
