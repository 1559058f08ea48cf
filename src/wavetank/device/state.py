"""The arrays of a world on the device, with unit and shape; allocated once at capacity.

Arrays of particles have `MARGIN` rows more than there is room: loops over whole blocks and groups read them, whatever
they hold, and drop what they found. Row `capacity` is nowhere, farther from everything than any support, and stands in
neighbour lists where there is no neighbour.

Two sets of the moving arrays exist so that sorting and Jacobi updates can read one and write the other; which is
which is swapped on the host, nothing is copied.

What kernels take is frozen, and the same arrays and numbers are the same object each time (`swapped`, `interned`):
the compiler then knows the arguments of a launch, which else cost more than a small kernel (docs/performance.md).
"""

import dataclasses
from typing import Any, Final, TypeVar

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.periods import Periods

Numbers = TypeVar("Numbers")
Together = TypeVar("Together")
MARGIN = 32  # rows behind the last particle that loops over whole blocks and groups may read


@dataclasses.dataclass(frozen=True, eq=False)
class Particles:
    """What a particle carries, in device order (sorted by cell)."""

    x: qd.types.ndarray()  # vec [capacity], m: position at the start of the substep
    px: qd.types.ndarray()  # f32 [capacity], m: predicted position, x*; see `physics/predicted_positions.py`
    py: qd.types.ndarray()  # likewise
    pz: qd.types.ndarray()  # likewise; unused in 2-D
    v: qd.types.ndarray()  # vec [capacity], m/s
    a: qd.types.ndarray()  # vec [capacity], m/s^2: by pressure, see `physics/pressure/correct.py`
    viscous: qd.types.ndarray()  # vec [capacity], m/s^2: by viscosity in the last step; [1] where nothing is viscous
    id: qd.types.ndarray()  # i32 [capacity]: name of the particle for life; those of removed ones are not used again
    material: qd.types.ndarray()  # i32 [capacity]: number of its material
    near: qd.types.ndarray()  # i32 [capacity]: bit k is set where solid k is near, bit 30 for all solids from 30 on
    dye: qd.types.ndarray()  # i32 [capacity]: 0 or strength << 24 | red << 16 | green << 8 | blue, strength 1 .. 127
    frozen: qd.types.ndarray()  # i32 [capacity]: 1 where a particle is ice and keeps its place


#: Arrays of particles that say what these are from step to step: they are saved, and move to larger arrays. The others
#: follow from them, but for `viscous`, which goes along where fluids are viscous. All of them are sorted
#: (`sorting.copy_particle`) and written for new particles (`population.append_rows`).
LASTING: tuple[str, ...] = ("x", "v", "a", "id", "dye", "frozen", "material")


@dataclasses.dataclass(frozen=True, eq=False)
class Temporaries:
    """What a substep computes anew."""

    rho: qd.types.ndarray()  # f32 [capacity], kg/m^3: density
    lam: qd.types.ndarray()  # f32 [capacity], m^2: multiplier, the sum over the iterations of a substep
    dlam: qd.types.ndarray()  # f32 [capacity], m^2: its change in the last iteration
    denominator: qd.types.ndarray()  # f32 [capacity], 1/m^2: of the multiplier (Eq. 5)
    omega: qd.types.ndarray()  # vec3 [capacity], 1/s: vorticity
    wall: qd.types.ndarray()  # vec4 [capacity]: (gradient [1/m], share of rho_0) of the solids, where any is near
    inverse_mass: qd.types.ndarray()  # f32 [capacity], 1: over that of the heaviest fluid; 1 where all are equal
    shallow: qd.types.ndarray()  # f32 [capacity]: confidence, 0 to 1, that its cell is hardly filled: a puddle
    # The solids near each particle, see `physics/near_solids.py`; one row in worlds without solids but for the tank.
    touching: qd.types.ndarray()  # i32 [capacity]: 1 where its path may touch one, else 0
    solid_count: qd.types.ndarray()  # i32 [capacity]: how many there are, even if it had no room
    query_point: qd.types.ndarray()  # vec3 [capacity], m: where their distances were measured
    solid: qd.types.ndarray()  # i32 [slots * capacity]: their numbers, the first of all particles first
    plane: qd.types.ndarray()  # vec4 [slots * capacity]: outward normal [1] and distance [m] there
    push: qd.types.ndarray()  # vec3 [slots * capacity], m, heaviest particle's mass: what they have moved it by


