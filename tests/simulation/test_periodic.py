"""Tanks that repeat: what crosses a seam notices nothing of it."""

import os
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.lab.cases.case import surface

D = 0.02
REST = {"fluids": [wt.Block(lower=(0, 0), upper=(1.0, 0.3))]}


def tank(dim=2, axes="x"):
    return wt.Tank(size=(1.0, 0.6, 0.3)[:dim], periodic=[*axes])


def shifted(x, by, length=1.0):
    """Places moved along x, within a tank that repeats."""
    return np.stack([np.mod(x[:, 0] + by, length), *x.T[1:]], axis=1)


def apart(a, b, length=1.0):
    """Largest distance between places, of nearest images along x."""
    way = a.astype(float) - b
    way[:, 0] -= length * np.round(way[:, 0] / length)
    return float(np.linalg.norm(way, axis=1).max())


@pytest.mark.parametrize("dim", [2, 3])
def test_a_stream_through_a_world_without_walls_stays_as_it_is(dim):
    """No force acts: the velocity of each particle, and with it the momentum, is kept to rounding (Newton)."""
    size, v = (0.6, 0.5, 0.28)[:dim], (1.3, -0.7, 0.4)[:dim]
    sim = wt.Simulation(
        wt.Scene(
            spacing=D,
            gravity=(0,) * dim,
            tank=wt.Tank(size=size, periodic=["x", "y", "z"][:dim]),
            fluids=[wt.Block(lower=(0,) * dim, upper=size, velocity=v)],
        )
    )
    start = sim.positions.astype(float)
    for _ in range(60):
        sim.step()
    np.testing.assert_allclose(sim.velocities, np.tile(v, (sim.count, 1)), atol=5e-5)
    assert sim.stats()["density_error_max"] < 1e-5
    x = sim.positions
    assert ((x >= 0) & (x < np.float32(size))).all()
    way = x - start - np.array(v) * sim.time
    np.testing.assert_allclose(way - size * np.round(way / size), 0.0, atol=2e-4)


def splash(by, frames, **changes):
    """A block that falls apart, moved along x; no particle stands just between two nodes, where rounding decides."""
    x = np.stack(np.meshgrid(0.203 + D * (np.arange(15) + 0.5), D * (np.arange(15) + 0.5), indexing="ij"), -1)
    scene = wt.Scene(spacing=D, tank=tank(), fluids=[wt.Points(positions=shifted(x.reshape(-1, 2), by))], **changes)
    sim = wt.Simulation(scene)
    for _ in range(frames):
        sim.step()
    return sim


@pytest.mark.parametrize("ball", [False, True])
def test_a_splash_at_the_seam_is_one_in_the_middle(ball):
    """Moved by half the tank, a whole number of cells of all grids: the same to rounding, which grows with time.

    Not with a ball at 0.58 or 0.60, where rounding decides how the way of one particle ends that meets it.
    """
    moved = [
        splash(by, 5, solids=[wt.Sphere(center=(np.mod(0.59 + by, 1.0), 0.0), radius=0.06)] if ball else [])
        for by in (0.0, 0.5)
    ]
    assert np.ptp(moved[1].positions[:, 0]) > 0.9 > 0.7 > np.ptp(moved[0].positions[:, 0])
    assert apart(shifted(moved[0].positions, 0.5), moved[1].positions) < 2e-5
    assert moved[0].velocities == pytest.approx(moved[1].velocities, abs=2e-3)


@pytest.mark.parametrize(("axes", "size"), [("x", (1.5, 0.6)), ("x", (0.97, 0.6)), ("xz", (0.53, 0.4, 0.31))])
def test_still_water_rests(axes, size):
    """Hydrostatics; the bounds of `still-tank`. Lengths need be no whole number of spacings, cells or supports."""
    block = wt.Block(lower=(0,) * len(size), upper=(size[0], 0.2, size[-1])[: len(size)])
    sim = wt.Simulation(wt.Scene(spacing=D, tank=wt.Tank(size=size, periodic=[*axes]), fluids=[block]))
    sim.advance(3.0)
    for _ in range(30):
        sim.step()
        assert np.linalg.norm(sim.velocities, axis=1).max() < 0.01
        assert surface(sim.positions, D, size).std() < 0.06 * D
    assert sim.stats()["density_error_mean"] < 0.005


def river(**changes):
    """A stream downhill over a stone in the middle of a tank, and one at its seam."""
    return wt.Simulation(
        wt.Scene(
            spacing=D,
            gravity=(0.5, -9.8),
            friction=0.2,
            tank=wt.Tank(size=(1.2, 0.5), periodic=["x"]),
            fluids=[wt.Block(lower=(0, 0), upper=(1.2, 0.16), velocity=(0.5, 0))],
            solids=[wt.Sphere(center=(1.19, 0.0), radius=0.06), wt.Sphere(center=(0.55, 0.0), radius=0.08)],
            **changes,
        )
    )


