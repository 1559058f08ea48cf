"""Figures of quick runs that are out of their bounds: the range they were seen in, why, and since when.

The full runs reach their bounds. An entry whose reason has gone is removed: the figure passes, or it is an error again.
"""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Known:
    """A figure that may lie between `low` and `high`, in its own unit."""

    low: float
    high: float
    since: str  # date on which it was entered or last measured
    why: str


PLANE = "twenty layers in a plane; the full run has"
KNOWN = {
    "elliptical-drop: area at tau = 1, error": Known(
        -4.0, 15.0, "2026-11-24", "a hull of few particles; the full run has 2 %"
    ),
    "buoyancy: 2-D, 0.5: v_rms at rest": Known(
        0.0, 0.06, "2026-11-24", "a box of few particles; the full run has 0.003 m/s at most (docs/bodies.md)"
    ),
    "buoyancy: 2-D, 8: v_rms at rest": Known(
        0.0, 0.03, "2026-11-24", "a box of few particles; the full run has 0.001 m/s at most (docs/bodies.md)"
    ),
    "lobovsky: 300 mm: speed of the front, 1 < T < 2.4": Known(1.4, 1.65, "2026-11-27", f"{PLANE} 1.56"),
    "lobovsky: 300 mm: at the far wall": Known(2.4, 2.7, "2026-11-27", f"{PLANE} 2.54"),
    "torricelli: slot of 10 d: flow, error": Known(
        -20.0, -6.0, "2026-11-29", "edges of a slot count as half-spaces, here as in the full run"
    ),
    "pipe: 2-D, 16 layers, 1 m/s^2: mean speed, error": Known(
        -45.0, -6.0, "2026-11-29", "calming at solids slows slow water, here as in the full run"
    ),
    "rayleigh-taylor: d = 20 mm: growth rate, error": Known(
        -50.0,
        -10.0,
        "2026-11-29",
        "the grid gives particles among those of another fluid too little, as in the full run",
    ),
    "jurin: 8 d apart, 30 degrees: rise, error": Known(
        -70.0, -15.0, "2026-11-29", "a film costs less than a cap, as in the full run"
    ),
    "submerged-inlet: mouth of 5 d: energy in the pool, of what was brought": Known(
        1.2, 60.0, "2026-11-29", "the pressure grid knows no source, here as in the full run"
    ),
}


def known(case: str, figure: str, value: float) -> str:
    """Return why a figure is out of its bounds and since when; an empty text if that is not known."""
    entry = KNOWN.get(f"{case}: {figure}")
    return f"{entry.why}, since {entry.since}" if entry is not None and entry.low <= value <= entry.high else ""
