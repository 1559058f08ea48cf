"""The same water at any scale: a column 1 mm, 1 m and 100 m high, read in Froude's time, sqrt(H / g).

Without viscosity and tension, gravity alone gives a length its time (Froude): the three are the same flow. Frames last
1/60 s at 1 m and as much longer or shorter elsewhere; the column of 100 m falls at 60 frames a second too, as it is run
when nobody thinks of it. Bounds are of the largest difference between any two, at two spacings (`dam.py`).

Known: XSPH's share is that of a step of 1/240 s whatever the scale; with `viscosity = 0` run-ups at 25 layers differ by
2 to 3 % of H.
"""

import math

from wavetank.lab.cases import dam
from wavetank.lab.cases.case import Case, Outcome

WAYS = {
    "1 mm": (0.001, math.sqrt(0.001) / 60.0),
    "1 m": (1.0, 1.0 / 60.0),
    "100 m": (100.0, 10.0 / 60.0),
    "100 m, 60 /s": (100.0, 1.0 / 60.0),
}  # m: height; s: of a frame
STARTS = {25: 3, 50: 1}  # layers: starts


def run(quick: bool, arch: str) -> Outcome:
    """Let all columns fall at two spacings (quick: without 60 frames a second at 100 m, at the coarser, once)."""
    ways = {name: way for name, way in WAYS.items() if not quick or "/s" not in name}
    falls = {
        f"{layers} layers": {
            name: dam.fall(dam.scene(layers, high, frame_time=frame), arch, number, high)
            for name, (high, frame) in ways.items()
        }
        for layers, number in ({20: 1} if quick else STARTS).items()
    }
    front, height = (4.0, 15.0) if quick else (1.5, 2.0)
    figures = [figure for name, group in falls.items() for figure in dam.compare(name, group, front, height)]
    return Outcome(figures, dam.columns(falls), lambda plot: dam.draw(plot, falls))


CASE = Case("scale", "One dam at any scale", run)
