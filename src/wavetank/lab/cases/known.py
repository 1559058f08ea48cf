"""Figures of quick runs that are known to be out of their bounds: how far, and why. The full runs reach theirs."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Known:
    """A figure that may lie between `low` and `high`, in its own unit, and what is known about it."""

    low: float
    high: float
    why: str


KNOWN = {
    "elliptical-drop: area at tau = 1, error": Known(-4.0, 15.0, "a hull of few particles; the full run has 2 %"),
    "buoyancy: 2-D, 0.5: v_rms at rest": Known(0.0, 0.06, "docs/bodies.md, What it is compared with"),
    "buoyancy: 2-D, 8: v_rms at rest": Known(0.0, 0.03, "docs/bodies.md, What it is compared with"),
    "lobovsky: 300 mm: speed of the front, 1 < T < 2.4": Known(
        1.4, 1.65, "twenty layers in a plane; the full run has 1.56"
    ),
    "lobovsky: 300 mm: at the far wall": Known(2.4, 2.7, "twenty layers in a plane; the full run has 2.54"),
    "heave: 2-D barge, heave: half a period, over linear theory's": Known(
        0.8, 1.35, "docs/bodies.md, What it is compared with"
    ),
    "heave: 2-D barge, roll: half a period, over linear theory's": Known(
        0.9, 1.1, "docs/bodies.md, What it is compared with"
    ),
}


def known(case: str, figure: str, value: float) -> str:
    """Return what is known about a figure that is out of its bounds, an empty text where that is news."""
    entry = KNOWN.get(f"{case}: {figure}")
    return entry.why if entry is not None and entry.low <= value <= entry.high else ""
