"""Descriptions of parameters, tools, scenes and views, from which page, notebook and window make their controls."""

import dataclasses
import functools
import math
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import PARAMETERS, Parameters
from wavetank.page.keys import KEYS, LOOK, SPEEDS
from wavetank.page.picture import Painter
from wavetank.page.theme import PAINTS
from wavetank.page.units import readable, units
from wavetank.scene.fluids import Points
from wavetank.scene.light import HIGHEST, LOWEST
from wavetank.scene.scene import Scene, bundled_levels, bundled_scenes
from wavetank.scene.summary import bundled_counts, bundled_title
from wavetank.session.session import Session
from wavetank.session.tools import TOOLS, describe
from wavetank.view.choices import colorings, options, standing, views
from wavetank.view.colormaps import ENTRIES, table, to_srgb
from wavetank.view.environments import ENVIRONMENTS
from wavetank.view.extent import ENDLESS, extent_of
from wavetank.view.quantities import QUANTITIES
from wavetank.view.views import VIEWS

SHADES = 48  # colours of a legend
COMMON = ("gravity", "viscosity", "vorticity", "iterations", "substeps", "spacing")  # shown first


def hello_message(session: Session) -> dict[str, Any]:
    """Return the first message to a viewer: descriptions of all controls."""
    return {
        "type": "hello",
        "parameters": [_parameter(p) for p in PARAMETERS],
        "tools": [LOOK, *(describe(tool) for tool in TOOLS)],
        "scenes": scenes(),
        "views": views(),
        "colorings": colorings(),
        "paints": PAINTS,
        "environments": list(ENVIRONMENTS),
        "sun": {"lowest": LOWEST, "highest": HIGHEST},
        "keys": [dataclasses.asdict(key) for key in KEYS],
        "speeds": SPEEDS,
        **world(session),
    }


def world(session: Session) -> dict[str, Any]:
    """Return what changes with the scene and its parameters."""
    scene, extent = session.sim.scene, extent_of(session.sim.scene)
    size = float((extent.upper - extent.lower).max())
    return {
        "title": scene.title,
        "dim": scene.dim,
        "size": size,
        "units": units(size, scene.dim),
        "arch": session.sim.arch,
        "values": {p.name: getattr(scene, p.name) for p in PARAMETERS},
        "view": session.view or views()[0],
        "color_by": session.color_by,
        "painted": painted(session),
        "legend": legend(session),
        "cut": session.cut,
        "forces": session.shows_forces,
        "bodies": len(session.sim.bodies),
        "light": dataclasses.asdict(standing(scene, session.view, session.light)),
        "undo": session.previous_world.scene.title if session.previous_world else None,
        "game": session.game is not None,
    }


def painted(session: Session) -> str:
    """Return the shown colouring, "" where particles have none."""
    return str(options(session.view, session.color_by).get("color_by", ""))


