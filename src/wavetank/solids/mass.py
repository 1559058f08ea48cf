"""Volume, mass, centre of mass and inertia of solids and of the water they displace, by quadrature.

Every solid is cut into equal cells of the box around it; a cell that its surface crosses counts by the share that a
plane at the signed distance of its centre leaves. A box is exact, a ball has an error of a thousandth.
"""

import dataclasses
import math

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.device.state import scalars, vectors
from wavetank.foundation.errors import WavetankError
from wavetank.solids.build import build
from wavetank.solids.distance import SolidSet, local_distance
from wavetank.solids.shapes import Box, Sphere
from wavetank.solids.solid import Solid

SEARCH = 48  # boxes along an axis in which the extent is looked for
PIECES = 200_000  # about, of a quadrature
LEAST = 4  # boxes along an axis
FINEST = 0.25  # of a spacing: longer boxes are halved where a solid is no thicker than two of them
SEEN = 3  # boxes from which the middle of a solid is looked for
MOST_PIECES = 4_000_000  # of a solid: half a gigabyte while they are measured


@qd.kernel(fastcache=True)
def find_distances(values: qd.types.ndarray(), places: qd.types.ndarray(), solids: SolidSet, count: qd.i32):
    """Write the signed distances [m] of solid 0 at places in its frame."""
    for i in range(count):
        values[i] = local_distance(solids, 0, places[i]).w


@dataclasses.dataclass(frozen=True)
class Cut:
    """A solid in pieces, in its own frame; in a 2-D world pieces of its section, a metre long."""

    places: np.ndarray  # [n, 3], m: centres
    volumes: np.ndarray  # [n], m^3: what of each is inside
    shells: np.ndarray  # [n]: how near to the surface each is, 1 at it, 0 half a box away
    edges: np.ndarray  # [3], m: of a box; 0 along z in 2-D
    depths: np.ndarray  # [n], m: of the centres below the surface, less than 0 outside


@dataclasses.dataclass(frozen=True)
class Inertia:
    """Mass properties of a solid."""

    mass: float  # kg
    center: np.ndarray  # [3], m, in the frame of the solid
    tensor: np.ndarray  # [3, 3], kg m^2, about the centre
    axes: np.ndarray  # [3], m: semi-axes of the ellipsoid with the same tensor per mass


class Ruler:
    """Measures one solid by its signed distances."""

    def __init__(self, solid: Solid, dim: int, spacing: float) -> None:
        self.solid, self.dim, self.spacing = solid, dim, spacing
        self.device = build([solid.model_copy(update={"name": ""})], 0, 0.0, spacing)

    def distances(self, places: np.ndarray) -> np.ndarray:
        """Return the signed distances [n] of places [n, 3] in the solid's frame, m."""
        device, values = vectors(3, len(places)), scalars(len(places))
        upload(device, places)
        find_distances(values, device, self.device, len(places))
        return download(values)[: len(places)].astype(float)

    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of a box around the solid, m, in its frame."""
        reach = 1.001 * self.solid.reach()
        lower, upper = np.full(3, -reach), np.full(3, reach)
        if self.dim == 2:
            lower[2] = upper[2] = 0.0
        for _ in range(2):  # thin parts are found in the second pass
            edges = (upper - lower) / SEARCH
            places = _centers(lower, upper, np.where(edges > 0.0, SEARCH, 1))
            near = places[self.distances(places) < 0.5 * float(np.linalg.norm(edges))]
            if not len(near):
                raise WavetankError(f"solid {self.solid.name or type(self.solid).__name__!r} has no inside.")
            lower, upper = near.min(axis=0) - 0.5 * edges, near.max(axis=0) + 0.5 * edges
        return lower, upper

    def cut(self, edge: float | None = None) -> Cut:
        """Cut the solid into boxes of about `edge` [m]; fine ones where None."""
        lower, upper = self._tight()
        size = upper - lower
        used = size[: self.dim]
        edge = edge or float((np.prod(used) / PIECES) ** (1.0 / self.dim))
        numbers = np.ones(3, int)
        wanted = math.prod(max(float(length / edge), 1.0) for length in used)
        if not wanted <= MOST_PIECES:
            sizes = " x ".join(f"{length:.3g}" for length in used)
            raise WavetankError(
                f"the body {self.solid.name or type(self.solid).__name__!r} of {sizes} m is {wanted:.2g} pieces of "
                f"{edge:.3g} m; at most {MOST_PIECES:,} are allowed: make it smaller or use a larger spacing."
            )
        numbers[: self.dim] = np.maximum(np.ceil(used / edge - 1e-6), LEAST)
        edges = np.where(np.arange(3) < self.dim, size / numbers, 0.0)
        return self._kept(_centers(lower, upper, numbers), edges)

    def cut_for_surface(self, edge: float) -> Cut:
        """Cut the solid into boxes of about `edge` [m], or halved until they are half as large as it is thick.

        The differences of the volumes of boxes that share a face are then areas of the surface, in sheets too. They are
        halved while they are longer than `FINEST` spacings.
        """
        cut, least = self.cut(edge), FINEST * self.spacing
        while float(cut.edges[: self.dim].min()) > least and thickness(cut) < 2.0 * float(cut.edges.max()):
            cut = self._halved(cut)
        return cut

    def _halved(self, cut: Cut) -> Cut:
        """Return a cut with boxes of half the edges."""
        edges, pieces = 0.5 * cut.edges, []
        for k in range(2**self.dim):
            way = edges * (np.array([k >> axis & 1 for axis in range(3)]) - 0.5)
            pieces.append(cut.places + np.where(edges > 0.0, way, 0.0))
        return self._kept(np.concatenate(pieces), edges)

    def _kept(self, places: np.ndarray, edges: np.ndarray) -> Cut:
        """Return those of the boxes at these places that are inside in part, or near to the surface."""
        distance, width = self.distances(places), float(edges[: self.dim].min())
        inside = np.clip(0.5 - distance / width, 0.0, 1.0)
        shells = np.clip(1.0 - np.abs(distance) / width, 0.0, 1.0)
        kept = (inside > 0.0) | (shells > 0.0)
        volumes = inside[kept] * float(np.prod(edges[: self.dim]))
        return Cut(places[kept], volumes, shells[kept], edges, -distance[kept])

    def _tight(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the corners of the box around the solid; of one that has its axes, exactly."""
        if not isinstance(self.solid, Box | Sphere):
            return self.extent()
        half = np.array([*self.solid.size, 0.0][:3]) / 2.0 if isinstance(self.solid, Box) else self.solid.radius
        corner = half * np.array([1.0, 1.0, float(self.dim == 3)])
        return -corner, corner


