"""What the shares of tools are in a world of a given size, in units that a person reads."""

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
