"""What a person can choose between when looking at a world."""

from typing import Any

from wavetank.view.quantities import QUANTITIES
from wavetank.view.views import VIEWS

USUAL = "water"


def views() -> list[str]:
    """Names of the renderer's views, the usual one first."""
    return list(VIEWS)


def colorings() -> list[str]:
    """Names of what particles can be coloured by."""
    return list(QUANTITIES)


def showing(view: str, color_by: str) -> str:
    """Return the view in which a coloring is seen: the one there is, or particles where that has other colours."""
    kind = VIEWS[view or USUAL]
    if kind.coloured or (color_by.startswith("#") and kind.name == USUAL):
        return view
    return USUAL if color_by.startswith("#") else "particles"


def options(view: str, color_by: str) -> dict[str, Any]:
    """Return the renderer's arguments for a choice of both; water has no colour but that of its fluid."""
    kind = VIEWS[view or USUAL]
    takes_color = kind.coloured or color_by.startswith("#")
    return {"view": kind.name, **({"color_by": color_by} if takes_color else {})}