def lattice_of(places: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the whole coordinates [n, 3] of boxes with these centres [n, 3] and edges [3], from 1 on."""
    found: np.ndarray = np.round((places - places.min(axis=0)) / np.where(edges > 0.0, edges, 1.0)).astype(int) + 1
    return found


def thickness(cut: Cut) -> float:
    """Return how thick [m] the thinnest tenth of a solid is: twice the depth of its middle, if that is near."""
    place = lattice_of(cut.places, cut.edges) + SEEN
    depths = np.full(place.max(axis=0) + 1 + SEEN, -np.inf)
    depths[tuple(place.T)] = cut.depths
    for _ in range(SEEN):
        for axis in range(3):
            ahead, behind = (np.roll(depths, side, axis) for side in (1, -1))  # the rim is empty
            depths = np.maximum(depths, np.maximum(ahead, behind))
    return 2.0 * float(np.quantile(depths[tuple(place[cut.volumes > 0.0].T)], 0.1))


def inertia_of(solid: Solid, cut: Cut) -> Inertia:
    """Return the mass properties of a body."""
    weights = cut.shells if solid.hollow else cut.volumes
    volume = float(cut.volumes.sum())
    mass = solid.mass if solid.mass is not None else (solid.density or 0.0) * volume
    return _spread(cut.places, weights / weights.sum() * mass, cut.edges, mass)


def water_of(cut: Cut, density: float) -> Inertia:
    """Return the mass properties of the displaced water, `density` [kg/m^3]."""
    weights = density * cut.volumes
    return _spread(cut.places, weights, cut.edges, float(weights.sum()))


def _spread(places: np.ndarray, masses: np.ndarray, edges: np.ndarray, mass: float) -> Inertia:
    # Sums in NumPy's own order: those of a matrix product depend on how many threads its library has.
    center = np.sum(masses[:, None] * places, axis=0) / mass
    r = places - center
    second = np.sum(masses[:, None, None] * r[:, :, None] * r[:, None, :], axis=0)
    second += np.diag(mass * edges**2 / 12.0)  # of the boxes about their own centres
    tensor = np.trace(second) * np.eye(3) - second
    planar = edges[2] == 0.0
    per_mass = np.sqrt(np.maximum(np.linalg.eigvalsh(second) / mass, 0.0))
    return Inertia(mass, center, tensor, per_mass * (2.0 if planar else np.sqrt(5.0)))


def _centers(lower: np.ndarray, upper: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    axes = [a + (b - a) * (np.arange(n) + 0.5) / n for a, b, n in zip(lower, upper, numbers, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
