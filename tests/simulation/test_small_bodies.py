"""Bodies about as large as a particle: what water of larger parts does to them stays within reason."""

import numpy as np
import pytest

import wavetank as wt

pytest.importorskip("rapier3d")
D = 0.03


def dropped(dim, radius, density):
    """A ball of so many spacings, let go a decimetre above still water."""
    ball = wt.Sphere(name="ball", center=(0.3, 0.4, 0.3)[:dim], radius=radius * D, density=density)
    block = wt.Block(lower=(0, 0, 0)[:dim], upper=(0.6, 0.3, 0.6)[:dim])
    return wt.Simulation(wt.Scene(spacing=D, tank=wt.Tank(size=(0.6, 0.8, 0.6)[:dim]), fluids=[block], solids=[ball]))


def speeds(sim, seconds):
    found = []
    for _ in range(round(60 * seconds)):
        sim.step()
        found.append(float(np.linalg.norm(sim.bodies["ball"].velocity)))
    return np.array(found)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("density", [300, 900])
def test_what_is_smaller_than_a_particle_does_not_fly_about(dim, density):
    """It comes down at 1.4 m/s; it was thrown at the speed limit, 4 m/s, for ever."""
    found = speeds(dropped(dim, 0.33, density), 3.0)
    assert found.max() < 2.0 and found[-60:].max() < 0.5


@pytest.mark.parametrize("radius", [0.75, 1.0])
def test_light_balls_lie_on_the_water(radius):
    """They bobbed at 0.2 m/s for ever on what the grid carried on after they had left the water."""
    found = speeds(dropped(3, radius, 100), 4.0)
    assert np.median(found[-60:]) < 0.08


def test_it_falls_as_all_things_do_and_weighs_what_it_weighs():
    """Its inertia in water is that of a particle; in the air nothing of it is felt."""
    sim = dropped(3, 0.33, 900)
    assert sim.bodies["ball"].mass == pytest.approx(900 * 4 / 3 * np.pi * (0.33 * D) ** 3, rel=0.05)
    sim.advance(0.1)
    assert sim.bodies["ball"].velocity[1] == pytest.approx(-0.981, rel=0.01)
