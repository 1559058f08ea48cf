"""Arrays that only pictures of water need, allocated with the first of them."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, lanes, qd, shares_memory, threads, upload
from wavetank.simulation.frame import Frame
from wavetank.view.buffers import Buffers, Light, new_light
from wavetank.view.cells import Cells, new_cells
from wavetank.view.extent import Extent
from wavetank.view.lens import vec3, vec4
from wavetank.view.matter import matter_of
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
    lone: qd.types.ndarray()  # i32 [2 capacity]: 1 where it is a drop of its own, 0 elsewhere


@dataclasses.dataclass(frozen=True, eq=False)
class Drops:
    """What is known of particles that are drops of their own, on the device; all but `lone` in device order."""

    lone: qd.types.ndarray()  # i32 [capacity], in the order of `cells`: 1 for a drop
    v: qd.types.ndarray()  # vec3 [capacity], m/s
    id: qd.types.ndarray()  # i32 [capacity]
    dye: qd.types.ndarray()  # i32 [capacity]
    material: qd.types.ndarray()  # i32 [capacity]
    fluids: qd.i32  # as in `Thickness`
    matter: qd.types.ndarray()
    shine: qd.types.ndarray()


@dataclasses.dataclass(frozen=True, eq=False)
class WaterSurface:
    """The surface of the water as the eye sees it, [rows, columns], on the device."""

    depth: qd.types.ndarray()  # i32: bits of the depth [m], FARTHEST where there is none
    rim: qd.types.ndarray()  # i32: marks of its outlines, see `optics/edge_coverage.py`; or 0
    nearest: qd.types.ndarray()  # i32: bits of the depth [m] of what is seen, water or not; scratch before


@dataclasses.dataclass(frozen=True, eq=False)
class SunlitWater:
    """The surface of the water as the sun sees it, [texels, texels], on the device."""

    depth: qd.types.ndarray()  # i32: bits of the depth [m] at which the sun's rays meet the water
    spare: qd.types.ndarray()  # i32: the same while it is being smoothed; then optical depth of foam in 1 / 4096
    wet: (
        qd.types.ndarray()
    )  # i32 [CELLS, CELLS]: 1 where water or caustics are in or beside a cell, see `optics/dry_mask.py`
    caustic: qd.types.ndarray()  # i32: light that refraction brings or takes, and foam keeps, in 1 / 4096 of the sun's


@dataclasses.dataclass(frozen=True, eq=False)
class Thickness:
    """Water along the rays of the eye or of the sun, in 1 / 4096 of a spacing, on the device."""

    water: qd.types.ndarray()  # i32 [rows, columns]
    sums: qd.types.ndarray()  # i32 [parts x texels]: the same, of each part of the particles
    dye: qd.types.ndarray()  # i32 [rows, columns, 4]: the dyed part of it, and that part times linear red, green, blue
    stained: qd.types.ndarray()  # i32 [1]: 1 where any of it is dyed, else `dye` holds nothing of use
    shares: qd.types.ndarray()  # i32 [rows, columns, fluids]: what of it is of each fluid, where there are several
    front: qd.types.ndarray()  # i32 [rows, columns, fluids]: the same of what lies in front, on texels of its own
    edge: qd.types.ndarray()  # f32 [rows, columns], m: depth at which the water begins, on these
    fluids: qd.i32  # how many there are; 0 where all water is the same
    matter: qd.types.ndarray()  # vec4 [fluids]: linear colour, negative for that of the picture; murk [1/m]
    shine: qd.types.ndarray()  # vec3 [fluids]: radiance of its own


@dataclasses.dataclass(frozen=True, eq=False)
class Backdrop:
    """Radiance of what is not water, vec3 [rows, columns], on the device."""

    in_sun: qd.types.ndarray()  # what comes from the sun
    in_sky: qd.types.ndarray()  # and what comes from elsewhere, both without any water
    behind: qd.types.ndarray()  # both as far as the water lets them through
    known: qd.types.ndarray()  # i32 [rows, columns] of what comes together: what `optics/dry_mask.py` knows of it, or 0


@dataclasses.dataclass(eq=False)
class WaterBuffers:
    """What the water passes hand to each other."""

    cells: Cells
    ellipsoids: Ellipsoids
    surface: WaterSurface
    thickness: Thickness  # on every second pixel in each direction, or less
    backdrop: Backdrop
    light: Light  # on every second pixel in each direction of what is not water
    sunlit: SunlitWater
    sun_thickness: Thickness
    key: tuple[Any, ...]  # what the sizes were made for

    known: dict[tuple[int, ...], Any] = dataclasses.field(default_factory=dict)  # by what it is made of

    def same(self, kind: Any, *parts: Any) -> Any:
        """Return a dataclass of these objects, the same one for the same objects."""
        key = (id(kind), *map(id, parts))
        if key not in self.known:
            if len(self.known) >= MOST_KNOWN:
                self.known.clear()
            self.known[key] = kind(*parts)
        return self.known[key]

    def may_have_drops(self, count: int) -> bool:
        """Whether any of `count` particles may be a drop: True where the host would wait for the device to know."""
        return not shares_memory() or bool(download(self.ellipsoids.lone)[:count].any())

    def drops(self, frame: Frame) -> Drops:
        """Return what is known of a frame's drops, the same object for the same arrays."""
        arrays, fluids = (self.ellipsoids.lone, frame.v, frame.id, frame.dye, frame.material), self.thickness
        key = (*map(id, arrays), id(fluids))
        if key not in self.known:
            if len(self.known) >= MOST_KNOWN:
                self.known.clear()
            self.known[key] = Drops(*arrays, fluids.fluids, fluids.matter, fluids.shine)
        drops: Drops = self.known[key]
        return drops


