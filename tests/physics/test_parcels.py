"""Boxes of particles fill the room of a lattice; so the longest wave of a tank dies out, whatever its size."""

import numpy as np
import pytest
from scipy.optimize import least_squares

import wavetank as wt
from wavetank.device import compiler
from wavetank.device.compiler import qd, upload
from wavetank.device.state import Particles, Temporaries, new_particles, new_temporaries
from wavetank.physics.pressure.grid import Level, Part, Variant, Workspace, new_pressure_grid
from wavetank.physics.pressure.liquid import add_footprints

UNIT = float(1 << 24)


@qd.kernel
def add(
    grid: Level,
    w: Workspace,
    particles: Particles,
    temporaries: Temporaries,
    spacing: qd.f32,
    count: qd.i32,
    lanes: qd.template(),
    has: Variant,
):
    """Add what nodes have of these particles to the sums."""
    qd.loop_config(serialize=True)
    for cluster in range((count + lanes - 1) // lanes):
        add_footprints(grid, w, particles, temporaries, spacing, UNIT, cluster, 0, count, lanes, has)


def shares_of(grid, places, spacing, solids=0, thin=0):
    """What each node has of boxes of that size at `places` [n, 3], [nz, ny, nx]."""
    particles, temporaries = new_particles(3, len(places)), new_temporaries(len(places))
    for component, values in zip((particles.px, particles.py, particles.pz), places.T, strict=True):
        upload(component, np.pad(values, (0, component.shape[0] - len(values))).astype(np.float32))
    level, workspace = grid.finest, grid.workspace
    workspace.sums.fill(0)
    has = Variant(solids=solids, thin_walls=thin, bodies=0, mixed=0, few_nodes=1)
    add(level, workspace, particles, temporaries, spacing, len(places), compiler.lanes(), has)
    nodes = level.nx * level.ny * level.nz
    return workspace.sums.to_numpy()[:nodes].reshape(level.nz, level.ny, level.nx) / UNIT


@pytest.fixture(scope="module")
def grid():
    compiler.start("cpu")
    found = new_pressure_grid((np.zeros(3), np.array([1.0, 1.2, 0.8])), 0.1)
    found.finest.open_volume.fill(1.0)
    found.make_room(Part.SOLIDS)
    return found


def test_shares_are_the_mean_of_a_tent_over_the_box(grid):
    """Bardenhagen and Kober 2004, with tents: here the mean over 20 points along each axis."""
    level, rng, d = grid.finest, np.random.default_rng(2), 0.055
    edges, sizes = np.array([level.dx, level.dy, level.dz]), (level.nx, level.ny, level.nz)
    parts = ((np.arange(20) + 0.5) / 20 - 0.5) * d
    for place in rng.uniform(0.2, 0.6, (20, 3)):
        shares = shares_of(grid, place[None], d)
        means = [
            np.maximum(1.0 - np.abs((place[k] + parts) / edges[k] - 0.5 - np.arange(sizes[k])[:, None]), 0.0).mean(1)
            for k in range(3)
        ]
        assert shares == pytest.approx(np.einsum("i,j,k->kji", *means), abs=1e-3)
        assert shares.sum() == pytest.approx(1.0, abs=1e-5)
        first = [np.sum(shares.sum(axis=tuple({0, 1, 2} - {2 - k})) * np.arange(sizes[k])) for k in range(3)]
        assert np.array(first) == pytest.approx(place / edges - 0.5, abs=1e-4)  # the first moment is kept


def test_a_lattice_fills_its_room_wherever_it_lies(grid):
    """Boxes of the spacing leave no gap; as points, its particles fill nodes by 0.97 to 1.03 with these cells."""
    level, d = grid.finest, 0.057
    rows = np.arange(24) * d
    for shift in (0.0, 0.013, 0.03, 0.049):
        places = np.stack(np.meshgrid(rows, rows, rows, indexing="ij"), -1).reshape(-1, 3) - 0.2 + shift
        inside = ((places > 0.0) & (places < (1.0, 1.2, 0.8))).all(axis=1)
        fill = shares_of(grid, places[inside], d) * d**3 / (level.dx * level.dy * level.dz)
        assert fill[2:6, 2:8, 2:7] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("width", [0.1, 0.2, 0.3])
def test_what_is_beyond_a_narrow_tank_counts_at_its_walls(width):
    """A tank one, two or three cells wide: each particle counts once, those near a wall at the node beside it."""
    compiler.start("cpu")
    narrow = new_pressure_grid((np.zeros(3), np.array([width, 0.8, 0.8])), 0.1)
    narrow.finest.open_volume.fill(1.0)
    assert narrow.finest.nx == round(width / 0.1)
    places = np.random.default_rng(0).uniform(0.01, 0.99, (40, 3)) * np.array([width, 0.8, 0.8])
    shares = shares_of(narrow, places, 0.05)
    assert shares.sum() == pytest.approx(40.0, abs=1e-4)
    one = shares_of(narrow, np.array([[0.02, 0.05, 0.05]]), 0.05)
    assert one[:, :, 0].sum() == pytest.approx(1.0, abs=1e-5)


def test_nodes_without_room_leave_their_share_to_others(grid):
    """A particle beside a solid counts in full at the nodes that are open to it."""
    level = grid.finest
    nodes = level.nx * level.ny * level.nz
    room = np.ones(level.open_volume.shape[0], np.float32)
    room[:nodes].reshape(level.nz, level.ny, level.nx)[:, :5] = 0.0
    level.open_volume.from_numpy(room)
    grid.workspace.near_closed.fill(1.0)
    for place, whole in (((0.4, 0.52, 0.4), 1.0), ((0.43, 0.5, 0.38), 1.0), ((0.41, 0.2, 0.37), 0.0)):
        shares = shares_of(grid, np.array([place]), 0.055, solids=1)
        assert shares.sum() == pytest.approx(whole, abs=1e-5)  # the last has none around it
        assert not shares[:, :5].any()
    level.open_volume.fill(1.0)
    grid.workspace.near_closed.fill(0.0)


def growth(sim, depth: float, seconds: float) -> tuple[float, float]:
    """Give a tank its longest standing wave, 1 mm/s fast; (rate at which it grows [1/s], omega over that of theory).

    Airy's linear waves: velocities are the gradient of cosh(k y) cos(k x), omega^2 = g k tanh(k H).
    """
    k = np.pi / sim.scene.tank.size[0]

    def shape(x):
        across, along = k * x[:, 0], k * x[:, 1]
        return np.stack([np.cosh(along) * np.sin(across), -np.sinh(along) * np.cos(across)], 1) / np.cosh(k * depth)

    velocities = sim.velocities.copy()
    velocities[:, :2] += 1e-3 * shape(sim.positions)
    sim.velocities = velocities
    found = []
    for _ in range(round(60 * seconds)):
        sim.step()
        mode = shape(sim.positions)
        found.append(np.sum(mode * sim.velocities[:, :2]) / np.sum(mode**2) / 1e-3)
    time, theory = np.arange(1, len(found) + 1) / 60.0, np.sqrt(9.81 * k * np.tanh(k * depth))

    def apart(p):
        return (p[0] * np.cos(p[3] * time) + p[1] * np.sin(p[3] * time)) * np.exp(p[2] * time) + p[4] - found

    rate, omega = least_squares(apart, [1.0, 0.0, 0.0, theory, 0.0]).x[2:4]
    return float(rate), float(omega / theory)


@pytest.mark.parametrize("turn", [(1.0, 0.0, 0.0, 0.0), (0.9, 0.2, 0.1, 0.35)], ids=["upright", "aslant"])
def test_only_particles_that_may_be_cut_off_ask_which_nodes_are_open(turn):
    """Beside thin walls, and where a cell has no room, all others find the same without asking."""
    plate = wt.Box(center=(0.35, 0.3, 0.4), size=(0.04, 0.5, 0.5), rotation=turn)
    ball, block = wt.Sphere(center=(0.75, 0.3, 0.3), radius=0.07), wt.Box(center=(0.8, 0.2, 0.7), size=(0.3, 0.3, 0.2))
    water = wt.Block(lower=(0.0, 0.0, 0.0), upper=(1.0, 0.4, 0.9))
    tank = wt.Tank(size=(1.0, 0.8, 0.9))
    sim = wt.Simulation(wt.Scene(spacing=0.05, tank=tank, fluids=[water], solids=[plate, ball, block]))
    grid, rng = sim.world.pressure, np.random.default_rng(4)
    level, near_closed = grid.finest, grid.workspace.near_closed
    places = rng.uniform(0.0, tank.size, (20_000, 3))
    marks = near_closed.to_numpy()
    assert 0.1 < (marks[: level.nx * level.ny * level.nz] > 0.0).mean() < 0.6
    found = shares_of(grid, places, 0.05, solids=1, thin=1)
    near_closed.fill(1.0)
    asked = shares_of(grid, places, 0.05, solids=1, thin=1)
    assert np.abs(found - asked).max() < 1e-3
    near_closed.fill(0.0)
    assert np.abs(shares_of(grid, places, 0.05, solids=1, thin=1) - asked).max() > 0.3


@pytest.mark.parametrize("size", [(40, 50, 20), (40, 59, 20), (40, 60, 20), (24, 29, 16), (31, 29, 14)], ids=str)
def test_the_longest_wave_of_a_tank_dies_out_and_is_as_fast_as_it_should_be(size):
    """The second law, and Airy: waves of 1 mm/s grew by 0.018/s in some tanks, were damped by 0.3/s in others.

    Width, height and depth in spacings; omega was 0.87 to 1.05 of that of theory.
    """
    width, height, depth = (0.025 * edge for edge in size)
    block = wt.Block(lower=(0, 0), upper=(width, depth))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=wt.Tank(size=(width, height)), fluids=[block]))
    sim.advance(15.0)
    rate, ratio = growth(sim, depth, 5.0)
    assert -0.15 < rate < -0.01
    assert ratio == pytest.approx(1.0, abs=0.02)


def test_the_longest_wave_of_a_shallow_tank_in_space_dies_out():
    """The same, seven layers deep, where a top layer with weight in level water let waves grow by 0.007/s."""
    size = (1.1, 0.65, 0.25)
    block = wt.Block(lower=(0, 0, 0), upper=(1.1, 0.175, 0.25))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=wt.Tank(size=size), fluids=[block]))
    sim.advance(15.0)
    rate, ratio = growth(sim, 0.175, 5.0)
    assert -0.15 < rate < -0.01
    assert ratio == pytest.approx(1.0, abs=0.02)
