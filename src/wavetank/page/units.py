"""Units of tools' options in a world of a given size."""

import math

from wavetank.session.tools.solids import REFERENCE

EARTH = 9.81  # m/s^2


def units(size: float, dim: int) -> dict[str, tuple[float, str]]:
    """Return factor and name of each declared unit, in a world of length `size` [m]."""
    length = (100.0 * size, "cm") if size < 1.0 else (size, "m")
    return {
        "L": length,
        "√(gL)": ((EARTH * size) ** 0.5, "m/s"),
        "√(g/L)": ((EARTH / size) ** 0.5, "Hz"),
        "9.81 m/s²": (1.0, "g"),
        "water": (1000.0, "kg/m³"),
        "cubes": (1000.0 * EARTH * (REFERENCE * size) ** dim, "N" if dim == 3 else "N/m"),
    }


def readable(unit: str) -> str:
    """Return a unit with superscripts."""
    return unit.replace("^2", "²").replace("^3", "³")


def digits(value: float) -> str:
    """Return a printf format with three significant digits and without exponent."""
    size = abs(value)
    if size >= 1000.0:
        return "%.0f"
    return f"%.{min(9, 2 - math.floor(math.log10(size)))}f" if 0.0 < size < 1e-3 else "%.3g"
