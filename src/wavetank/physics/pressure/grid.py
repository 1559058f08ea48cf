"""The pressure grid: nodes, cells and the arrays that each level holds.

A uniform grid with cells of about one kernel support covers the tank; each coarser level halves it, down to a few cells
an axis. Nodes are the centres of cells, which divide the tank without remainder; the number of a node is
x + nx (y + ny z). Particles and nodes exchange what they hold with trilinear (hat) weights, as in particle-in-cell
methods (Harlow 1964); beyond the outermost nodes the nearest one counts.
"""

import dataclasses
import enum
import math
from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from wavetank.device.compiler import LANES, lanes, qd, threads, worth_sharing
from wavetank.device.state import Grid, integers, scalars
from wavetank.solids.distance import lift, vec3

EDGE = 1.0  # of a cell, over the kernel support
PARTS = 4  # of the particles that have sums of their own, where nodes are few
MOST_PARTS = 16  # where they are many: one for each thread, but not more
OPEN_CELLS = 2.0  # beyond an open side of the tank, for the air there
SMALLEST = 8  # cells along an axis that is not halved any more


@dataclasses.dataclass(frozen=True)
class Thresholds:
    """All limits of the pressure grid; what is not a fraction or a confidence is in edges of a cell ("cells").

    Pairs `x_from`, `x_to` are the ends of a linear ramp from 0 to 1. `Final` numbers are compiled into the kernels, the
    others are handed to them: a folded constant would round differently.
    """

    # Solids and open volume
    least_open: qd.f32 = 0.1  # open volume fraction below which a cell is solid
    hat_beside: Final[float] = 0.125  # share of a free cell that counts at the next node along an axis
    plane: Final[float] = 0.1  # cells by which distances beside a node differ from those of its wall, a plane
    seam_touching: Final[float] = 0.08  # cells up to which two solids touch
    seam_beyond: Final[float] = 0.5  # cells beyond a seam at which the wall that two solids make is looked for
    slit: Final[float] = 0.5  # cells between two solids up to which there is a slit
    mostly_open: Final[float] = 0.75  # open volume fraction from which the liquid fraction of a cell is reliable
    uncut: Final[float] = 0.97  # open volume fraction of a cell that no solid cuts; sums of weights are nearly 1
    # Thin walls
    thin_near: Final[float] = 1.75  # cells from a node up to which a wall may be a thin one
    search: Final[float] = 4.0  # cells from a node up to which solids are queried
    thickest: Final[float] = 1.6  # cells: a wall that is thicker is not a thin one
    inside_kept: Final[float] = 0.35  # cells up to which a node inside of a thin wall belongs to the nearer side
    behind: Final[float] = 0.15  # cells behind the plane of a thin wall from which a place is behind it
    outside: Final[float] = 0.25  # cells outside of a body's surface where it is asked which nodes are open to that
    open_from_outside: Final[float] = 0.25  # sum of weights of such nodes from which on only they count
    # The liquid
    full: qd.f32 = 0.98  # liquid fraction that cells without voids have at least
    slit_full: qd.f32 = 0.7  # liquid fraction that a cell at a solid has where there is no slit
    roof_from: Final[float] = 0.5  # cosine between a wall's normal and gravity: no roof
    roof_to: Final[float] = 0.85  # and surely one
    # The free surface
    lid_from: Final[float] = 0.8  # liquid fraction of the last cell below the closed top: surely air above it
    lid_to: Final[float] = 0.95  # surely none
    overhang_from: Final[float] = 0.1  # how far a wall above faces down: no overhang
    overhang_to: Final[float] = 0.4  # surely one
    below_from: Final[float] = 0.5  # liquid fraction below an overhang: surely a free surface
    below_to: Final[float] = 0.7  # surely none
    least_theta: qd.f32 = 0.01  # least distance from a node to the surface; less tilts the pressure along it
    film_from: qd.f32 = 0.75  # cells of liquid that are left to the iterations
    film_to: qd.f32 = 1.25  # cells from which on the grid does all
    film_reach: Final[int] = 3  # nodes on each side after which liquid is not a film
    # Enclosed regions
    air_from: Final[float] = 0.25  # cells of air at a node: none surely
    air_to: Final[float] = 0.5  # surely air
    mostly_full: Final[float] = 0.7  # liquid over open volume of a tank, below which there is air somewhere
    # The right-hand side
    inner_from: qd.f32 = 0.7  # liquid fraction from which a particle's density error counts
    inner_to: qd.f32 = 0.85  # and counts in full
    deep_from: Final[float] = 0.4  # supports below the surface from which it counts
    deep_to: Final[float] = 0.65  # and counts in full
    borne_from: qd.f32 = 0.6  # liquid fraction from which the grid carries weight
    borne_to: qd.f32 = 0.9  # and carries all of it
    wall_boost: qd.f32 = 1.0 / 3.0  # by which a wall's response to an approaching particle is increased
    reaction_layer: Final[float] = 1.25  # spacings from a moving solid up to which particles have to make room for it
    void_gain: qd.f32 = 6.0  # by which density errors are less, times the void fraction
    void_across: Final[float] = 1.0 / 3.0  # weight of each node beside in a mean liquid fraction across
    slit_closing: Final[float] = 0.5  # share of what lacks in a slit that is closed in a step
    # Pressure displacement
    shallow_from: qd.f32 = 0.43  # liquid fraction at a particle: surely in a shallow cell
    shallow_to: qd.f32 = 0.6  # surely not
    reach: Final[float] = 0.2  # supports: the longest displacement
    carried_depth: Final[float] = 0.48  # spacings below the surface from which the grid carries a particle in full
    carried_fade: Final[float] = 1.0  # spacings above that at which it carries nothing
    dispersed_from: qd.f32 = 0.45  # how far a particle's density is from that around: of the fluid around
    dispersed_to: qd.f32 = 0.8  # a drop of its own
    damping: Final[float] = 0.1  # of a usual step: the length of a step that damps as much
    largest_warm_start: Final[float] = 1.2  # of gravity: the largest acceleration that is carried on


