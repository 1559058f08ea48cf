"""Pictures of a world: a list of passes over shared buffers."""

import collections
import dataclasses
import functools
import math
import time
from typing import Any

import numpy as np

from wavetank.device.compiler import current_backend, download, qd, synchronize, upload
from wavetank.foundation.errors import WavetankError
from wavetank.simulation.frame import Frame
from wavetank.view import legend as legends
from wavetank.view.buffers import allocate
from wavetank.view.camera import Camera
from wavetank.view.colormaps import ENTRIES, table
from wavetank.view.extent import Extent, extent_of
from wavetank.view.lens import Lens, basis, lens_at, vec3, vector
from wavetank.view.look import Look, fluid_optics, paper, pool, studio, usual_depth
from wavetank.view.passes import tonemap
from wavetank.view.quantities import QUANTITIES, Coloring, usual
from wavetank.view.shot import Shot
from wavetank.view.style import QUALITIES, Style, quality_named
from wavetank.view.views import Pass
from wavetank.view.water_buffers import sun_texels

LARGEST_SIDE, LARGEST_SUPERSAMPLE = 8192, 4
KEPT_RENDERERS, KEPT_SAMPLES = 4, 2**24
POINT_SUN = 0.004  # tangent of the sun's radius where many suns are averaged


class Renderer:
    """Takes pictures of one size; its buffers are allocated once."""

    def __init__(self, width: int, height: int, supersample: int = 1) -> None:
        for name, value, most in (
            ("width", width, LARGEST_SIDE), ("height", height, LARGEST_SIDE),
            ("supersample", supersample, LARGEST_SUPERSAMPLE),
        ):  # fmt: skip
            if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= most:
                raise WavetankError(f"render: {name} = {value!r} must be a whole number from 1 to {most}.")
        if current_backend() is None:
            raise WavetankError("render: nothing computes yet; make a Simulation first, or call compiler.start().")
        self.width, self.height, self.supersample = int(width), int(height), int(supersample)
        self.buffers = allocate(self.width, self.height, self.supersample)
        self._colors = qd.ndarray(vec3, shape=(ENTRIES,))
        self._colors_name = ""
        self._kept: Any = None  # what the still part of the last picture depended on
        self._shadows: Any = None  # what its shadows of solids depended on
        self._water: Any = None  # moment and places of the water in the last picture
        self._shaped: Any = None  # for which buffers its shape was found
        self._sun: Any = None  # for which solids and way to the sun the light in that water was found
        self._lit: Any = None  # the water whose light was found
        self._waits = False  # whether the last picture did without a new one
        self._total: Any = None  # vec3 [rows, columns]: mean of the samples so far

    def render(
        self, frame: Frame, camera: Camera | None = None, *, timings: dict[str, float] | None = None, **options: Any
    ) -> np.ndarray:
        """Return a picture of `frame`, uint8 [height, width, 3].

        `options` are the fields of `Style`; `timings`, a dict, receives the milliseconds of each pass. Raises
        `WavetankError` for what is not allowed.
        """
        style = Style.of(options)
        shot = self.shot(frame, camera, style)
        if not self._rested(style, shot):
            self._run(style.kind.once, shot, timings)
            self._shaped = self.buffers.water
            if not self._sun_waits(style, shot):
                self._sun = None
        elif self._waits:
            self._waits, self._sun = False, None
        if style.samples == 1:
            self._take(style, shot, timings)
            self._run((tonemap.draw,), shot, timings)
        else:
            self._average(style, shot, timings)
        picture = self.buffers.host_picture()
        if style.legend and style.kind.coloured:
            _write_legend(picture, shot, style, self.supersample)
        return picture

    def shot(self, frame: Frame, camera: Camera | None = None, style: Style | None = None) -> Shot:
        """Return what the passes need to know of a picture."""
        style = style or Style()
        extent = extent_of(frame.scene)
        camera = camera or Camera.framing_extent(extent, self.width / self.height)
        look = _look(extent.dim, style.kind.coloured)
        quantity, limits, name, colors = style.coloring(frame)
        if name != self._colors_name:
            upload(self._colors, colors)
            self._colors_name = name
        coloring = Coloring(colors=self._colors, low=limits[0], scale=1.0 / (limits[1] - limits[0]))
        absorption, scattering, tint = fluid_optics(None if style.kind.coloured else style.color_by, extent)
        return Shot(
            frame=frame,
            extent=extent,
            lens=camera.lens(self.buffers.columns, self.buffers.rows),
            sun=_sun_lens(extent, look.to_sun, self.buffers.texels),
            water_sun=_sun_lens(extent, look.to_sun, sun_texels(extent)),
            look=look,
            radius=style.particle_radius(extent),
            quantity=quantity,
            limits=limits,
            coloring=coloring,
            absorption=absorption,
            scattering=scattering,
            tint=tint,
            usual=usual_depth(extent),
            plane=style.plane(extent, frame.scene.tank is not None),
            hasty=style.hasty,
        )

    def _take(self, style: Style, shot: Shot, timings: dict[str, float] | None) -> None:
        """Fill `color`; what does not move is kept from the picture before, and comes out as it would anew."""
        key, shadows = None, None
        if style.kind.still:
            shadows = style.kind.name, *_stands(shot)
            key = *shadows, *_looks(shot), id(self.buffers.water)
        if key is None or key != self._kept:
            if shadows is None or shadows != self._shadows:
                self._run(style.kind.shadows, shot, timings)
            self._run(style.kind.still, shot, timings)
            self._kept = key and (*key[:-1], id(self.buffers.water))
        self._shadows = shadows
        sun = shadows, np.asarray(shot.look.to_sun).tobytes()
        if sun != self._sun:
            self._run(style.kind.sunny, shot, timings)
            self._sun = sun
        self._run(style.kind.passes, shot, timings)

    def _rested(self, style: Style, shot: Shot) -> bool:
        """Say whether the water is where it was in the last picture, as when an eye goes round it.

        Only in the second picture of a moment its places are kept, so that moving water costs nothing here.
        """
        frame, before = shot.frame, self._water
        moment = (style.kind.name, frame.number, frame.time, frame.count)
        if not style.kind.still or before is None or before[0] != moment:
            self._water = moment, None
            return False
        arrays = [download(array)[: frame.count] for array in (frame.x, frame.id)]
        same = before[1] is not None and all(map(np.array_equal, before[1], arrays))
        if same and self._shaped is self.buffers.water:
            return True
        self._water = moment, [array.copy() for array in arrays]
        return False

    def _sun_waits(self, style: Style, shot: Shot) -> bool:
        """Say whether moving water may lie in the light of the picture before: every second time, in haste."""
        water = (style.kind.name, shot.frame.dim, id(self.buffers.water))
        self._waits = style.hasty and self._lit == water and not self._waits
        self._lit = water
        return self._waits

    def _run(self, passes: tuple[Pass, ...], shot: Shot, timings: dict[str, float] | None) -> None:
        for draw in passes:
            began = time.perf_counter()
            draw(shot, self.buffers)
            if timings is not None:
                synchronize()
                name = draw.__module__.rpartition(".")[2]
                timings[name] = timings.get(name, 0.0) + 1e3 * (time.perf_counter() - began)

    def _average(self, style: Style, shot: Shot, timings: dict[str, float] | None) -> None:
        """Take many pictures, each moved by less than a pixel and lit by another point of the sun, and average them."""
        if self._total is None:
            self._total = qd.ndarray(vec3, shape=(self.buffers.rows, self.buffers.columns))
        for number in range(style.samples):
            self._take(style, self._moved(shot, number), timings)
            tonemap.collect(self.buffers.pixels.color, self._total, 1.0 / (number + 1))
        tonemap.draw_collected(self._total, self.buffers)

    def _moved(self, shot: Shot, number: int) -> Shot:
        """Return the shot of one sample: low-discrepancy points in a pixel and on the sun."""
        across, down, angle, reach = (_radical_inverse(number + 1, prime) for prime in (2, 3, 5, 7))
        axes = basis(-shot.look.to_sun, np.array([0.0, 0.0, -1.0]))
        wide, turn = shot.look.sun_size * math.sqrt(reach), 2.0 * math.pi * angle
        to_sun = shot.look.to_sun + wide * (math.cos(turn) * axes[0] + math.sin(turn) * axes[1])
        to_sun = vector(*(to_sun / np.linalg.norm(to_sun)))
        return dataclasses.replace(
            shot,
            lens=dataclasses.replace(shot.lens, middle=shot.lens.middle + vector(across - 0.5, down - 0.5)),
            sun=_sun_lens(shot.extent, to_sun, self.buffers.texels),
            water_sun=_sun_lens(shot.extent, to_sun, sun_texels(shot.extent)),
            look=dataclasses.replace(shot.look, to_sun=to_sun, sun_size=min(POINT_SUN, shot.look.sun_size)),
        )


