"""How the bodies of a DualSPHysics case move: chains of moves, and pistons that make regular waves."""

import math
from collections.abc import Callable, Iterator
from xml.etree.ElementTree import Element

import numpy as np

from wavetank.formats.dualsphysics_drawing import Drawing, turning
from wavetank.foundation.errors import WavetankError

G = 9.81  # m/s^2
RATE = 60.0  # keyframes a second
MOST_MOVES = 1000  # in a chain

#: where what was at rest at a place [3] is at a time [s], in their axes: matrix [4, 4]
Course = Callable[[float], np.ndarray]


def courses(case: Element, drawing: Drawing, seconds: float, notes: list[str]) -> dict[int, Course]:
    """Return how the bound bodies move, by their mk."""
    found: dict[int, Course] = {}
    for row in case.findall("casedef/motion/objreal"):
        mk, chain = int(drawing.number(row.get("ref", "0"))), list(_chain(row, drawing, seconds, notes))
        if chain:
            found[mk] = _course(chain)
    for row in case.findall("casedef/motion/obj"):
        notes.append(f"motion in motion (<obj>, ref {row.get('ref', '')}) has no counterpart; it is left out.")
    paddles = case.find("execution/special/wavepaddles")
    for row in paddles if paddles is not None and paddles.get("active", "true") not in ("false", "0") else ():
        mkbound = row.find("mkbound")
        if row.tag == "piston" and mkbound is not None and row.find("_usefiledata") is None:
            found[int(drawing.number(mkbound.get("value", "0")))] = _piston(row, drawing, notes)
        else:
            notes.append(
                f"<{row.tag}> of the wave paddles is left out: only regular waves of a piston have a counterpart."
            )
    return found


def _chain(row: Element, drawing: Drawing, seconds: float, notes: list[str]) -> Iterator[tuple[float, float, Course]]:
    """Yield the moves of a body one after the other: start [s], end [s], and what a move does after its start."""
    begin = row.find("begin")
    if begin is None:
        return
    moves = {int(drawing.number(move.get("id", "0"))): move for move in row if move.tag != "begin"}
    at, time = int(drawing.number(begin.get("mov", "1"))), drawing.number(begin.get("start", "0"))
    finish = min(drawing.number(begin.get("finish", "1e9")), seconds)
    for _ in range(MOST_MOVES):
        move = moves.get(at)
        if move is None or time >= finish:
            return
        lasts = drawing.number(move.get("duration", "-1"))
        end = finish if lasts < 0.0 or str(move.tag) == "mvnull" else min(time + lasts, finish)
        course = _move(move, drawing)
        if course is not None:
            yield time, end, course
        elif move.tag not in ("wait", "mvnull"):
            notes.append(f"<{move.tag}> has no counterpart; what it moves stands still then.")
        at, time = int(drawing.number(move.get("next", "-1"))), end


def _course(chain: list[tuple[float, float, Course]]) -> Course:
    def at(time: float) -> np.ndarray:
        matrix = np.eye(4)
        for start, end, move in chain:
            if time > start:
                matrix = move(min(time, end) - start) @ matrix
        return matrix

    return at


def _move(row: Element, drawing: Drawing) -> Course | None:
    unit = math.pi / 180.0 if row.get("anglesunits", "degrees") == "degrees" else 1.0

    def numbers(name: str) -> np.ndarray:
        return drawing.vector(row.find(name))

    def turn_of(name: str, key: str) -> float:
        tag = row.find(name)
        return 0.0 if tag is None else drawing.number(tag.get(key, "0"))

    if row.tag == "mvrect":
        speed = numbers("vel")
        return lambda t: _shifted(speed * t)
    if row.tag == "mvrectace":
        speed, growth = numbers("velini"), numbers("ace")
        return lambda t: _shifted(speed * t + 0.5 * growth * t * t)
    if row.tag == "mvrectsinu":
        rate, way, phase = math.tau * numbers("freq"), numbers("ampl"), unit * numbers("phase")
        return lambda t: _shifted(way * (np.sin(rate * t + phase) - np.sin(phase)))
    ends = [numbers("axisp1"), numbers("axisp2")]
    if row.tag in ("mvrot", "mvrotace"):
        spin, faster = unit * turn_of("vel" if row.tag == "mvrot" else "velini", "ang"), unit * turn_of("ace", "ang")
        return lambda t: _turned(ends, spin * t + 0.5 * faster * t * t)
    if row.tag == "mvrotsinu":
        pace, most, begun = math.tau * turn_of("freq", "v"), unit * turn_of("ampl", "v"), unit * turn_of("phase", "v")
        return lambda t: _turned(ends, most * (math.sin(pace * t + begun) - math.sin(begun)))
    return None


def _piston(row: Element, drawing: Drawing, notes: list[str]) -> Course:
    """A piston whose waves have a height H: stroke S = H (2 k h + sinh 2 k h) / (2 (cosh 2 k h - 1)).

    First order, k of the dispersion relation omega^2 = g k tanh k h (Biesel and Suquet 1951; Dean and Dalrymple 1991).
    """

    def value(name: str, usual: float) -> float:
        tag = row.find(name)
        return usual if tag is None else drawing.number(tag.get("value", str(usual)))

    height, period, depth = value("waveheight", 0.0), value("waveperiod", 0.0), value("depth", 0.0)
    if not (height > 0.0 and period > 0.0 and depth > 0.0):
        raise WavetankError("a piston of regular waves needs a waveheight, a waveperiod and a depth above 0.")
    if value("waveorder", 1.0) != 1.0:
        notes.append("the piston's waves of second order have no counterpart; they are of first order.")
    number = min(2.0 * wave_number(period, depth) * depth, 60.0)  # deeper water knows no depth
    stroke = height * value("gainstroke", 1.0) * (number + math.sinh(number)) / (2.0 * (math.cosh(number) - 1.0))
    way = drawing.vector(row.find("pistondir")) if row.find("pistondir") is not None else np.eye(3)[0]
    way = way / max(float(np.linalg.norm(way)), 1e-12)
    start, lasts, ramp = value("start", 0.0), value("duration", 0.0), value("ramp", 0.0) * period
    phase = math.pi * value("phase", 0.0)

    def at(time: float) -> np.ndarray:
        t = max(time - start, 0.0) if lasts <= 0.0 else min(max(time - start, 0.0), lasts)
        grown = min(t / ramp, 1.0) if ramp > 0.0 else 1.0
        begun = math.sin(phase) if ramp <= 0.0 else 0.0  # without a ramp it starts where it is
        return _shifted(0.5 * stroke * way * (grown * math.sin(math.tau * t / period + phase) - begun))

    return at


def wave_number(period: float, depth: float) -> float:
    """Return k [1/m] of waves of a period [s] in water of a depth [m]: omega^2 = g k tanh k h, by Newton's method."""
    omega = math.tau / period
    k = omega * omega / G / math.sqrt(math.tanh(omega * omega * depth / G))
    for _ in range(30):
        th = math.tanh(k * depth)
        k -= (G * k * th - omega * omega) / (G * (th + k * depth * (1.0 - th * th)))
    return k


def _shifted(way: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = way
    return matrix


def _turned(ends: list[np.ndarray], angle: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = turning(ends[1] - ends[0], angle)
    matrix[:3, 3] = ends[0] - matrix[:3, :3] @ ends[0]
    return matrix