THRESHOLDS = Thresholds()
#: Arrays of the workspace that hold whole numbers.
WHOLE = ("sums", "mass_sums", "blocked_faces", "region", "region_air", "region_error", "region_least")
#: Liquid fraction over which a cell that reads too little density draws nothing in, with bodies or without: beside
#: bodies all cells draw, or a box of half the density of water swings for ever in 2-D.
DRAW_RAMP = {True: (1e3, 2e3), False: (0.96, 1.0)}


@dataclasses.dataclass(frozen=True, eq=False)
class Level:
    """One level of the grid: its geometry, what is in its cells, and the equation that `multigrid.py` solves there."""

    open_volume: qd.types.ndarray()  # f32 [nodes]: fraction of the cell that solids leave open, 0 where hardly any
    aperture_x: qd.types.ndarray()  # f32 [nodes]: open fraction of the face to the next node along x
    aperture_y: qd.types.ndarray()  # likewise
    aperture_z: qd.types.ndarray()  # likewise
    overhang: qd.types.ndarray()  # f32 [nodes]: y of the nearest wall's normal, down is positive; 0 on coarse levels
    liquid: qd.types.ndarray()  # f32 [nodes]: liquid fraction, volume of liquid over open volume
    density: qd.types.ndarray()  # f32 [nodes]: mean density of the liquid over that of the heaviest fluid
    rhs: qd.types.ndarray()  # f32 [nodes]: right-hand side, density error over the stiffness M
    coef_x: qd.types.ndarray()  # f32 [nodes], 1/m^2: face coefficient to the next node along x
    coef_y: qd.types.ndarray()  # likewise
    coef_z: qd.types.ndarray()  # likewise
    inverse_diagonal: qd.types.ndarray()  # f32 [nodes], m^2: 0 outside of the liquid
    lam: qd.types.ndarray()  # f32 [nodes], m^2: the multiplier, which is the pressure up to a factor
    has_liquid: qd.types.ndarray()  # i32 [segments]: 1 where a segment of a row has liquid, else 0
    nx: qd.i32
    ny: qd.i32
    nz: qd.i32  # 1 in 2-D
    segments: qd.i32  # of `width` nodes in a row
    dx: qd.f32  # m: edges of a cell
    dy: qd.f32
    dz: qd.f32  # 1 in 2-D
    x0: qd.f32  # m: lower corner
    y0: qd.f32
    z0: qd.f32  # 0 in 2-D
    parts: qd.i32  # of the particles that have sums of their own
    alone: Final[int]  # 1 where there are several, so that no thread waits for another, else 0
    width: Final[int]  # nodes of a row that a thread takes at once
    periodic: Final[int]  # bit k is set where the world is periodic along axis k
    limits: Thresholds


