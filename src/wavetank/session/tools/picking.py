"""The first hit of a pointer's ray: the water's surface, a solid, or the inside of the tank.

    code     symbol   meaning                                            unit
    origin   o        start of the ray                                   m
    way      w        its unit direction                                 1
    t                 distance along it                                  m
    reach             radius of a particle for picking            m

Solids by sphere tracing (Hart 1996, 10.1007/s003710050084). A positive float orders like its bits, so the nearest
particle is an integer minimum and does not depend on threads.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd
from wavetank.device.state import scalars
from wavetank.simulation.simulation import Simulation
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3
from wavetank.view.extent import Extent, extent_of

FARTHEST = 0x7F000000
REACH = 0.75  # d: balls of this radius close the surface


@dataclasses.dataclass(frozen=True)
class Hit:
    """Where a ray ends."""

    kind: str  # water, solid, tank or air
    point: np.ndarray  # m, [3]
    name: str = ""  # of the solid


@qd.kernel(fastcache=True)
def nearest_particle(
    x: qd.types.ndarray(), count: qd.i32, origin: vec3, way: vec3, reach: qd.f32, farthest: qd.i32
) -> qd.i32:
    """Return the bits of the distance along the ray to the first ball around a particle."""
    nearest = farthest
    for i in range(count):
        to = lift(x[i]) - origin
        ahead = to.dot(way)
        off = (to - way * ahead).norm_sqr()
        if off < reach * reach and ahead > 0.0:
            t = qd.max(ahead - qd.sqrt(reach * reach - off), 0.0)
            qd.atomic_min(nearest, qd.bit_cast(t, qd.i32))
    return nearest


@qd.kernel(fastcache=True)
def trace_solids(distances: qd.types.ndarray(), solids: SolidSet, origin: vec3, way: vec3, far: qd.f32, near: qd.f32):
    """Write for every solid but the tank's walls how far along the ray it is met, or a negative number."""
    for k in range(solids.tank_count, solids.count):
        t = 0.0
        met = -1.0
        for _ in range(200):
            if met < 0.0 and t < far:
                s = signed_distance(solids, k, origin + t * way).w
                if s < near:
                    met = t
                t += qd.max(s, 0.5 * near)
        distances[k] = met


def pick(sim: Simulation, origin: np.ndarray, way: np.ndarray, through_water: bool = False) -> Hit:
    """Return the first hit of the ray from `origin` [m] along the unit vector `way`.

    In a 2-D world that is the point in its plane. A ray that hits nothing ends inside the tank's far side, and one that
    misses the tank at its point next to the middle. With `through_water` only solids are hit.
    """
    extent = extent_of(sim.scene)
    if sim.scene.dim == 2:
        origin, way = _above_plane(origin, way)
    end, kind = exit_point(extent, origin, way)
    nearest = float(np.linalg.norm(end - origin)) if sim.scene.dim == 3 else np.inf
    name = ""
    start, heading = origin.astype(np.float32), way.astype(np.float32)
    if sim.count and not through_water:
        bits = nearest_particle(sim.world.particles.x, sim.count, start, heading, REACH * sim.scene.spacing, FARTHEST)
        t = float(np.int32(bits).view(np.float32))
        if bits < FARTHEST and t < nearest:
            nearest, kind = t, "water"
    if sim.world.solids.count > sim.world.solids.tank_count:
        distances = scalars(sim.world.solids.count)
        far = 4.0 * extent.radius + float(np.linalg.norm(origin - extent.middle))
        trace_solids(distances, sim.world.solids, start, heading, far, 0.02 * sim.scene.spacing)
        found = download(distances)
        for number in range(sim.world.solids.tank_count, sim.world.solids.count):
            if 0.0 <= found[number] < nearest + 1e-9:
                nearest, kind, name = float(found[number]), "solid", sim.solids.names[number]
    if sim.scene.dim == 2:
        return Hit(kind, _in_plane(origin, way), name)
    return Hit(kind, end if kind in ("tank", "air") else origin + nearest * way, name)


def exit_point(extent: Extent, origin: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, str]:
    """Return where the ray leaves the box of the world, or passes its middle if it misses it, and what is there."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (extent.lower - origin) / way, (extent.upper - origin) / way
    a, b = np.nan_to_num(a, nan=-np.inf), np.nan_to_num(b, nan=np.inf)
    enter, leave = np.minimum(a, b).max(), np.maximum(a, b).min()
    if extent.dim == 2:
        return origin, "tank"
    if leave > max(enter, 0.0):
        return origin + leave * way, "tank"
    return origin + max(0.0, float((extent.middle - origin) @ way)) * way, "air"


def intersect_plane(origin: np.ndarray, way: np.ndarray, point: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """Return where the ray meets the plane through `point`, or None if it runs along it or away from it."""
    slope = float(way @ normal)
    if abs(slope) < 1e-6:
        return None
    t = float((point - origin) @ normal) / slope
    return origin + t * way if 0.0 <= t < 1e6 else None


def _in_plane(origin: np.ndarray, way: np.ndarray) -> np.ndarray:
    point = intersect_plane(origin, way, np.zeros(3), np.array([0.0, 0.0, 1.0]))
    return np.array([origin[0], origin[1], 0.0]) if point is None else point * [1.0, 1.0, 0.0]


def _above_plane(origin: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return a ray perpendicular to the plane, from just above the point where the given ray hits it."""
    place: Any = _in_plane(origin, way)
    return place + [0.0, 0.0, 1e-3], np.array([0.0, 0.0, -1.0])
