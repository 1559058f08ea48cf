"""Pictures of a world: a list of passes over shared buffers."""

import collections
import functools
import math
from typing import Any

import numpy as np

from wavetank.compiler import current_backend, qd
from wavetank.errors import WavetankError
from wavetank.frame import Frame
from wavetank.view import legend as legends
from wavetank.view.buffers import allocate
from wavetank.view.camera import Camera
from wavetank.view.colormaps import ENTRIES, rgb_of, table, to_linear
from wavetank.view.extent import Extent, extent_of
from wavetank.view.lens import Lens, basis, lens_at, vec3
from wavetank.view.look import paper, studio
from wavetank.view.passes import floor, occlusion, shade, shadow, smooth, solids, spheres, tank, tonemap
from wavetank.view.quantities import QUANTITIES, key_of
from wavetank.view.shot import Shot

#: The picture from top to bottom: what is where, what light reaches it, how it looks, what lies over it.
PASSES = (
    spheres.draw,
    solids.draw,
    floor.draw,
    shadow.draw,
    occlusion.draw,
    smooth.draw,
    shade.draw,
    tank.draw,
    tonemap.draw,
)
LARGEST_SIDE, LARGEST_SUPERSAMPLE = 8192, 4
KEPT_RENDERERS = 4
#: Of a drawn particle [d] in 2-D and 3-D worlds: what has no depth should close its gaps.
RADIUS = {2: 0.62, 3: 0.55}


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

    def render(
        self,
        frame: Frame,
        camera: Camera | None = None,
        color_by: str = "speed",
        colormap: str | None = None,
        limits: tuple[float, float] | None = None,
        legend: bool = True,
        radius: float | None = None,
    ) -> np.ndarray:
        """Return a picture of `frame`, uint8 [height, width, 3].

        `color_by` is one of `QUANTITIES` or a colour ``#rrggbb``; `limits` are the values of the first and the last
        colour; `radius` of a drawn particle is in particle spacings, about a half if not given. Raises
        `WavetankError` for what is not allowed.
        """
        shot = self.shot(frame, camera, color_by, colormap, limits, radius)
        for draw in PASSES:
            draw(shot, self.buffers)
        picture = self.buffers.host_picture()
        if legend:
            self._write_legend(picture, shot, color_by, colormap)
        return picture

    def _write_legend(self, picture: np.ndarray, shot: Shot, color_by: str, colormap: str | None) -> None:
        column = 0
        if color_by in QUANTITIES:
            quantity = QUANTITIES[color_by]
            colors = table(colormap or quantity.colormap)
            column = legends.draw_bar(picture, colors, shot.limits, f"{color_by} [{quantity.unit}]")
        legends.write_time(picture, shot.frame.time, shot.frame.count, column)
        if shot.lens.perspective == 0.0:
            legends.draw_scale(picture, shot.lens.focal / self.supersample)

    def shot(
        self, frame: Frame, camera: Camera | None, color_by: str, colormap: str | None,
        limits: tuple[float, float] | None, radius: float | None,
    ) -> Shot:  # fmt: skip
        """Check what is asked for and return what the passes need to know."""
        radius = RADIUS[frame.dim] if radius is None else radius
        if not (isinstance(radius, int | float) and math.isfinite(radius) and 0.0 < radius <= 10.0):
            raise WavetankError(f"render: radius = {radius!r} must be a number of spacings above 0, at most 10.")
        extent = extent_of(frame.scene)
        camera = camera or Camera.framing_extent(extent, self.width / self.height)
        quantity, limits = self._coloring(frame, color_by, colormap, limits)
        return Shot(
            frame=frame,
            extent=extent,
            lens=camera.lens(self.buffers.columns, self.buffers.rows),
            sun=_sun_lens(extent, _look(extent.dim).to_sun, self.buffers.texels),
            look=_look(extent.dim),
            radius=radius * extent.spacing,
            quantity=quantity,
            limits=limits,
            colors=self._colors,
        )

    def _coloring(
        self, frame: Frame, color_by: str, colormap: str | None, limits: tuple[float, float] | None
    ) -> tuple[int, tuple[float, float]]:
        """Key and limits of the quantity; puts its colours on the device."""
        if color_by not in QUANTITIES:
            if not str(color_by).startswith("#"):
                raise WavetankError(
                    f"render: color_by = {color_by!r} is not known; use one of {', '.join(QUANTITIES)}, "
                    "or a colour such as '#3f99da'."
                )
            self._load_colors(color_by, np.tile(to_linear(np.array(rgb_of(color_by))), (ENTRIES, 1)))
            return 0, (0.0, 1.0)
        quantity = QUANTITIES[color_by]
        name = colormap or quantity.colormap
        self._load_colors(name, table(name))
        try:
            low, high = (float(limit) for limit in limits or quantity.limits(frame.scene))
        except (TypeError, ValueError):
            low = high = math.nan
        if not (math.isfinite(low) and math.isfinite(high) and high - low > 1e-30):
            raise WavetankError(f"render: limits = {limits} must be two finite numbers, the lower one first.")
        return key_of(color_by), (low, high)

    def _load_colors(self, name: str, colors: np.ndarray) -> None:
        if name != self._colors_name:
            self._colors.from_numpy(np.ascontiguousarray(colors, np.float32))
            self._colors_name = name


@functools.cache
def _look(dim: int) -> Any:
    return studio() if dim == 3 else paper()


def _sun_lens(extent: Extent, to_sun: Any, texels: int) -> Lens:
    """An orthographic view of the extent from the sun, with room for what splashes out of it."""
    axes = basis(-to_sun, np.array([0.0, 0.0, -1.0]))
    reach = 1.15 * extent.radius
    eye = extent.middle - 10.0 * reach * axes[2]
    return lens_at(eye, axes, texels, texels, 0.5 * texels / reach, perspective=False, near=1e-6)


_kept: collections.OrderedDict[tuple[int, int, int], Renderer] = collections.OrderedDict()


def render(world: Any, width: int = 1280, height: int = 720, *, supersample: int = 2, **options: Any) -> np.ndarray:
    """Return a picture of a `Frame`, or of anything with a ``frame()``, uint8 [height, width, 3].

    `options` are those of `Renderer.render`. Renderers of the last few sizes are kept.
    """
    frame = world.frame() if hasattr(world, "frame") else world
    if not (hasattr(frame, "scene") and hasattr(frame, "x")):
        raise WavetankError(f"render: a {type(world).__name__} cannot be drawn; give a simulation or a frame.")
    key = (width, height, supersample)
    renderer = _kept.pop(key, None) or Renderer(width, height, supersample)
    _kept[key] = renderer
    while len(_kept) > KEPT_RENDERERS:
        _kept.popitem(last=False)
    return renderer.render(frame, **options)