@dataclasses.dataclass(frozen=True, eq=False)
class Grid:
    """Cells of edge h and the neighbour lists. Cells repeat: see `physics/neighbors.py`."""

    cell: qd.types.ndarray()  # i32 [capacity]: cell of each particle
    start: qd.types.ndarray()  # i32 [cells + 1]: first particle of each cell, in sorted order
    fill: qd.types.ndarray()  # i32 [cells]: particles placed so far
    blocks: qd.types.ndarray()  # i32 [blocks]: partial sums of the scan
    order: qd.types.ndarray()  # i32 [capacity]: which particle comes at each sorted place
    number: qd.types.ndarray()  # i32 [groups]: entries of each group's list
    list: qd.types.ndarray()  # i32 [groups * room]: who is a neighbour of any of a group's eight particles
    room: qd.i32  # places for each group, a multiple of 16
    lanes: Final[int]  # particles that are computed together: a group's, or one
    parts: qd.i32  # in which threads share a pass over pairs
    nowhere: qd.i32  # index of a particle that is far from all others
    nx: qd.i32  # cells before the pattern moves on along y
    ny: qd.i32
    nz: qd.i32
    cells: qd.i32
    periods: Periods


@dataclasses.dataclass(frozen=True, eq=False)
class Diffuse:
    """Spray, foam and bubbles, packed at the front in the order of their birth."""

    x: qd.types.ndarray()  # vec [capacity], m
    v: qd.types.ndarray()  # vec [capacity], m/s
    kind: qd.types.ndarray()  # i32 [capacity]: 1 spray, 2 foam, 3 bubble; see KINDS
    age: qd.types.ndarray()  # f32 [capacity], s
    life: qd.types.ndarray()  # f32 [capacity], s: age at which it ends
    id: qd.types.ndarray()  # i32 [capacity]: number of the birth


@dataclasses.dataclass(frozen=True, eq=False)
class Births:
    """What a frame's births need and forget."""

    normal: qd.types.ndarray()  # vec [water capacity]: outward unit normal of the water's surface, zero inside
    first: qd.types.ndarray()  # i32 [water capacity + 1]: births of each water particle, then the first of its places
    kept: qd.types.ndarray()  # i32 [capacity + 1]: 1 for who lives on, then its next place
    blocks: qd.types.ndarray()  # i32 [blocks]: partial sums of the scan
    reluctance: qd.types.ndarray()  # f32 [materials]: energy at which a fluid foams, in that of one without viscosity


@dataclasses.dataclass(frozen=True)
class Air:
    """Scalars of spray, foam and bubbles, from the scene's parameters; see `physics/foam/`."""

    dt: qd.f32  # s, of the frame
    speed: qd.f32  # m/s: U
    interval: qd.f32  # s, between two births of a water particle, and two looks of a particle at the water around it
    made: qd.f32  # births of a water particle in that time where all potentials are one
    lifetime: qd.f32  # s
    spread: qd.f32  # m: how far from the way of its water particle one is born
    share: qd.f32  # makes the sum of Poly6 around a point one in the bulk
    mean: qd.f32  # makes the sum of 1 - q around a particle one in the bulk
    spray_keep: qd.f32  # share of the velocity relative to the air that is left after dt
    spray_path: qd.f32  # s: way per relative velocity in dt
    spray_bend: qd.f32  # s^2: way per acceleration in dt
    bubble_path: qd.f32
    bubble_bend: qd.f32
    bubble_keep: qd.f32  # likewise relative to the water, after an interval
    bubble_gain: qd.f32  # s: velocity per acceleration in an interval
    every: qd.i32  # frames in an interval
    seed: qd.i32


@dataclasses.dataclass(frozen=True, eq=False)
class Walls:
    """What a flat wall adds to the density: see `half_space_table`."""

    table: qd.types.ndarray()  # vec2 [samples]: I(s) and A(s) at s / h from -1 to 1