@dataclasses.dataclass(frozen=True, eq=False)
class Workspace:
    """What only the finest level has; each array means one thing, and is valid from where it is written to the next.

    Arrays that a world does not need, see `Part`, have one entry.
    """

    # What solids do, renewed when they move: `solids.py`, `thin_walls.py`, `regions.py`
    wall_x: qd.types.ndarray()  # f32 [nodes]: outward normal of the nearest wall, up where none is near
    wall_y: qd.types.ndarray()  # likewise
    wall_z: qd.types.ndarray()  # likewise
    wall_distance: qd.types.ndarray()  # f32 [nodes], m: to that wall, below 0 inside of it
    uncut_cells: qd.types.ndarray()  # f32 [nodes]: 1 at an uncut cell, then its share spread over the nodes around
    slit_cells: qd.types.ndarray()  # f32 [nodes]: 1 where a cell is a slit between two solids, else 0
    volume_change: qd.types.ndarray()  # f32 [nodes]: how far open volume fractions within two cells are from 1
    far_from_solids: qd.types.ndarray()  # f32 [nodes]: 1 where no solid takes volume within two cells, else 0
    near_closed: qd.types.ndarray()  # f32 [nodes]: 1 where a node beside may be closed to what lies here, else 0
    thin_x: qd.types.ndarray()  # f32 [nodes]: outward normal of the thin wall at a node, 0 where there is none
    thin_y: qd.types.ndarray()  # likewise
    thin_z: qd.types.ndarray()  # likewise
    thin_distance: qd.types.ndarray()  # f32 [nodes], m: to that wall, below 0 inside of it
    blocked_faces: qd.types.ndarray()  # i32 [nodes]: bit k is set where a wall lies in the face to the next node
    region: qd.types.ndarray()  # i32 [nodes]: first node of the connected open region that a node belongs to
    # The liquid of a substep: `liquid.py`
    sums: qd.types.ndarray()  # i32 [parts * nodes]: fixed-point sums over particles, or free places; 0 between uses
    mass_sums: qd.types.ndarray()  # i32 [parts * nodes]: the same times densities, where these differ
    roof: qd.types.ndarray()  # f32 [nodes]: confidence that a cell is a slit below a roof
    liquid_below_roofs: qd.types.ndarray()  # f32 [nodes]: liquid fraction with those slits filled
    slit_deficit: qd.types.ndarray()  # f32 [nodes]: liquid that lacks in a slit, over open volume
    mean_x: qd.types.ndarray()  # f32 [nodes]: a field filtered along x (separable means and maxima)
    mean_y: qd.types.ndarray()  # likewise along y
    mean_xy: qd.types.ndarray()  # likewise along x and y
    mean_xz: qd.types.ndarray()  # likewise along x and z
    mean_yz: qd.types.ndarray()  # likewise along y and z
    voids: qd.types.ndarray()  # f32 [nodes]: void fraction between rows of particles
    row_least: qd.types.ndarray()  # f32 [ny nz]: smallest liquid fraction of a row along x
    row_most: qd.types.ndarray()  # f32 [ny nz]: largest
    own_depth: qd.types.ndarray()  # f32 [nodes], m: depth below the surface along the axes of the grid
    depth: qd.types.ndarray()  # f32 [nodes], m: the same array, or where solids are in the way that of nodes beside
    inside: qd.types.ndarray()  # f32 [nodes]: how far inside of the liquid: below 0 no error counts, above 1 all
    # Enclosed regions, at the root of each: `regions.py`, made when a region may be enclosed
    region_air: qd.types.ndarray()  # i32 [nodes]: confidence that a region has air, in 1024ths
    region_error: qd.types.ndarray()  # i32 [nodes]: fixed-point sum of the right-hand side
    region_nodes: qd.types.ndarray()  # f32 [nodes]: number of nodes with liquid
    region_least: qd.types.ndarray()  # i32 [nodes]: bits of the least multiplier, negated
    # Pressure displacement: `correct.py`, `bodies.py`
    gradient_x: qd.types.ndarray()  # f32 [nodes], m: derivative of the multiplier across the face to the next along x
    gradient_y: qd.types.ndarray()  # likewise
    gradient_z: qd.types.ndarray()  # likewise
    known_after: qd.types.ndarray()  # f32 [nodes]: sweeps of extrapolation after which a multiplier is known