def test_a_river_passes_its_seam_without_a_jump():
    """Continuity: on average as much flows through each cross section, and it is as dense there."""
    sim = river()
    sim.advance(3.0)
    flux, dense, parts = np.zeros(20), np.zeros(20), np.zeros(20)
    for _ in range(240):
        sim.step()
        x, v, rho = sim.positions, sim.velocities, sim.densities
        part = np.minimum((x[:, 0] / 1.2 * 20).astype(int), 19)
        flux += np.bincount(part, v[:, 0], 20)
        dense += np.bincount(part, rho, 20)
        parts += np.bincount(part, minlength=20)
    assert flux.min() > 0
    assert np.abs(flux / flux.mean() - 1.0).max() < 0.06
    mean = dense / parts / 1000.0  # where water is thin, its surface counts for much
    assert np.abs(mean - 1.0).max() < 0.03
    assert abs(mean[0] - mean[-1]) < 0.005
    assert sim.count == river().count


def test_foam_and_dye_go_over_the_seam():
    sim = river(foam=4.0)
    seen = 0
    for _ in range(90):
        sim.step()
        foam = sim.frame().foam_positions
        assert ((foam[:, 0] >= 0) & (foam[:, 0] < np.float32(1.2))).all()
        seen = max(seen, len(foam))
    assert seen > 20
    sim.paint_inside((1.2, 0.0), (1.2, 0.1), 0.08, 0x7F00FF00)
    places = sim.positions[sim.frame().dyes != 0]
    assert (places[:, 0] < 0.1).any()
    assert (places[:, 0] > 1.1).any()
    assert len(places) < 100


def test_hands_see_over_the_seam():
    sim = wt.Simulation(wt.Scene(spacing=D, tank=tank(), **REST))
    count = sim.count
    assert not sim.free_places(np.array([[0.999, 0.11]]), 0.5 * D, 0.0).any()
    removed = sim.remove_inside((0.0, 0.15), (0.0, 0.15), 0.06)
    assert removed == pytest.approx(np.pi * (0.06 / D) ** 2, abs=4)
    assert sim.count == count - removed
    assert sim.free_places(np.array([[0.999, 0.15]]), D, 0.0).all()
    # What is put or written beyond an end is within at its image.
    sim.add([[1.25, 0.5], [-0.25, 0.5]])
    np.testing.assert_allclose(sim.positions[-2:, 0], [0.25, 0.75], atol=1e-6)
    sim.positions = sim.positions + np.float32([3.0, 0.0])
    assert ((sim.positions[:, 0] >= 0) & (sim.positions[:, 0] < 1.0)).all()


@pytest.mark.parametrize("start", [0.8, 3.8, -6.2])
def test_a_solid_that_moves_through_the_seam_pushes_water_on_both_sides(start):
    """However many lengths of the tank it has gone."""
    position = [f"{start} + 0.5*t", "0.1"]
    solid = wt.Box(name="paddle", center=(start, 0.1), size=(0.06, 0.3), motion={"position": position})
    sim = wt.Simulation(wt.Scene(spacing=D, tank=tank(), solids=[solid], **REST))
    sim.advance(0.5)  # its middle is at 1.05, 0.05 beyond the seam
    x = sim.positions
    assert not ((np.abs(x[:, 0] - 0.05) < 0.02) & (x[:, 1] < 0.2)).any()
    ahead = (x[:, 0] > 0.09) & (x[:, 0] < 0.15)
    assert sim.velocities[ahead, 0].mean() > 0.2
    assert sim.stats()["density_error_mean"] < 0.02


@pytest.mark.parametrize("viscosity", [0.0, 5.0])
def test_a_state_goes_on_to_the_same_bits(tmp_path, viscosity):
    sim = river(foam=2.0) if not viscosity else river(dynamic_viscosity=viscosity)
    sim.advance(0.3)
    sim.save(tmp_path / "river.npz")
    again = wt.Simulation.restore(tmp_path / "river.npz")
    copy = sim.clone()
    for _ in range(6):
        for one in (sim, again, copy):
            one.step()
        assert sim.digest() == again.digest() == copy.digest()


RUN = """
import wavetank as wt
scene = wt.Scene.load("river").changed(spacing=0.03, gravity=(0.4, -9.8, 0.2), foam=3.0)
sim = wt.Simulation(scene.changed(tank={"size": [2.4, 0.4, 0.8], "periodic": ["x", "z"]}))
for _ in range(6):
    sim.step()
print(sim.digest())
"""


def test_runs_repeat_on_any_number_of_threads():
    digests = set()
    for threads in ("1", "3"):
        environment = {**os.environ, "QD_CPU_MAX_NUM_THREADS": threads}
        done = subprocess.run([sys.executable, "-c", RUN], capture_output=True, text=True, env=environment, check=True)
        digests.add(done.stdout.strip())
    assert len(digests) == 1


def test_a_slope_without_an_end_has_no_limit_of_speed():
    """Water slides down without friction as a block does, v = g_x t."""
    sim = wt.Simulation(wt.Scene(spacing=D, gravity=(4.0, -9.0), tank=tank(), **REST))
    sim.advance(1.5)
    assert sim.velocities[:, 0].mean() == pytest.approx(6.0, rel=0.03)