def legend(session: Session) -> dict[str, Any] | None:
    """Return the legend of the picture's colours: title, colours from low to high, ticks."""
    color_by, scene = painted(session), session.sim.scene
    if color_by not in QUANTITIES or not VIEWS[session.view or views()[0]].coloured:
        return None
    quantity = QUANTITIES[color_by]
    if quantity.palette:
        names = [[material.name, material.color] for material in scene.palette()]
        return {"title": color_by, "colors": [color for _, color in names], "names": names}
    low, high = quantity.limits(scene)
    colors = to_srgb(table(quantity.colormap)[:: max(1, ENTRIES // SHADES)])
    hexes = ["#" + "".join(f"{round(255 * float(part)):02x}" for part in color) for color in colors]
    title = f"{(quantity.title or color_by).capitalize()} [{readable(quantity.unit)}]"
    return {"title": title, "colors": hexes, "ticks": [low, 0.5 * (low + high), high]}


def status(session: Session, painter: Painter) -> dict[str, Any]:
    """Return what changes with every frame."""
    pace, times = session.pace, session.history.times
    return {
        "time": session.sim.time,
        "frame": session.sim.frame_number,
        "ticks": session.ticks,
        "count": session.sim.count,
        "paused": session.paused,
        "waits": session.awaits_touch,
        "speed": session.speed,
        "pace": pace.measured if not session.paused else 0.0,
        "fps": pace.frames_per_second,
        "late": pace.is_late(session.speed) and not session.paused,
        "picture_ms": 1e3 * painter.seconds,
        "frame_ms": 1e3 * session.sim.seconds_per_frame,
        "running": list(session.running),
        "held": [tool.name for tool, _ in session.hands.values()],
        "past": [times[0], max(times[-1], session.sim.time)] if times else [0.0, 0.0],
        "bookmarks": list(session.history.bookmarks),
        "height": session.camera.visible_height,
    }


def figures(session: Session) -> dict[str, float]:
    """Measure the water, which takes a neighbour search."""
    stats = session.sim.stats()
    names = ("density_error_mean", "density_error_max", "kinetic_energy", "potential_energy", "speed_max")
    return {name: float(stats[name]) for name in names}


def _parameter(p: Any) -> dict[str, Any]:
    choices: list[str] = []
    if isinstance(p.default, str):
        choices = list(getattr(Parameters.model_fields[p.name].annotation, "__args__", ()))
    return {
        "name": p.name,
        "default": p.default,
        "low": p.low,
        "high": p.high,
        "unit": readable(p.unit),
        "symbol": p.symbol,
        "sentence": p.sentence,
        "live": p.live,
        "everyday": p.name in COMMON,
        "choices": choices,
        "whole": isinstance(p.default, int),
    }


@functools.cache
def scenes() -> list[dict[str, Any]]:
    """Return name, title, number of particles and outline of every bundled level and scene; levels have a goal."""
    return [_card(name) for name in (*bundled_levels(), *bundled_scenes())]


def _card(name: str) -> dict[str, Any]:
    """Return a scene's card; one that needs a missing package says so when it is chosen."""
    try:
        return _outline(name, Scene.load(name))
    except WavetankError:
        box = {"lower": [0.0] * 3, "upper": [1.0] * 3, "shapes": [], "dim": 3, "goal": ""}
        return {"name": name, "title": bundled_title(name), "count": bundled_counts()[name], **box}


def _outline(name: str, scene: Scene) -> dict[str, Any]:
    """Return a scene as boxes and balls, for its thumbnail."""
    extent = extent_of(scene)
    shapes: list[dict[str, Any]] = []
    colors = {material.name: material.color for material in scene.palette()[1:]}
    for fluid in scene.fluids:
        if isinstance(fluid, Points) and not len(fluid.positions):
            continue
        shapes.append({"what": "water", "round": fluid.shape == "ball", **_box(*fluid.bounds())})
        shapes[-1]["color"] = colors.get(fluid.material or "", "")
    for solid in scene.solids:
        if solid.reach() < ENDLESS:
            half = np.ravel(getattr(solid, "size", (2.0 * solid.reach() / math.sqrt(3.0),) * 3)) / 2.0
            half = np.full(3, half[0]) if len(half) == 1 else np.concatenate([half, np.zeros(3 - len(half))])
            is_round = solid.shape in ("sphere", "capsule")
            shapes.append({"what": "solid", "round": is_round, **_box(solid.origin - half, solid.origin + half)})
    return {
        "name": name,
        "title": scene.title or name,
        "dim": scene.dim,
        "count": bundled_counts()[name],
        "shapes": shapes,
        "lower": extent.lower.tolist(),
        "upper": extent.upper.tolist(),
        "goal": scene.goal.text if scene.goal else "",
    }


def _box(lower: np.ndarray, upper: np.ndarray) -> dict[str, Any]:
    pad = np.zeros(3 - len(lower))
    return {"lower": [*map(float, lower), *pad], "upper": [*map(float, upper), *pad]}
