"""High scores in the user's data folder: for each level the most stars, and the least time (or water) among those."""

import hashlib
import json
from typing import Any

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.folders import data_folder
from wavetank.foundation.input_limits import parse_json, read_text
from wavetank.scene.scene import Scene, bundled_levels

FILE = "scores.json"


def key_of(scene: Scene) -> str:
    """Return the name of a bundled level that is unchanged; any other one is known by what is in it."""
    for name in bundled_levels():
        if Scene.load(name).table() == scene.table():
            return name
    return "own-" + hashlib.sha256(scene.text().encode()).hexdigest()[:16]


def scores() -> dict[str, dict[str, Any]]:
    """Return all high scores by level, `stars` and `mark`; what cannot be read counts as none."""
    try:
        table = parse_json(read_text(data_folder() / FILE, "file of scores", 10_000_000), FILE)
    except WavetankError:
        return {}
    entries = table.items() if isinstance(table, dict) else ()
    return {name: entry for name, entry in entries if isinstance(entry, dict) and _is_score(entry)}


def keep_score(level: str, stars: int, mark: float) -> bool:
    """Keep a score if it is the best of its level and say whether it is; raises `OSError` where nothing can be kept."""
    table = scores()
    best = table.get(level)
    if best is not None and (-best["stars"], best["mark"]) <= (-stars, mark):
        return False
    table[level] = {"stars": stars, "mark": round(mark, 3)}
    folder = data_folder()
    folder.mkdir(parents=True, exist_ok=True)
    with atomic_write(folder / FILE) as partial:
        partial.write_text(json.dumps(table, indent=2, sort_keys=True) + "\n", encoding="utf-8")
    return True


def _is_score(entry: dict[str, Any]) -> bool:
    stars, mark = entry.get("stars"), entry.get("mark")
    return stars in (1, 2, 3) and isinstance(mark, int | float)
