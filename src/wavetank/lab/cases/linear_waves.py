"""Linear theory of a body that floats in a tank, in a plane: potential flow below small waves, walls and floor too.

What `heave` compares with. The flow is at rest but for small motions; surface and body keep their places:

    div grad phi = 0;  d eta / dt = d phi / dy,  d phi / dt = -g eta at the surface;  d phi / dn = V n at the body
    (m + A) dV/dt = -C xi - rho g Q eta

Newman 1977, "Marine Hydrodynamics", Sec. 6.15-6.17. A is the added mass of the surface at zero pressure, Q what pushes
the body where the surface is high; both follow from the inverse of one matrix, that of a lattice of squares with its
nodes on all boundaries (each square adds half of itself to each of its edges). The tank is symmetric about the body's
middle, and so half of it is enough: the flow of heave has no slope there, that of sway and roll no potential.

    code        symbol    meaning                                                            unit
    modes       V         velocities of the body: heave; or sway and roll                    m/s, rad/s
    push        Q         force by each surface node's potential                             m (m^2 for roll)
    schur       S         flow through each surface node by each's potential                 1
"""

import dataclasses

import numpy as np

G, WATER = 9.81, 1000.0  # m/s^2, kg/m^3


@dataclasses.dataclass(frozen=True)
class Barge:
    """A box with its middle in the middle of a tank of water; all in m, per metre of length."""

    beam: float
    height: float
    ratio: float  # of its density to the water's
    length: float  # of the tank
    depth: float  # of the water

    @property
    def draft(self) -> float:
        """How deep it floats [m]."""
        return self.ratio * self.height

    @property
    def mass(self) -> float:
        """Mass [kg/m]."""
        return WATER * self.beam * self.draft

    @property
    def inertia(self) -> float:
        """Moment of inertia about its middle [kg m]."""
        return self.mass * (self.beam**2 + self.height**2) / 12.0

    @property
    def righting(self) -> float:
        """Moment that rights it, over the angle [N]: weight times metacentric height."""
        center_over_keel, buoyancy_over_keel = 0.5 * self.height, 0.5 * self.draft
        metacentric = self.beam**2 / (12.0 * self.draft) + buoyancy_over_keel - center_over_keel
        return self.mass * G * metacentric


@dataclasses.dataclass(frozen=True)
class Linear:
    """The matrices of the theory; of both halves of the tank."""

    added: np.ndarray  # A [modes, modes], kg/m
    push: np.ndarray  # Q [modes, surface nodes], m
    schur: np.ndarray  # S [surface nodes, surface nodes]
    widths: np.ndarray  # m, of the surface that each node stands for


def linear(barge: Barge, cell: float, *, rolls: bool) -> Linear:
    """Return the matrices for heave, or for sway and roll, on squares with that edge [m].

    Half of beam and of tank, draft and depth are taken as the nearest multiples of it.
    """
    nx, ny = round(0.5 * barge.length / cell), round(barge.depth / cell)
    bx, by = round(0.5 * barge.beam / cell), round(barge.draft / cell)
    wet = np.ones((nx, ny), bool)  # squares; row 0 is the one at the surface
    wet[:bx, :by] = False
    # Conductance of edges along x at [i, j] to [i + 1, j], and along y.
    along_x = np.zeros((nx, ny + 1))
    along_x[:, :-1] += 0.5 * wet
    along_x[:, 1:] += 0.5 * wet
    along_y = np.zeros((nx + 1, ny))
    along_y[:-1] += 0.5 * wet
    along_y[1:] += 0.5 * wet
    surface = np.arange(bx, nx + 1)  # columns of its nodes
    widths = np.full(len(surface), cell)
    widths[[0, -1]] = 0.5 * cell
    fixed = np.zeros((nx + 1, ny + 1), bool)
    fixed[bx:, 0] = True
    if rolls:
        fixed[0, by:] = True
    sources = _sources(bx, by, nx, ny, cell, 0.5 * barge.height - barge.draft, rolls=rolls)
    to_surface = np.zeros((nx + 1, ny + 1, len(surface)))  # what unit potentials there send to their neighbours
    for k, i in enumerate(surface):
        to_surface[i, 1, k] = along_y[i, 0]
    free = ~fixed
    rhs = np.concatenate([sources, to_surface], axis=2) * free[:, :, None]
    solved = _solve(along_x, along_y, free, rhs)
    modes = sources.shape[2]
    added = 2.0 * WATER * np.einsum("ijm,ijn->mn", sources, solved[:, :, :modes])
    push = -2.0 * np.einsum("ijm,ijk->mk", sources, solved[:, :, modes:])
    own = np.zeros((len(surface), len(surface)))
    for k, i in enumerate(surface):
        own[k, k] += along_y[i, 0]
        if k + 1 < len(surface):
            edge = along_x[i, 0]
            own[k : k + 2, k : k + 2] += edge * np.array([[1.0, -1.0], [-1.0, 1.0]])
    schur = own - np.einsum("ijk,ijl->kl", to_surface, solved[:, :, modes:])
    return Linear(added, push, schur, widths)