@dataclasses.dataclass(frozen=True)
class Variant:
    """What a world has; kernels are compiled for it. Each is 1 where it is so, else 0."""

    solids: Final[int]  # besides the walls of the tank
    thin_walls: Final[int]  # some of them may be thin
    bodies: Final[int]  # some of them are moved by the liquid
    mixed: Final[int]  # fluids of different densities
    few_nodes: Final[int]  # so few that one thread is done with them before others have started


class Part(enum.Enum):
    """Arrays of the workspace that only some worlds need, by their names; room for them is made when they are used."""

    SOLIDS = (
        "wall_x",
        "wall_y",
        "wall_z",
        "wall_distance",
        "uncut_cells",
        "volume_change",
        "near_closed",
        "thin_x",
        "thin_y",
        "thin_z",
        "thin_distance",
        "roof",
        "liquid_below_roofs",
        "slit_deficit",
        "depth",
    )
    BODIES = ("slit_cells", "known_after")
    MIXED = ("mass_sums",)
    ENCLOSED = ("region_air", "region_error", "region_nodes", "region_least")


@dataclasses.dataclass
class PressureGrid:
    """The pressure grid of a world, and what is known of the solids in it."""

    levels: list[Level]  # the finest first
    workspace: Workspace
    found: Any = dataclasses.field(default_factory=lambda: integers(3))  # thin-wall nodes, regions, open nodes
    solids_version: int = -1  # of the solids when the open volume was found
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m/s^2: at that time, which says what lies above what
    has_thin_walls: bool = False
    regions: int = 1
    open_nodes: int = 0
    parts: frozenset[Part] = frozenset()  # of the workspace that there is room for
    last_step: float = 0.0  # s: the length of the step that the multipliers are of, 0 before the first one
    pressure: Any = None  # f32 [nodes], m^2/s^2: over the density of the heaviest fluid, once asked for: `probes.py`

    def make_room(self, *parts: Part) -> None:
        """Make room for these parts of the workspace, zeros, where there is none yet."""
        missing = {*parts} - self.parts
        if missing:
            names = [name for part in missing for name in part.value]
            self.workspace = dataclasses.replace(self.workspace, **_new_arrays(self.finest, names))
            self.parts |= missing
            if not missing.isdisjoint({Part.SOLIDS, Part.BODIES}):
                self.solids_version = -1  # what they hold has not been found yet

    def may_be_enclosed(self, liquid: float) -> bool:
        """Say whether some region may have no air, where there is that volume of `liquid` [m^dim] in all of them."""
        open_volume = self.open_nodes * self.finest.dx * self.finest.dy * self.finest.dz
        return self.regions > 1 or liquid > THRESHOLDS.mostly_full * open_volume

    def forget_pressure(self) -> None:
        """Forget the pressures that places were asked for; they are known again after the next step."""
        self.pressure, self.last_step = None, 0.0

    @property
    def finest(self) -> Level:
        """The level that particles exchange with."""
        return self.levels[0]


