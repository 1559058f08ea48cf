"""Boxes of boards, and water that no air bounds."""

import numpy as np
import pytest

import wavetank as wt

D = 0.025  # m


def boards(middle, size, thick):
    """Four boards around a room of that size, end to end, as one would nail them."""
    (x, y), (a, b) = middle, size
    return [
        wt.Box(center=(x, y - 0.5 * (b + thick)), size=(a + 2.0 * thick, thick)),
        wt.Box(center=(x, y + 0.5 * (b + thick)), size=(a + 2.0 * thick, thick)),
        wt.Box(center=(x - 0.5 * (a + thick), y), size=(thick, b)),
        wt.Box(center=(x + 0.5 * (a + thick), y), size=(thick, b)),
    ]


def under_water(solids):
    block = wt.Block(lower=(0.0, 0.0), upper=(1.2, 0.8))
    return wt.Scene(spacing=D, tank=wt.Tank(size=(1.2, 0.9)), fluids=[block], solids=solids)


def full(size, solids=()):
    block = wt.Block(lower=(0.0,) * len(size), upper=size)
    return wt.Scene(spacing=D, tank=wt.Tank(size=size), fluids=[block], solids=list(solids))


def fastest(sim, before, frames):
    """The fastest particle in so many frames after those `before` [m/s]."""
    result = 0.0
    for frame in range(before + frames):
        sim.step()
        if frame >= before:
            result = max(result, float(np.linalg.norm(sim.velocities, axis=1).max()))
    return result


@pytest.mark.parametrize("thick", [0.07, 0.1])
def test_water_inside_and_around_a_box_of_boards_is_at_rest(thick):
    """Hydrostatics: seams are no room, and both waters have a pressure of their own. It was at 0.25 and 2 m/s."""
    sim = wt.Simulation(under_water(boards((0.6, 0.4), (0.4, 0.3), thick)))
    assert sim.world.pressure.regions == 2
    assert fastest(sim, 60, 90) < 0.05


@pytest.mark.parametrize("thick", [0.08, 0.1])
def test_a_sliver_of_a_cell_in_a_corner_is_no_air(thick):
    """The same a centimetre aside, where its corner has a fifth of a cell: taken for air, all boiled at 3 to 4 m/s."""
    sim = wt.Simulation(under_water(boards((0.61, 0.4), (0.4, 0.3), thick)))
    assert fastest(sim, 60, 90) < 0.12


def test_a_box_in_one_piece_keeps_two_waters_apart():
    """Parts of a union have seams as well. A lone particle in an inner corner hops at 0.06 m/s, as it did before."""
    shell = wt.Union(center=(0.6, 0.4), parts=boards((0.0, 0.0), (0.4, 0.3), 0.1))
    sim = wt.Simulation(under_water([shell]))
    assert sim.world.pressure.regions == 2
    for _ in range(120):
        sim.step()
    assert np.sqrt(np.mean(np.sum(sim.velocities**2, axis=1))) < 0.005


@pytest.mark.parametrize(
    ("size", "solids"),
    [
        ((0.81, 0.513), []),
        ((0.81, 0.513), [wt.Box(center=(0.37, 0.22), size=(0.2, 0.1))]),
        ((0.5, 0.413, 0.31), [wt.Sphere(center=(0.25, 0.2, 0.15), radius=0.08)]),
    ],
    ids=["empty", "box", "ball in space"],
)
def test_a_full_tank_is_at_rest(size, solids):
    """Without air the pressure has no level; the first two were at 0.15 to 0.2 m/s for ever."""
    sim = wt.Simulation(full(size, solids))
    assert fastest(sim, 120, 90) < 0.03


@pytest.mark.parametrize(
    ("size", "depth"),
    [((0.5, 0.5), 0.49), ((0.8, 0.513), 0.513), ((0.8, 0.513), 0.48), ((0.8, 0.52), 0.52), ((0.4, 0.5, 0.4), 0.49)],
)
def test_water_whose_surface_lies_just_below_the_lid_is_at_rest(size, depth):
    """Its last cells are partly full and have no air above them: in a plane it was at 0.2 to 0.75 m/s for ever."""
    block = wt.Block(lower=(0.0,) * len(size), upper=(size[0], depth, *size[2:]))
    sim = wt.Simulation(wt.Scene(spacing=D, tank=wt.Tank(size=size), fluids=[block]))
    assert fastest(sim, 90, 60) < 0.02


def test_a_wall_of_planks_lets_nothing_through():
    """A partition of boards end to end: water on one side stands as high after a while, and nothing flows."""
    planks = [wt.Box(center=(0.6, 0.071 * (k + 0.5)), size=(0.08, 0.071)) for k in range(11)]
    block = wt.Block(lower=(0.0, 0.0), upper=(0.56, 0.5))
    sim = wt.Simulation(wt.Scene(spacing=D, tank=wt.Tank(size=(1.2, 0.8)), fluids=[block], solids=planks))
    assert fastest(sim, 60, 90) < 0.03
    assert sim.positions[:, 0].max() < 0.56


def test_no_water_begins_in_a_seam():
    """A cup of five boards in half a tank: eighteen particles began between boards, and crept along the seams."""
    d, (x, y, z), (a, b, c), t = 0.03, (0.4, 0.2, 0.3), (0.3, 0.26, 0.26), 0.07
    cup = [
        wt.Box(center=(x, y - 0.5 * (b + t), z), size=(a + 2 * t, t, c + 2 * t)),
        wt.Box(center=(x - 0.5 * (a + t), y, z), size=(t, b, c + 2 * t)),
        wt.Box(center=(x + 0.5 * (a + t), y, z), size=(t, b, c + 2 * t)),
        wt.Box(center=(x, y, z - 0.5 * (c + t)), size=(a, b, t)),
        wt.Box(center=(x, y, z + 0.5 * (c + t)), size=(a, b, t)),
    ]
    block = wt.Block(lower=(0.0, 0.0, 0.0), upper=(0.8, 0.25, 0.6))
    sim = wt.Simulation(wt.Scene(spacing=d, tank=wt.Tank(size=(0.8, 0.6, 0.6)), fluids=[block], solids=cup))
    inside = [
        np.min(0.5 * np.array(board.size) - np.abs(sim.positions - np.array(board.center)), axis=1) for board in cup
    ]
    assert np.max(inside) < 0.0


@pytest.mark.parametrize("thick", [0.05, 0.08])
def test_a_closed_bottle_full_of_water_stands_on_the_ground_of_a_pool(thick):
    """Archimedes: it is heavier than water. Its water had any pressure, and it was thrown about at 4 m/s."""
    pytest.importorskip("rapier3d")
    bottle = wt.Union(
        name="bottle", center=(0.6, 0.15 + thick), parts=boards((0.0, 0.0), (0.4, 0.3), thick), density=1500
    )
    block = wt.Block(lower=(0.0, 0.0), upper=(1.2, 0.6))
    sim = wt.Simulation(wt.Scene(spacing=D, tank=wt.Tank(size=(1.2, 0.9)), fluids=[block], solids=[bottle]))
    assert fastest(sim, 150, 60) < 0.3
    np.testing.assert_allclose(sim.bodies["bottle"].position[:2], (0.6, 0.15 + thick), atol=0.25 * D)
