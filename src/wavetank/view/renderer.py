"""Pictures of a world: a list of passes over shared buffers."""

import collections
import dataclasses
import inspect
import math
import time
from collections.abc import Sequence
from typing import Any, TypedDict, Unpack

import numpy as np

from wavetank.device.compiler import current_backend, download, qd, synchronize, upload
from wavetank.device.state import interned
from wavetank.device.turns import TURN, one_at_a_time
from wavetank.foundation.arguments import instance_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import check_free
from wavetank.simulation.frame import Frame
from wavetank.view import legend as legends
from wavetank.view.buffers import allocate
from wavetank.view.camera import ROOM, Camera
from wavetank.view.colormaps import ENTRIES, table
from wavetank.view.extent import Extent, extent_of
from wavetank.view.film.samples import Watch
from wavetank.view.film.tracer import Tracer
from wavetank.view.glare import add_glare, excess_of
from wavetank.view.images import Images
from wavetank.view.lens import Lens, basis, lens_at, vec3, vector
from wavetank.view.look import fluid_optics, usual_depth
from wavetank.view.matter import may_be_dyed
from wavetank.view.optics.dyes import ICE, write_ice
from wavetank.view.optics.ray_interpolation import GROUP
from wavetank.view.passes import tonemap
from wavetank.view.quantities import QUANTITIES, Coloring, usual
from wavetank.view.rounding import Rounding
from wavetank.view.shot import Shot
from wavetank.view.stages import Stages, Sunlight, eye_and_style, sun_and_solids
from wavetank.view.style import Style, quality_options
from wavetank.view.upright import Upright
from wavetank.view.views import Pass, View
from wavetank.view.water_buffers import sun_texels, water_of

LARGEST_SIDE, LARGEST_SUPERSAMPLE = 8192, 4
PER_SAMPLE = 125.0  # bytes of all buffers of a picture, and of what is made of them
KEPT_RENDERERS, KEPT_SAMPLES = 4, 2**24
Timings = dict[str, float] | None  # milliseconds of each pass, added up
POINT_SUN = 0.004  # tangent of the sun's radius where many suns are averaged


