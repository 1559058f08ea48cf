"""Line icons: the paths that tools declare, in the language of SVG, as lines that a window can draw."""

import functools

from svg.path import Arc, CubicBezier, Move, parse_path

TURNS = 10  # pieces of a curve, and of half a circle

#: the icons that are nobody's tool
PLAY, PAUSE = "M7 4l13 8-13 8z", "M8 5v14M16 5v14"
STEP, BACK = "M6 6l9 6-9 6zM18 6v12", "M11 6l-7 6 7 6zM20 6l-7 6 7 6z"
RESET, BOOKMARK = "M4 5v5h5M4.600 10a8 8 0 1 1-.4 4", "M7 3h10v18l-5-4-5 4z"
DROP = "M12 3c4 5 6 8 6 11a6 6 0 0 1-12 0c0-3 2-6 6-11z"


@functools.cache
def lines(path: str) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Return an SVG path as lines in its own units."""
    done: list[list[complex]] = []
    for part in parse_path(path):
        if isinstance(part, Move):
            done.append([part.end])
            continue
        if isinstance(part, Arc):
            pieces = max(2, round(abs(part.delta) / 180.0 * TURNS))
        else:
            pieces = TURNS if isinstance(part, CubicBezier) else 1
        done[-1] += [part.point(n / pieces) for n in range(1, pieces + 1)]
    return tuple(tuple((place.real, place.imag) for place in line) for line in done if len(line) > 1)