@dataclasses.dataclass
class Fluids:
    """What several, thick or cohesive fluids need on the device; a world pays for what it uses."""

    capacity: int
    rows: Any  # vec4 [materials]: inverse mass over the smallest, viscosity [Pa s], tension [N/m], wetting (0 to 1)
    written: np.ndarray | None = None  # what `rows` holds
    weighed: bool = False  # whether Temporaries.weight differs from 1
    arrays: dict[str, Any] = dataclasses.field(default_factory=dict)

    def array(self, name: str, rows: int = 0) -> Any:
        """Return the vec4 [rows, or capacity] of that name, made when it is first asked for."""
        if name not in self.arrays:
            self.arrays[name] = vectors(4, rows or self.capacity + MARGIN)
        return self.arrays[name]

    def pairs(self, grid: Grid) -> Any:
        """Return room for a number of each pair that `grid` lists, f32 [8 * places in its lists]."""
        size = 8 * grid.list.shape[0]
        if "pairs" not in self.arrays or self.arrays["pairs"].shape[0] != size:
            self.arrays["pairs"] = scalars(size)
        return self.arrays["pairs"]

    def together(self, kind: type[Together], *arrays: Any) -> Together:
        """Return these arrays as one object of that frozen `kind`, the same one each time."""
        known = self.arrays.setdefault(kind.__name__, {})
        asked = tuple(map(id, arrays))
        if asked not in known:
            known.clear()
            known[asked] = kind(*arrays)
        made: Together = known[asked]
        return made


@dataclasses.dataclass(frozen=True)
class Coefficients:
    """Scalars of a substep, from the scene's parameters."""

    dt: qd.f32  # s
    gravity_x: qd.f32  # m/s^2
    gravity_y: qd.f32
    gravity_z: qd.f32  # 0 in 2-D
    h: qd.f32  # m, support radius
    inverse_h: qd.f32  # 1/m
    inverse_h2: qd.f32  # 1/m^2
    density_scale: qd.f32  # see RestLattice
    gradient_scale: qd.f32  # 1/m^2, of what `smoothing.kernel` gives
    eps: qd.f32  # 1/m^2, constraint force mixing
    relaxation: qd.f32
    momentum: qd.f32
    attraction: qd.f32
    tensile: qd.f32  # m^2, artificial pressure of one iteration over w(dq)^n
    tensile_exponent: qd.f32
    largest_correction: qd.f32  # m, of one iteration
    push_limit: qd.f32  # m: the same for thick fluids at rest, 0 where none are; and how much more for every m/s
    push_time: qd.f32  # s
    viscosity: qd.f32  # share per substep
    calming: qd.f32  # share per substep of what is slow, over that of the viscosity
    slow: qd.f32  # s^2/m^2: inverse square of the speed below which motion past neighbours is slow
    calming_at_solids: qd.f32  # share per substep of what moves slowly to and fro before them
    static_friction: qd.f32  # m/s, what solids take from slow sliding in a substep
    slow_at_solids: qd.f32  # s^2/m^2: inverse square of the speed below which sliding is slow
    vorticity: qd.f32  # m/s
    coherence: qd.f32
    calm: qd.f32  # 1/s, vorticity of water at rest
    speed_limit: qd.f32  # m/s
    warm_start: qd.f32  # share of the pressure of the last step that this one begins with
    largest_warm_start: qd.f32  # m/s^2, at most of it
    wall_density: qd.f32
    wall_gap: qd.f32  # m
    skin: qd.f32 = 0.0  # m^(dim - 2), see physics/terms/tension.py
    cohesion: qd.f32 = 0.0  # m^(dim - 2), likewise
    fallen: qd.f32 = (
        0.0  # s^2: by this times gravity places are told from where all fell alike, see `physics/pressure/`
    )


MOST_INTERNED = 512
_interned: dict[tuple[Any, ...], Any] = {}


def interned(numbers: Numbers) -> Numbers:
    """Return the first object that equals `numbers`, which the compiler then knows.

    That is a dataclass of numbers and vectors, or a vector; nobody may change it from now on.
    """
    parts = (numbers,) if isinstance(numbers, np.ndarray) else vars(numbers).values()
    key = (type(numbers), *[part.tobytes() if isinstance(part, np.ndarray) else part for part in parts])
    if len(_interned) > MOST_INTERNED:
        _interned.clear()
    first: Numbers = _interned.setdefault(key, numbers)
    return first


