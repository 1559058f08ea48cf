"""What a picture should show and how: the options of a picture, checked."""

import dataclasses
import difflib
import math
from typing import Any

import numpy as np

from wavetank.foundation.arguments import instance_of
from wavetank.foundation.errors import WavetankError
from wavetank.simulation.frame import Frame
from wavetank.view.colormaps import ENTRIES, bands, rgb_of, table, to_linear
from wavetank.view.environments import chosen_light, look_of, usual_environment, without_edges
from wavetank.view.extent import Extent
from wavetank.view.look import Look
from wavetank.view.panorama import is_picture, panorama
from wavetank.view.quantities import QUANTITIES, key_of, usual
from wavetank.view.views import VIEWS, View

#: Of a drawn particle [d] in 2-D and 3-D worlds: what has no depth should close its gaps.
RADIUS = {2: 0.62, 3: 0.55}
MOST_SAMPLES = 4096
#: name -> samples a pixel has in each direction, and pictures that are averaged; of a film, samples of a path tracer
QUALITIES: dict[str, tuple[int, int]] = {"draft": (1, 1), "standard": (2, 1), "high": (1, 64), "film": (1, 64)}
GLARING = ("high", "film")


@dataclasses.dataclass(frozen=True)
class Style:
    """Options of a picture; None leaves a choice to the view. Raises `WavetankError` for what is not allowed."""

    view: str | None = None  # one of VIEWS; None is water, or particles where their colours or size are given
    color_by: str | None = None  # one of QUANTITIES, or a colour #rrggbb, which dyes the water as well
    colormap: str | None = None  # one of COLORMAPS
    limits: tuple[float, float] | None = None  # values of the first and the last colour
    radius: float | None = None  # of a drawn particle, in spacings
    cut: str | None = None  # where a slice lies: an axis, as "z", or an axis and a place in m, as "z=0.35"
    legend: bool = True
    lit: int | None = None  # number of a solid that shines, as under a pointer
    environment: str | None = None  # one of ENVIRONMENTS; or a file (.hdr); None is the scene's, or the view's
    sun: str | None = None  # azimuth and elevation [deg], as "40,25"
    floor: str | None = None  # one of FLOORS
    glare: bool = False  # spread what is much brighter than white as an eye does, in worlds in space; film and high
    edges: bool = True  # whether the edges of the tank are drawn
    hasty: bool = False  # leave out what movement hides: smooth outlines, every second look of the sun and ray
    samples: int = 1  # pictures, each from a slightly other eye and sun, that are averaged; or samples that are traced
    traced: bool = False  # follow paths of light in a world in space; other pictures are averaged
    aperture: float = 0.0  # m: radius of the lens of a traced picture
    focus: float | None = None  # m: distance that is sharp in it, that of the world's middle unless told
    shutter: float = 0.0  # s: for which it sees the water move, in other pictures of water in space as well

    @classmethod
    def of(cls, options: dict[str, Any]) -> "Style":
        """Return the style with these options; raises `WavetankError` for a name that is none."""
        known = [field.name for field in dataclasses.fields(cls)]
        for name in options:
            if name not in known:
                near = difflib.get_close_matches(name, known, 1)
                hint = f"did you mean {near[0]!r}?" if near else f"options are {', '.join(known)}."
                raise WavetankError(f"render: there is no option {name!r}; {hint}")
        return cls(**options)

    def __post_init__(self) -> None:
        """Check what needs no frame to be checked."""
        for name in ("view", "color_by", "colormap", "cut", "environment", "sun", "floor"):
            if getattr(self, name) is not None:
                instance_of(f"render: {name}", getattr(self, name), str, "a text")
        if self.view is not None and self.view not in VIEWS:
            raise WavetankError(f"render: view = {self.view!r} is not known; use one of {', '.join(VIEWS)}.")
        if self.color_by is not None and self.color_by not in QUANTITIES:
            if not str(self.color_by).startswith("#"):
                raise WavetankError(
                    f"render: color_by = {self.color_by!r} is not known; use one of {', '.join(QUANTITIES)}, "
                    "or a colour such as '#3f99da'."
                )
            rgb_of(self.color_by)
        if not self.kind.coloured and self.color_by in QUANTITIES:
            raise WavetankError(
                f"render: color_by = {self.color_by!r} does not go with the view {self.view!r}, which has the colour "
                "of its fluid; use a colour such as '#3f99da', or the view particles or slice."
            )
        if self.cut is not None and self.kind.name != "slice":
            raise WavetankError(
                f"render: cut = {self.cut!r} does not go with the view {self.view!r}; use the view slice."
            )
        radius = self.radius
        if radius is not None and not (isinstance(radius, int | float) and 0.0 < radius <= 10.0):
            raise WavetankError(f"render: radius = {radius!r} must be a number of spacings above 0, at most 10.")
        chosen_light(None, self.environment, self.sun, self.floor)
        self._check_numbers()

    def _check_numbers(self) -> None:
        samples = self.samples
        if isinstance(samples, bool) or not isinstance(samples, int) or not 1 <= samples <= MOST_SAMPLES:
            raise WavetankError(f"render: samples = {samples!r} must be a whole number from 1 to {MOST_SAMPLES}.")
        lengths = ("aperture", self.aperture, 0.0), ("focus", self.focus, 1e-3), ("shutter", self.shutter, 0.0)
        for name, value, least in lengths:
            if value is not None and not (isinstance(value, int | float) and least <= value <= 1e4):
                raise WavetankError(f"render: {name} = {value!r} must be a number from {least:g} to 10000.")

    @property
    def kind(self) -> View:
        """The view that is meant."""
        if self.view is None:
            said = (self.color_by, self.colormap, self.limits, self.radius)
            return VIEWS[
                "slice" if self.cut is not None else "particles" if any(s is not None for s in said) else "water"
            ]
        return VIEWS[self.view]

    def look(self, frame: Frame) -> Look:
        """Light and colours: what is asked for, else the scene's, else what is usual for the view."""
        light = chosen_light(frame.scene.light, self.environment, self.sun, self.floor)
        environment = light.environment or usual_environment(frame.dim, self.kind.coloured)
        look = look_of(environment, light.azimuth, light.elevation, light.floor, frame.dim)
        return look if self.edges else without_edges(look)

    def sky(self) -> np.ndarray | None:
        """Return the picture that the sky of a traced picture is, float32 [rows, columns, 3], or None."""
        return panorama(str(self.environment)).sky if is_picture(self.environment) else None

    def particle_radius(self, extent: Extent) -> float:
        """Radius of a drawn particle [m]."""
        return (RADIUS[extent.dim] if self.radius is None else float(self.radius)) * extent.spacing

    def coloring(self, frame: Frame) -> tuple[int, tuple[float, float], str, np.ndarray]:
        """Key of the quantity, its limits, and the colours with a name: linear RGB [ENTRIES, 3]."""
        color_by = self.color_by or usual(frame.scene)
        if color_by not in QUANTITIES:
            return 0, (0.0, 1.0), color_by, np.tile(to_linear(np.array(rgb_of(color_by))), (ENTRIES, 1))
        quantity = QUANTITIES[color_by]
        name = self.colormap or quantity.colormap
        colors = table(name)
        if quantity.palette and not self.colormap:
            palette = quantity.palette(frame.scene)
            name, colors = "".join(palette), bands(palette)
        try:
            low, high = (float(limit) for limit in self.limits or quantity.limits(frame.scene))
        except (TypeError, ValueError):
            low = high = math.nan
        if not (math.isfinite(low) and math.isfinite(high) and high - low > 1e-30):
            raise WavetankError(f"render: limits = {self.limits} must be two finite numbers, the lower one first.")
        return key_of(color_by), (low, high), name, colors

    def plane(self, extent: Extent, tank: bool) -> tuple[Any, float]:
        """Unit normal [3] of a slice, and its distance from the origin along it [m], which is inside of a tank."""
        axis, equals, place = ("z" if self.cut is None else self.cut).partition("=")
        axes = "xyz" if extent.dim == 3 else "z"
        try:
            number = "xyz".index(axes[axes.index(axis.strip() or "?")])
            offset = float(place) if equals else float(extent.middle[number])
        except ValueError:
            raise WavetankError(
                f"render: cut = {self.cut!r} is not allowed; write an axis of {', '.join(axes)} and a place [m], as "
                "in z=0.35."
            ) from None
        if not (math.isfinite(offset)):
            raise WavetankError(f"render: cut = {self.cut!r} is not allowed; the place must be a finite number [m].")
        low, high = extent.lower[number], extent.upper[number]
        if (tank or extent.dim == 2) and not low <= offset <= high:
            raise WavetankError(
                f"render: cut = {self.cut!r} is beside the water; the place must be from {low:g} to {high:g} m."
            )
        return np.eye(3)[number], offset


def quality_named(name: str) -> str:
    """Return the name of a quality, or raise `WavetankError`."""
    if not isinstance(name, str) or name not in QUALITIES:
        raise WavetankError(f"quality = {name!r} is not known; use one of {', '.join(QUALITIES)}.")
    return name


def quality_options(name: str, samples: int | None = None) -> tuple[int, dict[str, Any]]:
    """Return the samples a pixel has in each direction, and the options of a quality, with other `samples` if told."""
    supersample, usual = QUALITIES[quality_named(name)]
    return supersample, {
        "samples": usual if samples is None else samples,
        "traced": name == "film",
        "glare": name in GLARING,
    }