REACH = 2.2  # d: radius of the neighbourhood of a particle or a point
LIGHT_STEP = 2  # floor and solids are smooth
MOST_PARTS, MOST_SUMS = 8, 1 << 23  # of particles whose discs are added apart; numbers that are kept for that
MOST_KNOWN = 16  # sets of a simulation's arrays, which take turns
CELLS = 127  # of the sun's view of the water to a side, for which it is known whether they are dry
UNIT = 4096.0  # steps of thickness in a spacing


def sun_texels(extent: Extent) -> int:
    """Edge of the sun's maps of the water: some two texels per spacing, within reason."""
    return max(48, min(1024, int(2.3 * extent.radius * 1.7 / extent.spacing)))


def water_of(buffers: Buffers, shot: Shot) -> WaterBuffers:
    """Return the water buffers of `buffers`, made anew when a frame of another kind comes."""
    frame, extent = shot.frame, shot.extent
    capacity = max(int(frame.x.shape[0]), 1)
    fluids = matter_of(frame, extent)
    place = (*extent.lower, *extent.upper, extent.spacing)
    key = (frame.dim, capacity, frame.scene.tank is None, fluids.tobytes(), *place)
    water = buffers.water
    if water is not None and water.key == key:
        return water
    rows, columns, texels = buffers.rows, buffers.columns, sun_texels(extent)
    shared = _fluids(fluids)
    if water is not None:  # only the particles or the scene changed
        fields: dict[str, Any] = {name: getattr(water, name) for name in ("surface", "backdrop", "light")}
        mine = _shares(rows // 2 + 1, columns // 2 + 1, len(fluids), seen=True)
        fields["thickness"] = dataclasses.replace(water.thickness, **shared, **mine)
    else:
        fields = {
            "surface": WaterSurface(*_maps(3, qd.i32, rows, columns)),
            "backdrop": _backdrop(rows, columns, buffers.supersample),
            "light": new_light(rows, columns, LIGHT_STEP),
            "thickness": _thickness(rows // 2 + 1, columns // 2 + 1, shared, seen=True),
        }
    buffers.water = WaterBuffers(
        cells=new_cells(frame, extent, REACH * extent.spacing),
        ellipsoids=_ellipsoids(capacity),
        sunlit=_sunlit(texels),
        sun_thickness=_thickness(texels, texels, shared, seen=False),
        key=key,
        **fields,
    )
    return buffers.water


def _maps(number: int, kind: Any, rows: int, columns: int) -> list[Any]:
    return [qd.ndarray(kind, shape=(rows, columns)) for _ in range(number)]


def _backdrop(rows: int, columns: int, samples: int) -> Backdrop:
    """Allocate the backdrop; where pixels come one by one nothing is known of them."""
    shape = (rows // samples, max(columns // (samples * lanes()), 1)) if lanes() > 1 else (1, 1)
    in_sun, in_sky, behind = _maps(3, vec3, rows, columns)
    return Backdrop(in_sun=in_sun, in_sky=in_sky, behind=behind, known=qd.ndarray(qd.i32, shape=shape))


def _sunlit(texels: int) -> SunlitWater:
    depth, spare, caustic = _maps(3, qd.i32, texels, texels)
    return SunlitWater(depth=depth, spare=spare, wet=qd.ndarray(qd.i32, shape=(CELLS, CELLS)), caustic=caustic)


def _thickness(rows: int, columns: int, shared: dict[str, Any], seen: bool) -> Thickness:
    """Allocate maps of thickness, for the eye that has `seen` it, or for the sun.

    There are sums over particles for each thread that adds, as many as may be kept; graphics processors add at once.
    """
    parts = max(1, min(threads(), MOST_PARTS, MOST_SUMS // (rows * columns)))
    sums = qd.ndarray(qd.i32, shape=(parts * rows * columns if threads() else 1,))
    water, dye = (qd.ndarray(qd.i32, shape=(rows, columns, *more)) for more in ((), (4,)))
    return Thickness(water=water, sums=sums, dye=dye, **shared, **_shares(rows, columns, shared["fluids"], seen=seen))


def _shares(rows: int, columns: int, fluids: int, seen: bool) -> dict[str, Any]:
    """Allocate what tells several fluids apart; a texel where there is one."""
    small = (1, 1)
    shape, front = (rows, columns) if fluids else small, (rows, columns) if fluids and seen else small
    many = max(fluids, 1)
    return {
        "shares": qd.ndarray(qd.i32, shape=(*shape, many)),
        "front": qd.ndarray(qd.i32, shape=(*front, many)),
        "edge": qd.ndarray(qd.f32, shape=front),
    }


def _fluids(fluids: np.ndarray) -> dict[str, Any]:
    """Put the table of `matter_of` on the device."""
    many = max(len(fluids), 1)
    matter, shine = qd.ndarray(vec4, shape=(many,)), qd.ndarray(vec3, shape=(many,))
    if len(fluids):
        upload(matter, np.ascontiguousarray(fluids[:, :4]))
        upload(shine, np.ascontiguousarray(fluids[:, 4:]))
    stained = qd.ndarray(qd.i32, shape=(1,))
    return {"stained": stained, "fluids": len(fluids), "matter": matter, "shine": shine}


def _ellipsoids(capacity: int) -> Ellipsoids:
    vectors = {name: qd.ndarray(vec3, shape=(2 * capacity,)) for name in ("center", "axes", "mixed", "outward")}
    size, edge, lone = (qd.ndarray(kind, shape=(2 * capacity,)) for kind in (qd.f32, qd.i32, qd.i32))
    return Ellipsoids(**vectors, size=size, edge=edge, lone=lone)