def _bytes(numbers: list[Any]) -> tuple[bytes, ...]:
    return tuple(np.asarray(number).tobytes() for number in numbers)


def _looks(shot: Shot) -> tuple[Any, ...]:
    """Return all of eye and style that what is not water depends on, to be compared with another picture's."""
    return _bytes(
        [*(getattr(shot.lens, f.name) for f in dataclasses.fields(shot.lens)), shot.look.sun_size, shot.radius]
    )


def _stands(shot: Shot) -> tuple[Any, ...]:
    """Return all that the shadows of solids in the sun's view depend on, likewise."""
    numbers = [getattr(shot.sun, field.name) for field in dataclasses.fields(shot.sun)]
    numbers += [shot.look.to_sun, shot.extent.lower, shot.extent.upper]
    solids = shot.frame.solids
    if solids.count > solids.tank_count:
        arrays = (solids.op, solids.size, solids.offset, solids.turn, solids.first, solids.reach, solids.position)
        numbers += [download(array) for array in (*arrays, solids.rotation)]
    return shot.frame.dim, solids.count, *_bytes(numbers)


def _radical_inverse(number: int, prime: int) -> float:
    """Halton's sequence: the digits of `number` in a base, mirrored at the point."""
    value, share = 0.0, 1.0
    while number:
        share /= prime
        number, digit = divmod(number, prime)
        value += share * digit
    return value