def _sources(bx: int, by: int, nx: int, ny: int, cell: float, above: float, *, rolls: bool) -> np.ndarray:
    """Return the normals of the body, out of the water, times the length of boundary that each node stands for.

    `above` [m] is how high the body's middle is over the surface.
    """
    bottom, side = np.zeros((nx + 1, ny + 1)), np.zeros((nx + 1, ny + 1))
    bottom[: bx + 1, by] = cell
    bottom[[0, bx], by] = 0.5 * cell
    side[bx, : by + 1] = cell
    side[bx, [0, by]] = 0.5 * cell
    if not rolls:
        return bottom[:, :, None]
    x, y = np.arange(nx + 1)[:, None] * cell, -np.arange(ny + 1)[None, :] * cell - above
    # About the middle, anticlockwise: x n_y - y n_x, with n_y = 1 below and n_x = -1 at the side where x > 0.
    return np.stack([-side, x * bottom + y * side], axis=2)


def _solve(along_x: np.ndarray, along_y: np.ndarray, free: np.ndarray, rhs: np.ndarray) -> np.ndarray:
    """Return the potentials for these sources, zero at nodes that are not free: block elimination, column by column."""
    nx, ny = free.shape
    blocks: list[np.ndarray] = []
    sides = rhs.copy()
    for i in range(nx):
        own = np.zeros((ny, ny))
        down = np.diag(along_y[i])
        own[:-1, :-1] += down
        own[1:, 1:] += down
        own[:-1, 1:] -= down
        own[1:, :-1] -= down
        own += np.diag((along_x[i - 1] if i else 0.0) + (along_x[i] if i + 1 < nx else 0.0))
        dead = ~free[i] | (np.diag(own) == 0.0)
        own[dead], own[:, dead] = 0.0, 0.0
        own[dead, dead] = 1.0
        sides[i, dead] = 0.0
        if i:
            link = np.where(free[i] & free[i - 1], along_x[i - 1], 0.0)
            own -= link[:, None] * np.linalg.solve(blocks[-1], np.diag(link))
            sides[i] += link[:, None] * np.linalg.solve(blocks[-1], sides[i - 1])
        blocks.append(own)
    for i in reversed(range(nx)):
        right = sides[i]
        if i + 1 < nx:
            link = np.where(free[i] & free[i + 1], along_x[i], 0.0)
            right = right + link[:, None] * sides[i + 1]
        sides[i] = np.linalg.solve(blocks[i], right)
    return sides


def decay(barge: Barge, cell: float, times: np.ndarray, *, rolls: bool) -> np.ndarray:
    """Return how far the body still is from rest at `times` [s], over where it is let go at time 0.

    The water rests then, and lies as much lower than in the end as a body that is held up takes less room.
    """
    theory = linear(barge, cell, rolls=rolls)
    surface, modes = len(theory.widths), len(theory.added)
    mass = np.array([[barge.mass]]) if not rolls else np.diag([barge.mass, barge.inertia])
    spring = np.array([[WATER * G * barge.beam]]) if not rolls else np.diag([0.0, barge.righting])
    inverse = np.linalg.inv(mass + theory.added)
    # State: eta, phi at the surface, xi, V.
    size = 2 * (surface + modes)
    eta, phi = slice(0, surface), slice(surface, 2 * surface)
    xi, speed = slice(2 * surface, 2 * surface + modes), slice(2 * surface + modes, size)
    rate = np.zeros((size, size))
    rate[eta, phi] = theory.schur / theory.widths[:, None]
    rate[eta, speed] = 0.5 * theory.push.T / theory.widths[:, None]
    rate[phi, eta] = -G * np.eye(surface)
    rate[xi, speed] = np.eye(modes)
    rate[speed, xi] = -inverse @ spring
    rate[speed, eta] = -WATER * G * inverse @ theory.push
    values, vectors = np.linalg.eig(rate)
    start = np.zeros(size)
    start[xi.stop - 1] = 1.0
    if not rolls:
        start[eta] = -barge.beam / (barge.length - barge.beam)
    weights = np.linalg.solve(vectors, start)
    return np.real((np.exp(np.outer(times, values)) * weights) @ vectors[xi.stop - 1])
