"""What a person can choose between when looking at a world."""

import dataclasses
import math
from typing import Any

from wavetank.scene.scene import Scene
from wavetank.view.environments import chosen_light, look_of, usual_environment
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


@dataclasses.dataclass(frozen=True)
class SkyLight:
    """Under which sky a person sees a world, and where its sun stands."""

    environment: str
    azimuth: float  # deg, 0 to 360
    elevation: float  # deg


def standing(scene: Scene, view: str, chosen: dict[str, str]) -> SkyLight:
    """Return the light of a scene in a view, with the renderer's options that were chosen."""
    light = chosen_light(scene.light, chosen.get("environment"), chosen.get("sun"), None)
    name = light.environment or usual_environment(scene.dim, VIEWS[view or USUAL].coloured)
    x, y, z = (float(part) for part in look_of(name, light.azimuth, light.elevation, None, scene.dim).to_sun)
    return SkyLight(name, math.degrees(math.atan2(x, z)) % 360.0, math.degrees(math.asin(max(-1.0, min(1.0, y)))))
