"""One-line summaries of scenes; counts and titles of the bundled ones, without building them."""

import functools
import importlib.resources
import json
import tomllib
from typing import Any


@functools.cache
def bundled_counts() -> dict[str, int]:
    """Return how many particles each bundled scene and level begins with, those in solids left out."""
    text = (importlib.resources.files("wavetank.scene") / "counts.json").read_text("utf-8")
    counts: dict[str, int] = json.loads(text)
    return counts


def bundled_title(name: str) -> str:
    """Return the title of a bundled scene or level, even of one that needs a package which is missing here."""
    folder = importlib.resources.files("wavetank.scene")
    files = [folder / kind / f"{name}.toml" for kind in ("scenes", "levels")]
    text = next(file for file in files if file.is_file()).read_text("utf-8")
    return str(tomllib.loads(text).get("title", name))


def summary(scene: Any) -> str:
    """Describe a `Scene` in one line: title, size, and numbers of particles, solids and sources."""
    count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    size = f"tank of {' x '.join(f'{side:g}' for side in scene.tank.size)} m" if scene.tank else "no tank"
    members = {kind: len(getattr(scene, f"{kind}s")) for kind in ("solid", "joint", "emitter", "drain")}
    parts = [f"{number} {kind}{'s' * (number != 1)}" for kind, number in members.items() if number]
    about = [f"{scene.dim}-D", size, f"about {count:,.0f} particles of {scene.spacing:g} m", *parts]
    return f"<Scene {scene.title or 'without title'!r}: {', '.join(about)}>"