def swapped(known: dict[tuple[Any, ...], Any], a: Particles, b: Particles, *names: str) -> tuple[Particles, Particles]:
    """Return `a` and `b` with the arrays of those `names` exchanged; nothing is copied.

    What it returns stays `known`: the same arrays are the same object the next time.
    """
    asked = (id(a), id(b), *names)
    if asked not in known:
        pair = []
        for own, other in ((a, b), (b, a)):
            arrays = {name: getattr(other if name in names else own, name) for name in own.__dataclass_fields__}
            pair.append(known.setdefault(tuple(map(id, arrays.values())), Particles(**arrays)))
        known[asked] = (*pair, a, b)  # the last two so that their addresses stay theirs
    return known[asked][0], known[asked][1]


#: What a particle is, by its number in files and on the device.
KINDS = ("water", "spray", "foam", "bubble")


@qd.func
def spray():
    """Number of spray in KINDS."""
    return 1


@qd.func
def foam():
    """Number of foam in KINDS."""
    return 2


@qd.func
def bubble():
    """Number of bubbles in KINDS."""
    return 3


@qd.func
def nowhere():
    """Where the particle is that is nowhere [m], in every direction."""
    return 1e6


def vectors(dim: int, capacity: int) -> Any:
    """Allocate a device array of `capacity` vectors with `dim` float32 components."""
    return qd.ndarray(qd.types.vector(dim, qd.f32), shape=(max(capacity, 1),))


def scalars(*shape: int) -> Any:
    """Allocate a device array of float32 numbers."""
    return qd.ndarray(qd.f32, shape=tuple(max(n, 1) for n in shape))


def integers(*shape: int) -> Any:
    """Allocate a device array of int32 numbers."""
    return qd.ndarray(qd.i32, shape=tuple(max(n, 1) for n in shape))


def new_particles(dim: int, capacity: int) -> Particles:
    """Allocate particles that all rest at the origin, and the one that is nowhere."""
    rows = capacity + MARGIN
    px, py, pz = (scalars(rows if k < dim else 1) for k in range(3))
    places = np.zeros(rows, np.float32)
    places[capacity] = nowhere.fn()
    for component in (px, py, pz)[:dim]:
        upload(component, places)
    x, v, a = (vectors(dim, rows) for _ in range(3))
    return Particles(x, px, py, pz, v, a, vectors(dim, 1), *(integers(rows) for _ in range(5)))


def with_viscosity(particles: Particles) -> Particles:
    """Return the particles with room for what viscosity did to each, zero where there was none."""
    if particles.viscous.shape == particles.x.shape:
        return particles
    return dataclasses.replace(particles, viscous=vectors(particles.x.element_shape[0], particles.x.shape[0]))


def without_viscosity(particles: Particles) -> Particles:
    """Return the particles with one row of what viscosity did, as worlds have where nothing is viscous."""
    return dataclasses.replace(particles, viscous=vectors(particles.x.element_shape[0], 1))


def new_temporaries(capacity: int) -> Temporaries:
    """Allocate the temporaries of a substep, without room for solids but the tank."""
    rows = capacity + MARGIN
    rho, lam, dlam, denominator, inverse_mass, shallow = (scalars(rows) for _ in range(6))
    inverse_mass.fill(1.0)
    return Temporaries(
        rho=rho,
        lam=lam,
        dlam=dlam,
        denominator=denominator,
        omega=vectors(3, rows),
        wall=vectors(4, rows),
        inverse_mass=inverse_mass,
        shallow=shallow,
        **_solids_near(1, 1),
    )


def with_solids(temporaries: Temporaries, slots: int) -> Temporaries:
    """Return temporaries with room for `slots` solids near each particle."""
    rows = temporaries.rho.shape[0]
    if temporaries.solid_count.shape[0] == rows:
        return temporaries
    return dataclasses.replace(temporaries, **_solids_near(rows, slots))


def _solids_near(rows: int, slots: int) -> dict[str, Any]:
    """Allocate what particles know of the solids near them, by the names of the fields."""
    return {
        "touching": integers(rows),
        "solid_count": integers(rows),
        "query_point": vectors(3, rows),
        "solid": integers(slots * rows),
        "plane": vectors(4, slots * rows),
        "push": vectors(3, slots * rows),
    }


def new_diffuse(dim: int, capacity: int) -> Diffuse:
    """Allocate room for spray, foam and bubbles."""
    x, v = vectors(dim, capacity), vectors(dim, capacity)
    return Diffuse(x, v, integers(capacity), scalars(capacity), scalars(capacity), integers(capacity))