@one_at_a_time()
class Renderer:
    """Takes pictures of one size; its buffers are allocated once."""

    def __init__(self, width: int, height: int, supersample: int = 1) -> None:
        check_size(width, height, supersample)
        if current_backend() is None:
            raise WavetankError("render: nothing computes yet; make a Simulation first, or call compiler.start().")
        self.width, self.height, self.supersample = int(width), int(height), int(supersample)
        self.buffers = allocate(self.width, self.height, self.supersample)
        self._colors = qd.ndarray(vec3, shape=(ENTRIES,))
        self._colors_name = ""
        self._stages = Stages()
        self._seen: Any = None  # i32 [capacity]: dyes or materials as they are seen where there is ice
        self._total: Any = None  # vec3 [rows, columns]: mean of the samples so far
        self._tracer: Tracer | None = None
        self._images = Images()
        self._upright = Upright()
        self._rounding = Rounding()

    def render(
        self,
        frame: Frame,
        camera: Camera | None = None,
        *,
        timings: Timings = None,
        watch: Watch | None = None,
        **options: Any,
    ) -> np.ndarray:
        """Return a picture of `frame`, uint8 [height, width, 3].

        `options` are the fields of `Style`; `timings`, a dict, receives the milliseconds of each pass. `watch` is told
        how far a traced picture is, and can stop it. Raises `WavetankError` for what is not allowed.
        """
        style = Style.of(options)
        if camera is not None:
            instance_of("render: camera", camera, Camera, "a wt.Camera(eye=..., target=...), or eye and target alone")
        shot = self.shot(frame, camera, style)
        if style.traced and style.kind.name == "water" and frame.dim == 3:
            began = time.perf_counter()
            self._tracer = self._tracer or Tracer(self.buffers)
            self._tracer.draw(shot, style, watch or Watch())
            if style.glare:
                add_glare(self.buffers.pixels.color, excess_of(download(self.buffers.pixels.color)), shot.lens)
            tonemap.draw(shot, self.buffers)
            if timings is not None:
                timings["film"] = 1e3 * (time.perf_counter() - began)
            return self.buffers.host_picture()
        lit = self._begin(style, shot, timings)
        if style.samples == 1:
            self._take(style.kind, shot, lit, timings)
            self._run((tonemap.draw,), shot, timings)
        else:
            self._average(style, shot, lit, timings)
        picture = self.buffers.host_picture()
        if style.legend and style.kind.coloured:
            _write_legend(picture, shot, style, self.supersample)
        return picture

    def shot(self, frame: Frame, camera: Camera | None = None, style: Style | None = None) -> Shot:
        """Return what the passes need to know of a picture."""
        style = style or Style()
        turn = frame.scene.upright
        normal, offset = style.plane(extent_of(frame.scene), frame.scene.tank is not None)
        if camera is not None:
            camera = camera.in_world(frame.scene).turned(turn) if frame.scene.upward != "y" else camera
        frame = self._upright.frame(frame)
        frame = self._images.within(self._with_ice(frame, style))
        if (solids := self._rounding.seen(frame.solids)) is not frame.solids:
            frame = dataclasses.replace(frame, solids=solids)
        extent = extent_of(frame.scene)
        if camera is None:
            camera = Camera.framing_extent(extent, self.width / self.height).tilted(frame.scene, frame.time, ROOM)
        look = style.look(frame)
        quantity, limits, name, colors = style.coloring(frame)
        if name != self._colors_name:
            upload(self._colors, colors)
            self._colors_name = name
        low, high = limits
        coloring = interned(Coloring(colors=self._colors, low=low, scale=1.0 / (high - low)))
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
            plane=(turn @ normal, offset)
            if style.cut is not None
            else style.plane(extent, frame.scene.tank is not None),
            dyed=may_be_dyed(frame),
            lit=-1 if style.lit is None else style.lit,
            hasty=style.hasty,
            shutter=float(style.shutter),
            turn=0,
        )

    def _with_ice(self, frame: Frame, style: Style) -> Frame:
        """Return the frame with ice as it is seen: dyed white, or in the water as the fluid after the scene's."""
        if not frame.frozen_count:
            return frame
        if self._seen is None or self._seen.shape[0] < frame.dye.shape[0]:
            self._seen = qd.ndarray(qd.i32, shape=(frame.dye.shape[0],))
        if style.kind.name == "water":
            write_ice(frame.material, frame.frozen, self._seen, len(frame.scene.palette()), frame.count)
            return dataclasses.replace(frame, material=self._seen)
        write_ice(frame.dye, frame.frozen, self._seen, ICE, frame.count)
        return dataclasses.replace(frame, dye=self._seen)

    def _begin(self, style: Style, shot: Shot, timings: Timings) -> int:
        """Find what does not depend on the eye, and return the number of the shape in whose light water is seen."""
        if not style.kind.still:
            self._stages.forget()
            self._run(style.kind.once, shot, timings)
            return 0
        water = water_of(self.buffers, shot)
        shape, lit = self._stages.shapes(shot.frame, water, style.hasty)
        self._renew("once", (water, shape), style.kind, shot, timings)
        return lit

    def _take(self, kind: View, shot: Shot, lit: int, timings: Timings) -> None:
        """Fill `color`; what does not change is kept from the picture before, and comes out as it would anew."""
        if kind.still:
            cast, water = sun_and_solids(shot), self.buffers.water
            stages = {"shadows": cast, "still": (cast, eye_and_style(shot), water), "sunny": Sunlight(cast, water, lit)}
            for stage, of in stages.items():
                self._renew(stage, of, kind, shot, timings)
        self._run(kind.passes, shot, timings)

    def _renew(self, stage: str, of: Any, kind: View, shot: Shot, timings: Timings) -> None:
        """Draw a stage of a view, unless it has been drawn for that."""
        if self._stages.is_due(stage, of):
            self._run(getattr(kind, stage), shot, timings)
            self._stages.remember(stage, of)

    def _run(self, passes: tuple[Pass, ...], shot: Shot, timings: Timings) -> None:
        for draw in passes:
            began = time.perf_counter()
            draw(shot, self.buffers)
            if timings is not None:
                synchronize()
                name = draw.__module__.rpartition(".")[2]
                timings[name] = timings.get(name, 0.0) + 1e3 * (time.perf_counter() - began)

    def _average(self, style: Style, shot: Shot, lit: int, timings: Timings) -> None:
        """Take many pictures, each moved by less than a pixel and lit by another point of the sun, and average them."""
        if self._total is None:
            self._total = qd.ndarray(vec3, shape=(self.buffers.rows, self.buffers.columns))
        glaring, excess = style.glare and shot.frame.dim == 3 and style.kind.name == "water", np.zeros(3)
        for number in range(style.samples):
            self._take(style.kind, self._moved(shot, number), lit, timings)
            tonemap.collect(self.buffers.pixels.color, self._total, 1.0 / (number + 1))
            if glaring:
                excess = excess + excess_of(download(self.buffers.pixels.color)) / style.samples
        if glaring:
            add_glare(self._total, excess, shot.lens, room=1.0)
        tonemap.draw_collected(self._total, self.buffers)

    def _moved(self, shot: Shot, number: int) -> Shot:
        """Return the shot of one sample: low-discrepancy points in a pixel and on the sun."""
        across, down, angle, reach = (_radical_inverse(number + 1, prime) for prime in (2, 3, 5, 7))
        axes = _sun_axes(shot.look.to_sun)
        wide, turn = shot.look.sun_size * math.sqrt(reach), 2.0 * math.pi * angle
        to_sun = shot.look.to_sun + wide * (math.cos(turn) * axes[0] + math.sin(turn) * axes[1])
        to_sun = vector(*(to_sun / np.linalg.norm(to_sun)))
        return dataclasses.replace(
            shot,
            turn=(number + number // 4) % GROUP,  # by no pattern that `across` has
            lens=dataclasses.replace(shot.lens, middle=shot.lens.middle + vector(across - 0.5, down - 0.5)),
            sun=_sun_lens(shot.extent, to_sun, self.buffers.texels),
            water_sun=_sun_lens(shot.extent, to_sun, sun_texels(shot.extent)),
            look=dataclasses.replace(shot.look, to_sun=to_sun, sun_size=min(POINT_SUN, shot.look.sun_size)),
        )


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


def _sun_axes(to_sun: Any) -> np.ndarray:
    return basis(-to_sun, np.array([0.0, 0.0, -1.0]))


def _sun_lens(extent: Extent, to_sun: Any, texels: int) -> Lens:
    """An orthographic view of the extent from the sun, with room for what splashes out of it."""
    axes = _sun_axes(to_sun)
    reach = 1.15 * extent.radius
    eye = extent.middle - 10.0 * reach * axes[2]
    return lens_at(eye, axes, texels, texels, 0.5 * texels / reach, perspective=False, near=1e-6)


_kept: collections.OrderedDict[tuple[int, int, int], Renderer] = collections.OrderedDict()


class Options(TypedDict, total=False):
    """Options of `render` beside a camera; those of a style that are left out, or None, are its own choice."""

    quality: str | None  # draft, standard, high or film
    supersample: int | None  # samples a pixel has in each direction
    timings: dict[str, float]  # receives the milliseconds of each pass
    watch: Watch  # is told how far a traced picture is, and can stop it
    view: str | None
    color_by: str | None
    colormap: str | None
    limits: tuple[float, float] | None
    radius: float | None
    cut: str | None
    legend: bool
    lit: int | None
    environment: str | None
    sun: str | None
    floor: str | None
    glare: bool
    edges: bool
    hasty: bool
    samples: int
    traced: bool
    aperture: float
    focus: float | None
    shutter: float


@TURN
def render(
    world: Any,
    width: int = 1280,
    height: int = 720,
    *,
    camera: Camera | None = None,
    eye: Sequence[float] | None = None,
    target: Sequence[float] | None = None,
    **options: Unpack[Options],
) -> np.ndarray:
    """Return a picture of a `Frame` or a `Simulation`, uint8 [height, width, 3].

    The camera is at `eye` [m] and looks at `target` [m], or is a `Camera`; what is None frames the world. `options` are
    the fields of `Style`, and `quality`: draft, standard, high or film. Without it and `supersample` that is 2, or 1
    for pictures of more than 16 million pixels. Renderers of the last few sizes are kept.
    """
    chosen: dict[str, Any] = {**options}
    quality, supersample = chosen.pop("quality", None), chosen.pop("supersample", None)
    if quality is not None:
        usual_samples, usual = quality_options(quality)
        supersample, chosen = supersample or usual_samples, {**usual, **chosen}
    # Neighbours are searched for only where densities are seen.
    frame = world.frame(measured=chosen.get("color_by") == "density") if hasattr(world, "frame") else world
    if not (hasattr(frame, "scene") and hasattr(frame, "x")):
        raise WavetankError(f"render: a {type(world).__name__} cannot be drawn; give a simulation or a frame.")
    if supersample is None:
        supersample = affordable(width, height, 2)
    check_size(width, height, supersample)
    if eye is not None or target is not None:
        if camera is not None:
            raise WavetankError("render: camera and eye, or target, exclude each other; a camera has both.")
        camera = Camera.looking(frame, eye, target, width / height)
    key = (width, height, supersample)
    renderer = _kept.pop(key, None)
    # Large ones go first, so that two of them are never alive at once.
    while _kept and (len(_kept) >= KEPT_RENDERERS or sum(_samples(k) for k in (*_kept, key)) > KEPT_SAMPLES):
        _kept.popitem(last=False)
    renderer = renderer or Renderer(width, height, supersample)
    _kept[key] = renderer
    return renderer.render(frame, camera, **chosen)


def _shown(call: Any) -> inspect.Signature:
    """Return the signature of `call` with the names of its options, for editors and `help`."""
    own = inspect.signature(call)
    more = [inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None) for name in Options.__annotations__]
    return own.replace(parameters=[*list(own.parameters.values())[:-1], *more])


render.__signature__ = _shown(render)  # type: ignore[attr-defined]


def check_size(width: Any, height: Any, supersample: Any) -> None:
    """Raise `WavetankError` for a size of pictures that is not allowed."""
    for name, value, most in (
        ("width", width, LARGEST_SIDE),
        ("height", height, LARGEST_SIDE),
        ("supersample", supersample, LARGEST_SUPERSAMPLE),
    ):
        if isinstance(value, bool) or not isinstance(value, int | np.integer) or not 1 <= value <= most:
            raise WavetankError(f"render: {name} = {value!r} must be a whole number from 1 to {most}.")
    needed = PER_SAMPLE * float(width) * float(height) * float(supersample) ** 2
    check_free(needed, f"render: a picture of {width}x{height}", "; make it smaller")


def affordable(width: Any, height: Any, supersample: int) -> int:
    """Return `supersample`, or 1 where the picture alone has more than 16 million pixels (some 3 GB of arrays)."""
    sizes = isinstance(width, int | np.integer) and isinstance(height, int | np.integer)
    return supersample if sizes and width * height <= KEPT_SAMPLES else 1


def _samples(key: tuple[int, int, int]) -> int:
    return key[0] * key[1] * key[2] ** 2
