"""Arrays that only pictures of water need, allocated with the first of them."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import qd, threads, upload
from wavetank.simulation.frame import Frame
from wavetank.view.buffers import Buffers
from wavetank.view.extent import Extent
from wavetank.view.lens import vec2, vec3
from wavetank.view.passes.cells import Cells, new_cells
from wavetank.view.quantities import usual
from wavetank.view.shot import Shot


@dataclasses.dataclass(frozen=True, eq=False)
class Ellipsoids:
    """One ellipsoid per particle, in the order of `cells`, and after them room for the mirror image of each."""

    center: qd.types.ndarray()  # vec3 [2 capacity], m
    axes: qd.types.ndarray()  # vec3 [2 capacity], m^2: diagonal of the squared shape matrix
    mixed: qd.types.ndarray()  # vec3 [2 capacity], m^2: its xy, xz, yz
    outward: qd.types.ndarray()  # vec3 [2 capacity]: away from the water, up to about 0.4 long
    size: qd.types.ndarray()  # f32 [2 capacity], m: bound on the radius; negative where nothing is drawn
    edge: qd.types.ndarray()  # i32 [2 capacity]: 1 where its outline may be seen, 0 elsewhere


@dataclasses.dataclass
class WaterBuffers:
    """What the water passes hand to each other."""

    cells: Cells
    ellipsoids: Ellipsoids
    depth: Any  # i32 [rows, columns]: bits of the depth [m] of the water's surface, FARTHEST where there is none
    rim: Any  # i32 [rows, columns]: share 0 to 127 that an outline covers, << 24, | 2^24 - 1 - depth >> 7; or 0
    spare: (
        Any  # i32 [rows, columns]: the same while it is being smoothed, then of the nearest that is seen, water or not
    )
    thickness: Any  # i32 [rows / 2, columns / 2]: water along the view, in 1 / 4096 of a spacing
    sums: Any  # i32 [parts x texels]: the same, of each part of the particles
    dye: Any  # i32 [rows / 2, columns / 2, 4]: the dyed part of it, and that part times linear red, green, blue
    stained: Any  # i32 [1]: 1 where any of it is dyed, else `dye` holds nothing of use
    stains: Any  # i32 [materials]: colour of each fluid as a dye, 0 where the scene has one fluid only
    light: Any  # vec2 [rows / 2, columns / 2]: share of the sun, share of the sky that reaches what is not water
    rough_light: Any  # vec2, likewise: the same while it is being smoothed
    sun_thickness: Any  # i32 [texels, texels]: water along the sun's rays, likewise
    sun_sums: Any  # i32 [parts x texels]: the same, of each part of the particles
    sun_first: Any  # i32 [texels, texels]: bits of the depth [m] at which the sun's rays meet the water
    sun_spare: Any  # i32 [texels, texels]: the same while it is being smoothed
    sun_dye: Any  # i32 [texels, texels, 4]: the dyed part of the water along the sun's rays, as `dye`
    caustic: Any  # i32 [texels, texels]: light that refraction brings or takes, in 1 / 4096 of the sun's
    in_sun: Any  # vec3 [rows, columns]: radiance of what is not water that comes from the sun
    in_sky: Any  # vec3 [rows, columns]: and that comes from elsewhere, both without any water
    behind: Any  # vec3 [rows, columns]: radiance of what is not water
    key: tuple[Any, ...]  # what the sizes were made for


SUN_MAPS = ("sun_thickness", "sun_first", "sun_spare", "caustic")
MOST_PARTS, MOST_SUMS = 8, 1 << 23  # of particles whose discs are added apart; numbers that are kept for that
UNIT = 4096.0  # steps of thickness in a spacing


def sun_texels(extent: Extent) -> int:
    """Edge of the sun's maps of the water: some two texels per spacing, within reason."""
    return max(48, min(1024, int(2.3 * extent.radius * 1.7 / extent.spacing)))


def water_of(buffers: Buffers, shot: Shot) -> WaterBuffers:
    """Return the water buffers of `buffers`, made anew when a frame of another kind comes."""
    from wavetank.view.passes.ellipsoids import REACH

    frame, extent = shot.frame, shot.extent
    capacity = max(int(frame.x.shape[0]), 1)
    stains = _stains(frame)
    place = (*extent.lower, *extent.upper, extent.spacing)
    key = (frame.dim, capacity, frame.scene.tank is None, *stains.tolist(), *place)
    water = buffers.water
    if water is not None and water.key == key:
        return water
    rows, columns = buffers.rows, buffers.columns
    fields: dict[str, Any] = {
        "depth": qd.ndarray(qd.i32, shape=(rows, columns)),
        "rim": qd.ndarray(qd.i32, shape=(rows, columns)),
        "spare": qd.ndarray(qd.i32, shape=(rows, columns)),
        "thickness": qd.ndarray(qd.i32, shape=(rows // 2 + 1, columns // 2 + 1)),
        "sums": _sums(rows // 2 + 1, columns // 2 + 1),
        "dye": qd.ndarray(qd.i32, shape=(rows // 2 + 1, columns // 2 + 1, 4)),
        "light": qd.ndarray(vec2, shape=((rows + 1) // 2, (columns + 1) // 2)),
        "rough_light": qd.ndarray(vec2, shape=((rows + 1) // 2, (columns + 1) // 2)),
        "in_sun": qd.ndarray(vec3, shape=(rows, columns)),
        "in_sky": qd.ndarray(vec3, shape=(rows, columns)),
        "behind": qd.ndarray(vec3, shape=(rows, columns)),
    }
    if water is not None:  # only the particles or the scene changed
        fields = {name: getattr(water, name) for name in fields}
    fields["stained"] = qd.ndarray(qd.i32, shape=(1,))
    fields["stains"] = qd.ndarray(qd.i32, shape=stains.shape)
    upload(fields["stains"], stains)
    texels = sun_texels(extent)
    fields |= {name: qd.ndarray(qd.i32, shape=(texels, texels)) for name in SUN_MAPS}
    fields["sun_dye"] = qd.ndarray(qd.i32, shape=(texels, texels, 4))
    fields["sun_sums"] = _sums(texels, texels)
    buffers.water = WaterBuffers(
        cells=new_cells(frame, extent, REACH * extent.spacing),
        ellipsoids=_ellipsoids(capacity),
        key=key, **fields,
    )  # fmt: skip
    return buffers.water


def _sums(rows: int, columns: int) -> Any:
    """Sums over particles for each thread that adds, as many as may be kept; graphics processors add at once."""
    parts = max(1, min(threads(), MOST_PARTS, MOST_SUMS // (rows * columns)))
    return qd.ndarray(qd.i32, shape=(parts * rows * columns if threads() else 1,))


def _stains(frame: Frame) -> np.ndarray:
    """Colours of the scene's fluids as dyes of full strength, see `state.py`; zeros where it names no material."""
    scene = frame.scene
    if usual(scene) != "material":
        return np.zeros(len(scene.palette()), np.int32)
    return np.array([127 << 24 | int(str(fluid.color)[1:], 16) for fluid in scene.palette()], np.int32)


def _ellipsoids(capacity: int) -> Ellipsoids:
    vectors = {name: qd.ndarray(vec3, shape=(2 * capacity,)) for name in ("center", "axes", "mixed", "outward")}
    size, edge = (qd.ndarray(kind, shape=(2 * capacity,)) for kind in (qd.f32, qd.i32))
    return Ellipsoids(**vectors, size=size, edge=edge)