# --- nodes and places ---


@qd.func
def ramp(value, first, last):
    """Linear ramp from 0, up to `first`, to 1, from `last` on."""
    return qd.min(qd.max((value - first) / (last - first), 0.0), 1.0)


@qd.func
def on_axis(x, y, z, axis):
    """That of three values which belongs to an axis."""
    return qd.select(axis == 0, x, qd.select(axis == 1, y, z))


@qd.func
def directions(grid: Level):
    """Number of neighbours of a node across faces: direction 2 k is to the one before along axis k, 2 k + 1 after."""
    return qd.select(grid.nz > 1, 6, 4)


@qd.func
def coordinates(grid: Level, n):
    """Whole coordinates of node `n`."""
    return qd.Vector([n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny)])


@qd.func
def coordinate(grid: Level, n, axis):
    """Whole coordinate of node `n` along an axis."""
    return on_axis(n % grid.nx, n // grid.nx % grid.ny, n // (grid.nx * grid.ny), axis)


@qd.func
def size(grid: Level, axis):
    """Number of nodes along an axis."""
    return on_axis(grid.nx, grid.ny, grid.nz, axis)


@qd.func
def edge(grid: Level, axis):
    """Edge of a cell along an axis [m]."""
    return on_axis(grid.dx, grid.dy, grid.dz, axis)


@qd.func
def center_of(grid: Level, n):
    """Centre of the cell of node `n` [m]; on z = 0 in 2-D."""
    c = coordinates(grid, n)
    center = vec3((c[0] + 0.5) * grid.dx, (c[1] + 0.5) * grid.dy, (c[2] + 0.5) * grid.dz)
    center += vec3(grid.x0, grid.y0, grid.z0)
    if grid.nz == 1:
        center.z = 0.0
    return center


@qd.func
def in_cells(grid: Level, p: qd.template()):
    """The place `p` [m] in grid coordinates [cells], whole at nodes; 0 along an axis that the world does not have."""
    point = lift(p) - vec3(grid.x0, grid.y0, grid.z0)
    return vec3(
        point.x / grid.dx - 0.5, point.y / grid.dy - 0.5, point.z / grid.dz - (0.5 if qd.static(p.n == 3) else 0.0)
    )


@qd.func
def shortest_edge(grid: Level):
    """The shortest edge of a cell [m]."""
    edge = qd.min(grid.dx, grid.dy)
    if grid.nz > 1:
        edge = qd.min(edge, grid.dz)
    return edge


@qd.func
def longest_edge(grid: Level):
    """Longest edge of a cell [m]."""
    longest = qd.max(grid.dx, grid.dy)
    if grid.nz > 1:
        longest = qd.max(longest, grid.dz)
    return longest


@qd.func
def hat_weights(share, dim: qd.template()):
    """Trilinear weights of the corners of a cell, in the order of `corners`, at the place `share` in it [0 to 1]."""
    x = qd.Vector([1.0 - share.x, share.x])
    y = qd.Vector([1.0 - share.y, share.y])
    z = qd.Vector([1.0 - share.z, share.z])
    return qd.Vector([x[k & 1] * y[k >> 1 & 1] * z[k >> 2] for k in qd.static(range(2**dim))])


@qd.func
def clamped(grid: Level, number, axis):
    """A whole coordinate along an axis as that of a node: the nearest one, or the image where the world is periodic."""
    count, node = size(grid, axis), number
    if qd.static(grid.periodic):
        if grid.periodic >> axis & 1:
            node += qd.select(number < 0, count, qd.select(number >= count, -count, 0))
    return qd.min(qd.max(node, 0), count - 1)


@qd.func
def stride(grid: Level, axis):
    """Difference of the numbers of neighbours along an axis, but for the seam of a periodic one."""
    return on_axis(1, grid.nx, grid.nx * grid.ny, axis)


@qd.func
def neighbor(grid: Level, n, axis, side):
    """Number of the next node on a `side`, -1 or 1, along an axis: no node beyond the tank, the image across a seam."""
    following = n + side * stride(grid, axis)
    if qd.static(grid.periodic):
        if grid.periodic >> axis & 1:
            last = size(grid, axis) - 1
            if coordinate(grid, n, axis) == qd.select(side > 0, last, 0):
                following = n - side * last * stride(grid, axis)
    return following


@qd.func
def nodes_beyond(grid: Level, n, axis, side):
    """How many nodes follow node `n` on a `side` along an axis: all of them where the world is periodic."""
    place, count = coordinate(grid, n, axis), size(grid, axis)
    beyond = qd.select(side < 0, place, count - 1 - place)
    if qd.static(grid.periodic):
        if grid.periodic >> axis & 1:
            beyond = count
    return beyond


@qd.func
def corners(grid: Level, low, dim: qd.template()):
    """Numbers of the nodes at the corners of the cell from the whole coordinates `low` on, clamped."""
    # Spelled out, because what vectors the compiler makes of this depends on how it is said, and with it last digits.
    x = qd.Vector([qd.min(qd.max(low[0] + k, 0), grid.nx - 1) for k in qd.static(range(2))])
    y = qd.Vector([qd.min(qd.max(low[1] + k, 0), grid.ny - 1) * grid.nx for k in qd.static(range(2))])
    z = qd.Vector([qd.min(qd.max(low[2] + k, 0), grid.nz - 1) * grid.nx * grid.ny for k in qd.static(range(2))])
    if qd.static(grid.periodic):
        for k in qd.static(range(2)):
            x[k] = clamped(grid, low[0] + k, 0)
            y[k] = clamped(grid, low[1] + k, 1) * grid.nx
            z[k] = clamped(grid, low[2] + k, 2) * grid.nx * grid.ny
    return qd.Vector([x[k & 1] + y[k >> 1 & 1] + z[k >> 2] for k in qd.static(range(2**dim))])


@qd.func
def node_at(grid: Level, c):
    """Number of the node with the whole coordinates `c`, clamped."""
    x = qd.min(qd.max(c[0], 0), grid.nx - 1)
    y = qd.min(qd.max(c[1], 0), grid.ny - 1)
    z = qd.min(qd.max(c[2], 0), grid.nz - 1)
    if qd.static(grid.periodic):  # `corners` says why all is said twice
        x, y, z = clamped(grid, c[0], 0), clamped(grid, c[1], 1), clamped(grid, c[2], 2)
    return x + grid.nx * (y + grid.ny * z)


@qd.func
def nearest_node(grid: Level, s):
    """Number of the node nearest to the place `s` [cells]."""
    return node_at(grid, qd.floor(s + 0.5, qd.i32))


@qd.func
def clamped_neighbor(grid: Level, n, axis, aside):
    """Number of the node `aside` of node `n` along an axis, clamped."""
    c = coordinates(grid, n)
    for k in qd.static(range(3)):
        c[k] += qd.select(axis == k, aside, 0)
    return node_at(grid, c)


# --- fixed-point sums ---


@qd.func
def add_fixed(sums: qd.template(), at, amount, alone: qd.template()):
    """Add a whole number; `alone` where no other thread adds to these sums."""
    if qd.static(alone):
        sums[at] = sums[at] + amount
    else:
        qd.atomic_add(sums[at], amount)


@qd.func
def parts_of(grid: Level, cells: Grid):
    """Parts in which threads share the particles."""
    return grid.parts if qd.static(grid.alone) else cells.parts


@qd.func
def collected(sums: qd.template(), n, nodes, parts):
    """Sum of all `parts` at node `n`, which are 0 afterwards."""
    total = 0
    for part in range(parts):
        total += sums[part * nodes + n]
        sums[part * nodes + n] = 0
    return total


# --- separable filters ---


@qd.func
def row_beside(grid: Level, row, axis, aside):
    """Number of the first node of the row that is `aside` of a `row` along y or z, clamped."""
    y, z = row % grid.ny, row // grid.ny
    return node_at(grid, qd.Vector([0, y + qd.select(axis == 1, aside, 0), z + qd.select(axis == 2, aside, 0)]))


@qd.func
def smooth_along(to: qd.template(), values: qd.template(), grid: Level, row, axis: qd.template(), share: qd.template()):
    """Write means along an axis, in which each node beside has that `share`, for the nodes of a row."""
    first = grid.nx * row
    if qd.static(axis == 0):
        for x in range(grid.nx):
            around = values[first + clamped(grid, x - 1, 0)] + values[first + clamped(grid, x + 1, 0)]
            to[first + x] = (1.0 - 2.0 * share) * values[first + x] + share * around
    else:
        before, after = row_beside(grid, row, axis, -1), row_beside(grid, row, axis, 1)
        for x in range(grid.nx):
            around = values[before + x] + values[after + x]
            to[first + x] = (1.0 - 2.0 * share) * values[first + x] + share * around


@qd.func
def largest_along(to: qd.template(), values: qd.template(), grid: Level, row, axis: qd.template(), far: qd.template()):
    """Write the largest of the values of `far` nodes on each side along an axis, for the nodes of a row."""
    first = grid.nx * row
    if qd.static(axis == 0):
        for x in range(grid.nx):
            largest = 0.0
            for aside in qd.static(range(-far, far + 1)):
                largest = qd.max(largest, values[first + clamped(grid, x + aside, 0)])
            to[first + x] = largest
    else:
        rows = qd.Vector([row_beside(grid, row, axis, aside) for aside in qd.static(range(-far, far + 1))])
        for x in range(grid.nx):
            largest = 0.0
            for k in qd.static(range(2 * far + 1)):
                largest = qd.max(largest, values[rows[k] + x])
            to[first + x] = largest


# --- allocation ---


def new_pressure_grid(box: tuple[np.ndarray, np.ndarray], h: float, periodic: int = 0) -> PressureGrid:
    """Allocate the grid of a tank between the corners `box` [m] with kernel support `h` [m].

    Bits of `periodic` say along which axes the world is periodic: there all levels have an even number of nodes, as the
    red-black sweeps need it.
    """
    shape = _shape_of(box, h, periodic)
    levels = [_new_level(shape, box, periodic)]
    while any(_can_halve(n, periodic >> axis & 1) for axis, n in enumerate(shape)):
        shape = [n // 2 if _can_halve(n, periodic >> axis & 1) else n for axis, n in enumerate(shape)]
        levels.append(_new_level(shape, box, periodic))
    return PressureGrid(levels, _new_workspace(levels[0]))


def count_nodes(box: tuple[np.ndarray, np.ndarray], h: float, periodic: int = 0) -> int:
    """Return how many nodes the finest level has, in Python's integers: it may be more than there can be."""
    return math.prod(_shape_of(box, h, periodic))


def bytes_per_node() -> int:
    """Return the most bytes that a node of the finest level takes on a processor, coarser levels and sums included."""
    fields = len(dataclasses.fields(Level)) + len(dataclasses.fields(Workspace))
    return 4 * (fields + 2 * MOST_PARTS) * 8 // 7


def segment_width() -> int:
    """Return how many nodes of a row a thread takes at once: one of each colour at least (`multigrid.py`)."""
    return max(2, lanes())


def _shape_of(box: tuple[np.ndarray, np.ndarray], h: float, periodic: int) -> list[int]:
    lengths = [float(length) / (EDGE * h) for length in box[1] - box[0]]
    return [_ring(cells) if periodic >> axis & 1 else _divided(cells) for axis, cells in enumerate(lengths)]


def _parts_of(nodes: int) -> int:
    """Return how many sums each of so many nodes has: on a processor several, so that no thread waits for another."""
    if lanes() == 1:
        return 1
    return max(PARTS, min(threads(), MOST_PARTS)) if worth_sharing(nodes) else PARTS


def _can_halve(n: int, ring: int) -> bool:
    return n % (4 if ring else 2) == 0 and n > SMALLEST


def _divided(cells: float) -> int:
    """Return the number near `cells` that can be halved until `SMALLEST` or less is left."""
    halvings = max(0, math.ceil(math.log2(max(cells, 1.0) / SMALLEST)))
    return max(1, round(cells / 2**halvings)) * 2**halvings


def _ring(cells: float) -> int:
    """Return the even number near `cells` that can be halved until less than twice `SMALLEST`, and even, is left."""
    halvings = max(0, math.floor(math.log2(max(cells, 1.0) / SMALLEST)))
    return max(2, round(cells / 2 ** (halvings + 1))) * 2 ** (halvings + 1)


def _new_level(shape: list[int], box: tuple[np.ndarray, np.ndarray], periodic: int) -> Level:
    nx, ny, nz = [*shape, 1][:3]
    edges = [float(length) / n for length, n in zip(box[1] - box[0], shape, strict=True)]
    x0, y0, z0 = [*map(float, box[0]), 0.0][:3]
    dx, dy, dz = [*edges, 1.0][:3]
    rim = _with_rim(nx, ny, nz)
    arrays = [field.name for field in dataclasses.fields(Level) if _is_array(field)]
    parts = _parts_of(nx * ny * nz)
    return Level(
        **{name: integers(rim) if name == "has_liquid" else scalars(rim) for name in arrays},
        nx=nx,
        ny=ny,
        nz=nz,
        segments=-(-nx // segment_width()),
        dx=dx,
        dy=dy,
        dz=dz,
        x0=x0,
        y0=y0,
        z0=z0,
        parts=parts,
        alone=int(parts > 1),
        width=segment_width(),
        periodic=periodic,
        limits=THRESHOLDS,
    )


def _new_workspace(finest: Level) -> Workspace:
    """Allocate the arrays that every world needs; the others have one entry, and are made by `make_room`."""
    names = {field.name for field in dataclasses.fields(Workspace)}
    later = {name for part in Part for name in part.value}
    arrays = _new_arrays(finest, names - later)
    missing = {name: (integers if name in WHOLE else scalars)(1) for name in later - {"depth"}}
    return Workspace(**arrays, **missing, depth=arrays["own_depth"])  # no solid is in the way of any node


def _new_arrays(finest: Level, names: Iterable[str]) -> dict[str, Any]:
    """Allocate these arrays of the workspace, zeros."""
    sums = finest.parts * finest.nx * finest.ny * finest.nz
    sums += 2  # where a row is shorter than three, `liquid.py` adds nothing beyond its end
    rows, rim = finest.ny * finest.nz, _with_rim(finest.nx, finest.ny, finest.nz)
    lengths = {"sums": sums, "mass_sums": sums, "row_least": rows, "row_most": rows}
    return {name: (integers if name in WHOLE else scalars)(lengths.get(name, rim)) for name in names}


def _with_rim(nx: int, ny: int, nz: int) -> int:
    """Return the length of arrays of nodes: what is beyond the last node is read, and counts nothing."""
    return nx * ny * nz + nx * ny + LANES


def _is_array(field: dataclasses.Field[Any]) -> bool:
    return field.type not in (qd.i32, qd.f32, Final[int], Thresholds)