def _write_legend(picture: np.ndarray, shot: Shot, style: Style, supersample: int) -> None:
    column, color_by = 0, style.color_by or usual(shot.frame.scene)
    if color_by in QUANTITIES and QUANTITIES[color_by].palette and not style.colormap:
        column = legends.draw_keys(picture, shot.frame.fluids_present)
    elif color_by in QUANTITIES:
        quantity = QUANTITIES[color_by]
        colors = table(style.colormap or quantity.colormap)
        column = legends.draw_bar(picture, colors, shot.limits, f"{quantity.title or color_by} [{quantity.unit}]")
    legends.write_time(picture, shot.frame.time, shot.frame.count, column)
    if shot.lens.perspective == 0.0:
        legends.draw_scale(picture, shot.lens.focal / supersample)


@functools.cache
def _look(dim: int, coloured: bool) -> Look:
    if dim == 2:
        return paper()
    return studio() if coloured else pool()


def _sun_lens(extent: Extent, to_sun: Any, texels: int) -> Lens:
    """An orthographic view of the extent from the sun, with room for what splashes out of it."""
    axes = basis(-to_sun, np.array([0.0, 0.0, -1.0]))
    reach = 1.15 * extent.radius
    eye = extent.middle - 10.0 * reach * axes[2]
    return lens_at(eye, axes, texels, texels, 0.5 * texels / reach, perspective=False, near=1e-6)


_kept: collections.OrderedDict[tuple[int, int, int], Renderer] = collections.OrderedDict()


def render(
    world: Any, width: int = 1280, height: int = 720, *, quality: str | None = None, supersample: int | None = None,
    **options: Any,
) -> np.ndarray:  # fmt: skip
    """Return a picture of a `Frame` or a `Simulation`, uint8 [height, width, 3].

    `options` are those of `Renderer.render`: a view by name, a camera and the fields of `Style`. `quality` is draft,
    standard or film. Without either `supersample` is 2, or 1 for pictures of more than 16 million pixels. Renderers of
    the last few sizes are kept.
    """
    if quality is not None:
        samples = QUALITIES[quality_named(quality)]
        supersample, options = supersample or samples[0], {"samples": samples[1], **options}
    # Neighbours are searched for only where densities are seen.
    frame = world.frame(measured=options.get("color_by") == "density") if hasattr(world, "frame") else world
    if not (hasattr(frame, "scene") and hasattr(frame, "x")):
        raise WavetankError(f"render: a {type(world).__name__} cannot be drawn; give a simulation or a frame.")
    if supersample is None:
        supersample = affordable(width, height, 2)
    key = (width, height, supersample)
    renderer = _kept.pop(key, None)
    # Large ones go first, so that two of them are never alive at once.
    while _kept and (len(_kept) >= KEPT_RENDERERS or sum(_samples(k) for k in (*_kept, key)) > KEPT_SAMPLES):
        _kept.popitem(last=False)
    renderer = renderer or Renderer(width, height, supersample)
    _kept[key] = renderer
    return renderer.render(frame, **options)


def affordable(width: Any, height: Any, supersample: int) -> int:
    """Return `supersample`, or 1 where the picture alone has more than 16 million pixels (some 3 GB of arrays)."""
    sizes = isinstance(width, int | np.integer) and isinstance(height, int | np.integer)
    return supersample if sizes and width * height <= KEPT_SAMPLES else 1


def _samples(key: tuple[int, int, int]) -> int:
    return key[0] * key[1] * key[2] ** 2
