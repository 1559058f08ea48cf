"""What particles can be coloured by: one device function and one entry in `QUANTITIES` each.

The device functions take what the frame knows of one particle, of which one `scalar`, see `scalars_of`; kernels choose
one by its key in `DEVICE_FUNCTIONS` at compile time.
"""

import dataclasses
import math
import zlib
from collections.abc import Callable
from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.extent import extent_of

Limits = tuple[float, float]


@qd.func
def speed(x, v, scalar, kind):
    """Speed |v| [m/s]."""
    return v.norm()


@qd.func
def density(x, v, scalar, kind):
    """Density rho [kg/m^3]."""
    return scalar


@qd.func
def pressure(x, v, scalar, kind):
    """Pressure p [Pa]."""
    return scalar


@qd.func
def material(x, v, scalar, kind):
    """Number of the material."""
    return qd.cast(kind, qd.f32)


@qd.func
def nothing(x, v, scalar, kind):
    """Zero: every particle has the first colour of the table."""
    return 0.0


def _speed_limits(scene: Any) -> Limits:
    """Zero to a round number near the speed of water that falls through a third of the world's height."""
    extent = extent_of(scene).turned(scene.upright)
    gravity = math.hypot(*scene.gravity)
    top = math.sqrt(2.0 / 3.0 * gravity * float(extent.upper[1] - extent.lower[1]))
    return 0.0, _round_up(top) if top > 0.0 else 1.0


def _density_limits(scene: Any) -> Limits:
    """A twentieth below and above the rest density."""
    densities = [fluid.density for fluid in scene.properties()]
    return 0.95 * min(densities), 1.05 * max(densities)


def _pressure_limits(scene: Any) -> Limits:
    """Zero to a round number near the pressure below half of the world's height, of the heaviest fluid."""
    extent = extent_of(scene).turned(scene.upright)
    weight = max(fluid.density for fluid in scene.properties()) * math.hypot(*scene.gravity)
    top = 0.5 * weight * float(extent.upper[1] - extent.lower[1])
    return 0.0, _round_up(top) if top > 0.0 else 1.0


def _material_limits(scene: Any) -> Limits:
    """Half a number below the first and above the last, so that every material has a band of equal width."""
    return -0.5, len(scene.palette()) - 0.5


def _palette(scene: Any) -> tuple[str, ...]:
    """The materials' own colours."""
    return tuple(material.color for material in scene.palette())


def _foam_limits(scene: Any) -> Limits:
    """Zero to twice the speed from which water counts as foam: the map changes to white in its middle."""
    return 0.0, 2.0 * scene.foaming_speed


@dataclasses.dataclass(frozen=True)
class Quantity:
    """How a coloured quantity is named and shown unless told otherwise."""

    value: Any  # device function
    unit: str
    colormap: str
    limits: Callable[[Any], Limits]  # of the scene, so that the colours of a film do not jump
    palette: Callable[[Any], tuple[str, ...]] | None = None  # colours of bands instead of a colour map
    title: str = ""  # in the legend, where that is not its name


def usual(scene: Any) -> str:
    """Return the quantity that tells most about `scene`: the material where it has several, else the speed.

    What a saved state has no more are the fluids that it began with, and water may come out of a mouth or a tool; the
    scene's materials are what tells.
    """
    return "material" if scene.materials else "speed"


QUANTITIES: dict[str, Quantity] = {
    "speed": Quantity(speed, "m/s", "water", _speed_limits),
    "density": Quantity(density, "kg/m^3", "balance", _density_limits),
    "pressure": Quantity(pressure, "Pa", "viridis", _pressure_limits),
    "material": Quantity(material, "", "viridis", _material_limits, _palette),
    "foam": Quantity(speed, "m/s", "foam", _foam_limits, title="speed"),
}


def key_of(name: str) -> int:
    """Key of a quantity in `DEVICE_FUNCTIONS`, 0 for what is none.

    Made from the name, not from the place in the list: the compiler's cache keeps kernels by key, and a new entry
    must not make it serve the kernel of another.
    """
    return zlib.crc32(name.encode()) & 0x7FFFFFFF if name in QUANTITIES else 0


def scalars_of(frame: Any, key: int) -> Any:
    """Return the scalar of each particle that the quantity with a `key` is found from: densities, or pressures."""
    return frame.pressure if key == key_of("pressure") else frame.rho


DEVICE_FUNCTIONS = {0: nothing, **{key_of(name): quantity.value for name, quantity in QUANTITIES.items()}}


@dataclasses.dataclass(frozen=True, eq=False)
class Coloring:
    """Colours of a quantity's values, on the device."""

    colors: qd.types.ndarray()  # vec3 [entries]: the colour map as linear RGB
    low: qd.f32  # value of the first colour
    scale: qd.f32  # 1 over the way to the value of the last one


@qd.func
def color_of(coloring: Coloring, value):
    """The colour of a value."""
    last = coloring.colors.shape[0] - 1
    entry = qd.cast(qd.min(qd.max((value - coloring.low) * coloring.scale, 0.0), 1.0) * last + 0.5, qd.i32)
    # Once more as an integer: a quantity that is not a number must still be a colour.
    return coloring.colors[qd.min(qd.max(entry, 0), last)]


def _round_up(value: float) -> float:
    """The next of 1, 1.5, 2, 3, 4, 5, 6, 8, 10 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(value))
    steps = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
    return power * next(step for step in steps if step * power >= 0.999 * value)
