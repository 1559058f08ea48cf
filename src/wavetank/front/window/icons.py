"""Line icons: the paths that tools declare, in the language of SVG, as lines that a window can draw."""

import functools
import math
import re

Line = list[tuple[float, float]]
TURNS = 10  # pieces of a curve
TOKEN = re.compile(r"[A-Za-z]|[-+]?(?:\d+\.\d*|\.\d+|\d+)")

#: the icons that are nobody's tool
PLAY, PAUSE = "M7 4l13 8-13 8z", "M8 5v14M16 5v14"
STEP, BACK = "M6 6l9 6-9 6zM18 6v12", "M11 6l-7 6 7 6zM20 6l-7 6 7 6z"
RESET, BOOKMARK = "M4 5v5h5M4.600 10a8 8 0 1 1-.4 4", "M7 3h10v18l-5-4-5 4z"
DROP = "M12 3c4 5 6 8 6 11a6 6 0 0 1-12 0c0-3 2-6 6-11z"


@functools.cache
def lines(path: str) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Return an SVG path (commands M L H V C S A Z, large and small) as lines in its own units."""
    tokens = TOKEN.findall(path)
    done: list[Line] = []
    now, start, handle, letter = (0.0, 0.0), (0.0, 0.0), (0.0, 0.0), ""
    k = 0

    def take(n: int) -> list[float]:
        nonlocal k
        k += n
        return [float(token) for token in tokens[k - n : k]]

    while k < len(tokens):
        if tokens[k].isalpha():
            letter = tokens[k]
            k += 1
        kind, (ox, oy) = letter.upper(), now if letter.islower() else (0.0, 0.0)
        bend: tuple[float, float] | None = None
        if kind == "M":
            x, y = take(2)
            now = start = (x + ox, y + oy)
            done.append([now])
            letter = "l" if letter == "m" else "L"  # what follows without a letter are lines
        elif kind == "Z":
            done[-1].append(start)
            now = start
            done.append([now])
        elif kind == "L":
            x, y = take(2)
            now = (x + ox, y + oy)
            done[-1].append(now)
        elif kind in "HV":
            (value,) = take(1)
            now = (value + ox, now[1]) if kind == "H" else (now[0], value + oy)
            done[-1].append(now)
        elif kind in "CS":
            if kind == "C":
                x, y = take(2)
                first = (x + ox, y + oy)
            else:
                first = (2 * now[0] - handle[0], 2 * now[1] - handle[1])
            x2, y2, x, y = take(4)
            bend, end = (x2 + ox, y2 + oy), (x + ox, y + oy)
            done[-1] += _cubic(now, first, bend, end)
            now = end
        elif kind == "A":
            radius, _, _, large, sweep, x, y = take(7)
            end = (x + ox, y + oy)
            done[-1] += _arc(now, end, radius, bool(large), bool(sweep))
            now = end
        else:
            raise ValueError(f"{letter!r} in {path!r} is not a command that icons have")
        handle = bend or now
    return tuple(tuple(line) for line in done if len(line) > 1)


def _cubic(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]) -> Line:
    result: Line = []
    for n in range(1, TURNS + 1):
        t = n / TURNS
        s = 1.0 - t
        weights = (s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t)
        points = (a, b, c, d)
        result.append(tuple(sum(w * p[i] for w, p in zip(weights, points, strict=True)) for i in (0, 1)))  # type: ignore[arg-type]
    return result


def _arc(a: tuple[float, float], b: tuple[float, float], radius: float, large: bool, sweep: bool) -> Line:
    """Points of a circle's arc from `a` to `b`; one that is too small grows, as SVG says."""
    across = math.dist(a, b)
    radius = max(radius, 0.5 * across)
    middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
    away = math.sqrt(max(0.0, radius**2 - 0.25 * across**2)) * (1.0 if large != sweep else -1.0)
    cx = middle[0] - away * (b[1] - a[1]) / max(across, 1e-9)
    cy = middle[1] + away * (b[0] - a[0]) / max(across, 1e-9)
    first, last = math.atan2(a[1] - cy, a[0] - cx), math.atan2(b[1] - cy, b[0] - cx)
    if sweep and last < first:
        last += 2 * math.pi
    if not sweep and last > first:
        last -= 2 * math.pi
    pieces = max(2, round(abs(last - first) / (math.pi / TURNS)))
    turns = [first + (last - first) * n / pieces for n in range(1, pieces + 1)]
    return [(cx + radius * math.cos(turn), cy + radius * math.sin(turn)) for turn in turns]
