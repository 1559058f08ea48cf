"""What the shares of tools are in a world of a given size, in units that a person reads."""

import math

from wavetank.session.tools.press import REFERENCE

EARTH = 9.81  # m/s^2


def units(size: float, dim: int) -> dict[str, tuple[float, str]]:
    """Return what a declared unit is worth in a world as long as `size` [m], and what that is called."""
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
    """Return a unit with raised powers."""
    return unit.replace("^2", "²").replace("^3", "³")


def digits(value: float) -> str:
    """Return the printf format of a number that a person reads: three digits, and never a power of ten."""
    size = abs(value)
    if size >= 1000.0:
        return "%.0f"
    return f"%.{min(9, 2 - math.floor(math.log10(size)))}f" if 0.0 < size < 1e-3 else "%.3g"
