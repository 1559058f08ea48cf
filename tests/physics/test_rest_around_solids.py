"""Water around solids that cut cells of the pressure comes to rest. All worlds: `wavetank validate solids-at-rest`."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.lab.cases import solids_at_rest

GAP = 0.045  # m, below a box: two rows of particles, and no face of a cell lies in it


def pushes(sim) -> np.ndarray:
    """What the grid accelerates particles by, over gravity; 0, 1 at rest."""
    return sim.world.particles.a.to_numpy()[: sim.count] / 9.81


@pytest.mark.parametrize(("dim", "name", "start"), [(2, "disc on the floor", 1), (2, "gap", 2), (3, "wedge", 1)])
def test_no_particle_is_thrown(dim, name, start):
    """Before, 0.58, 0.86 and 0.27 m/s, for ever: pressures that did not fit the room drove particles round."""
    seen = solids_at_rest.watch(solids_at_rest.worlds(dim, start)[name], dim, "cpu")
    assert seen.worst < 0.2 * np.sqrt(9.81 * solids_at_rest.SPACING[dim])


def test_nobody_is_kicked_out_of_a_crevice():
    """Before, 0.11 m/s: who crept across the middle between two strands was held by the other one, all at once."""
    seen = solids_at_rest.watch(solids_at_rest.worlds(3, 2)["knot"], 3, "cpu")
    assert seen.worst < 0.05 * np.sqrt(9.81 * solids_at_rest.SPACING[3])


@pytest.mark.parametrize(("name", "share"), [("disc in the surface", 0.01), ("leaning slab", 0.025)])
def test_a_surface_that_ends_below_a_roof_lies_still(name, share):
    """Hydrostatics. As its cells passed half of their room all air was gone, and pressure threw: 0.02 to 0.06 m/s."""
    seen = [solids_at_rest.watch(solids_at_rest.worlds(2, start)[name], 2, "cpu").worst for start in range(5)]
    assert np.median(seen) < share * np.sqrt(9.81 * solids_at_rest.SPACING[2])


def test_what_a_solid_pushes_along_turns_round_slowly():
    """Densities are even between two walls of one solid, 0.9 spacings apart: nothing is pushed in the middle."""
    gap = 0.045
    left = wt.Box(center=(0.4 - gap / 2.0, 0.5), size=(0.2, 0.4))
    right = wt.Box(center=(0.6 + gap / 2.0, 0.5), size=(0.2, 0.4))
    slopes = []
    for x in (0.499, 0.501):
        water, walls = wt.Points(positions=[(x, 0.5)]), wt.Union(parts=[left, right])
        sim = wt.Simulation(wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 1.0)), fluids=[water], solids=[walls]))
        sim.advance(1e-2)
        slopes.append(float(sim.world.temporaries.plane.to_numpy()[0, 0]))
    assert slopes[0] > 0.0 > slopes[1]
    np.testing.assert_allclose(slopes, 0.0, atol=0.1)


def test_the_grid_bears_just_the_weight_around_a_solid():
    """Hydrostatics: grad p = rho g, whatever cuts the cells. Before, it was wrong by 0.15 g beside the disc."""
    disc = wt.Sphere(center=(0.493, 0.117), radius=0.1)
    block = wt.Block(lower=(0, 0), upper=(1.0, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.0, 0.6)), fluids=[block], solids=[disc], foam=0.0))
    sim.advance(8.0)
    means = np.zeros((sim.count, 2))
    for _ in range(20):
        sim.step()
        means += pushes(sim) / 20
    x = sim.positions
    near = np.linalg.norm(x - disc.center, axis=1) < 0.16
    assert np.count_nonzero(near) > 50
    np.testing.assert_allclose(
        means[near & (x[:, 1] < 0.3)], [[0.0, 1.0]] * np.count_nonzero(near & (x[:, 1] < 0.3)), atol=0.05
    )


def test_a_gap_without_a_face_inside_is_held():
    """Between floor and box lies one row of cells: no slope of the pressure is known there, and weight is borne."""
    box = wt.Box(center=(0.5, 0.08 + GAP), size=(0.3, 0.16))
    block = wt.Block(lower=(0, 0), upper=(1.0, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.0, 0.6)), fluids=[block], solids=[box], foam=0.0))
    sim.advance(8.0)
    x = sim.positions
    inside = (np.abs(x[:, 0] - 0.5) < 0.1) & (x[:, 1] < GAP)
    assert np.count_nonzero(inside) > 10
    assert pushes(sim)[inside, 1].min() > 0.9


@pytest.mark.parametrize("layers", [1.3, 2.4])
def test_a_film_on_a_floor_lies_still(layers):
    """Hydrostatics. Grid and iterations both answered the whole of its weight: it jumped from step to step."""
    d, edge = 0.04, 0.8
    block = wt.Block(lower=(0, 0, 0), upper=(0.4, 4 * layers * d, 0.4))  # a quarter of the floor
    tank = wt.Tank(size=(edge, 0.6, edge))
    sim = wt.Simulation(wt.Scene(spacing=d, tank=tank, fluids=[block], foam=0.0, quality="draft"))
    sim.advance(12.0)
    speeds = np.array([np.linalg.norm(frame.velocities, axis=1) for frame in sim.frames(seconds=1.0)])
    assert speeds.max() < 0.05 * np.sqrt(9.81 * d)
    assert np.sqrt((speeds**2).mean()) < 0.01 * np.sqrt(9.81 * d)


CUPS = [(0.4, 0.007), (0.6, 0.013), (1.25, 0.0), (1.25, 0.013), (2.0, 0.027), (3.0, 0.013), (3.0, 0.027)]


@pytest.mark.parametrize(("walls", "shift"), CUPS)
def test_water_in_a_thin_cup_rests(walls, shift):
    """Hydrostatics. The pressure ended in the air behind the wall, and water went round at 0.18 to 1.2 m/s."""
    d, width, height = 0.02, 0.24, 0.3
    t, x, y = walls * d, 0.3 + shift, 0.11 + 0.7 * shift
    right = x + width + 2 * t
    outline = [(x, y), (right, y), (right, y + height), (right - t, y + height), (right - t, y + t), (x + t, y + t)]
    cup = wt.Polygon(points=[*outline, (x + t, y + height), (x, y + height)])
    block = wt.Block(lower=(x + t, y + t), upper=(x + t + width, y + t + 0.2))
    tank = wt.Tank(size=(1.0, 0.8))
    sim = wt.Simulation(wt.Scene(spacing=d, tank=tank, fluids=[block], solids=[cup], foam=0.0))
    sim.advance(8.0)
    speeds = np.array([np.linalg.norm(frame.velocities, axis=1) for frame in sim.frames(seconds=1.0)])
    assert speeds.max() < 0.02 * np.sqrt(9.81 * d)
    assert np.sqrt((speeds**2).mean()) < 0.01 * np.sqrt(9.81 * d)
    assert np.all((sim.positions[:, 0] > x + t) & (sim.positions[:, 0] < right - t) & (sim.positions[:, 1] > y + t))


BOWLS = [(0.004, (0.006, 0.002, 0.004)), (0.009, (0.001, -0.003, 0.005)), (0.019, (0.0, 0.0, 0.0))]


@pytest.mark.parametrize(("thick", "shift"), BOWLS)
def test_a_puddle_in_a_thin_bowl_lies_still(thick, shift):
    """Hydrostatics. It went round at 0.16 to 0.19 m/s, and rested in a bowl cut out of a block."""
    inner, depth, center = 0.08, 0.034, 0.1 + np.array(shift)
    half = 0.75 * np.sqrt(inner**2 - (inner - depth) ** 2)
    parts = [wt.Sphere(center=(0, 0, 0), radius=inner + thick), wt.Sphere(center=(0, 0, 0), radius=inner)]
    lower, upper = center - (half, inner - 0.004, half), center + (half, depth - inner, half)
    water = wt.Block(lower=tuple(lower), upper=tuple(upper))
    bowl = wt.Difference(center=tuple(center), parts=parts)
    tank = wt.Tank(size=(0.2, 0.2, 0.2))
    sim = wt.Simulation(wt.Scene(spacing=0.007, tank=tank, fluids=[water], solids=[bowl], foam=0.0))
    sim.advance(6.0)
    fastest = [np.linalg.norm(frame.velocities, axis=1).max() for frame in sim.frames(seconds=2.0)]
    assert np.median(fastest) < 0.02


def test_a_puddle_on_the_floor_stops():
    """A lone drop slid on for ever: nothing in so little water held it, and nature's films are all boundary layer."""
    drop = wt.Ball(center=(0.3, 0.05, 0.3), radius=0.04, velocity=(0.3, 0, 0))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.0, 0.4, 0.6)), fluids=[drop], foam=0.0))
    sim.advance(6.0)
    assert np.linalg.norm(sim.velocities, axis=1).max() < 0.01
