"""The same water at any frame rate: one dam with 30 to 480 frames a second, four substeps, quality draft and high.

The equations know no frames: what differs is the method's. Bounds are of the largest difference between any two, at two
spacings. The dam and how it is read: `dam.py`; its column is 1 m high. Known: what calms slow water takes its share of
a frame in each step with a share that falls with v^2 only, so short steps are damped more.
"""

from typing import Any

from wavetank.lab.cases import dam
from wavetank.lab.cases.case import Case, Outcome

RATES = (30, 60, 240, 480)
WAYS: dict[str, dict[str, Any]] = {
    **{f"{rate} /s": {"frame_time": 1.0 / rate} for rate in RATES},
    "60 /s in 4": {"substeps": 4},
    "draft": {"quality": "draft"},
    "high": {"quality": "high"},
}
STARTS = {25: 3, 50: 1}  # layers: starts


def run(quick: bool, arch: str) -> Outcome:
    """Let the column fall in all ways, at two spacings (quick: three rates, at the coarser, once)."""
    ways = {name: WAYS[name] for name in ("30 /s", "60 /s", "240 /s")} if quick else WAYS
    starts = {20: 1} if quick else STARTS
    falls = {
        f"{layers} layers": {name: dam.fall(dam.scene(layers, **way), arch, number) for name, way in ways.items()}
        for layers, number in starts.items()
    }
    front, height = (4.0, 12.0) if quick else (1.5, 2.0)
    figures = [figure for name, group in falls.items() for figure in dam.compare(name, group, front, height)]
    return Outcome(figures, dam.columns(falls), lambda plot: dam.draw(plot, falls))


CASE = Case("frame-rate", "One dam at any frame rate", run)
