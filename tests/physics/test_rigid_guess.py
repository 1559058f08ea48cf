"""Where conjugate gradients start in what is stiff and turns: `physics/terms/dynamic_viscosity/rigid_guess.py`."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.physics.coefficients import coefficients
from wavetank.physics.mixture import blend
from wavetank.physics.terms.dynamic_viscosity.implicit_viscosity import solve_viscosity
from wavetank.physics.terms.dynamic_viscosity.rigid_guess import FORGET
from wavetank.physics.terms.tension import prepare_fluids
from wavetank.simulation.simulation import Simulation

D, DT = 0.02, 1 / 120


def drop(dim: int, side: int, flow: np.ndarray, viscosity: float = 1e6) -> Simulation:
    """A cube in free flight whose velocities are `flow` x, with x from its middle."""
    x = (np.stack(np.meshgrid(*[np.arange(side)] * dim, indexing="ij"), -1).reshape(-1, dim) + 0.5) * D
    points = wt.Points(positions=x, velocities=(x - x.mean(axis=0)) @ flow.T)
    return Simulation(wt.Scene(spacing=D, gravity=(0.0,) * dim, dynamic_viscosity=viscosity, fluids=[points]))


def rotation(dim: int, angle: float) -> np.ndarray:
    """About z, and in space about x afterwards."""
    c, s = np.cos(angle), np.sin(angle)
    if dim == 2:
        return np.array([[c, -s], [s, c]])
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def start_after(dim: int, flow: np.ndarray, pull: np.ndarray) -> np.ndarray:
    """What the start has of `pull` [m/s^2] after particles have moved with `flow` for DT, [n, dim].

    Those in edges and corners have few neighbours, and forget.
    """
    side = 10 if dim == 2 else 6
    sim = drop(dim, side, flow)
    inner = np.all(np.abs(sim.positions - sim.positions.mean(axis=0)) < (side / 2 - 1) * D, axis=1)
    sim.frame()
    world = sim.world
    world.remember_viscosity(np.tile(pull.astype(np.float32), (sim.count, 1)))
    kinds = blend(world.materials, sim.scene)
    prepare_fluids(world, kinds, sim.scene, DT)
    solve_viscosity(world, kinds, sim.scene, coefficients(sim.scene, DT), 0)
    found = np.empty((sim.count, dim))
    found[download(world.particles.id)[: sim.count]] = download(world.particles.viscous)[: sim.count]
    return found[inner]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("angle", [0.01, -0.3])
def test_what_turns_as_a_whole_turns_its_pull_exactly(dim, angle):
    """A body that came to where it is by a rotation has moved by x - R^-1 x: Cayley's rotation of that is R."""
    turn = rotation(dim, angle)
    pull = np.arange(1.0, dim + 1.0)
    found = start_after(dim, (np.eye(dim) - turn.T) / DT, pull)
    cosine = ((np.trace(turn) - 1.0) if dim == 3 else np.trace(turn)) / 2.0
    half = np.sqrt((1.0 - cosine) / (1.0 + cosine))
    np.testing.assert_allclose(found, np.tile(turn @ pull / (1.0 + FORGET * half), (len(found), 1)), rtol=2e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("rate", [1.0, 10.0])
def test_shear_and_expansion_turn_nothing(dim, rate):
    pull = np.arange(1.0, dim + 1.0)
    shear = np.zeros((dim, dim))
    shear[0, 1] = rate
    for flow in (shear, rate * np.eye(dim)):
        found = start_after(dim, flow, pull)
        np.testing.assert_allclose(found, np.tile(pull, (len(found), 1)), rtol=1e-3)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("speed", [2.0, 8.0])
def test_no_drop_gains_energy_or_turns_faster(dim, speed):
    """Viscosity takes energy, and about its middle a free drop keeps its angular momentum; pressure takes some."""
    flow = np.zeros((dim, dim))
    flow[0, 1], flow[1, 0] = -speed, speed
    sim = drop(dim, 15 if dim == 2 else 7, flow)

    def energy_and_turn() -> np.ndarray:
        x, v = sim.positions.astype(float), sim.velocities.astype(float)
        x, v = x - x.mean(axis=0), v - v.mean(axis=0)
        return np.array([np.sum(v**2), np.sum(x[:, 0] * v[:, 1] - x[:, 1] * v[:, 0])])

    last = energy_and_turn()
    for _ in range(8):
        sim.advance(0.25)
        now = energy_and_turn()
        assert (now < 1.001 * last).all()
        last = now
