"""A body that is let go out of its rest: how long it takes to swing, in heave and roll.

References: linear theory with added mass and waves in the very same tank (`linear_waves.py`; its added mass of a square
section is that of Newman 1977, Table 4.3, within 1 %). In 3-D, the sphere of Kramer et al. 2021 (10.3390/en14020269, a
public benchmark: 0.3 m across, half immersed, drop heights from 0.03 m): linear theory with the added mass and damping
of Hulme 1982 (10.1017/S0022112082001980, Table 1) gives its course.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, measured
from wavetank.lab.cases.linear_waves import Barge, decay
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box, Sphere

BARGE = Barge(beam=0.4, height=0.2, ratio=0.5, length=4.0, depth=0.4)
LIFT, TILT = 0.02, 0.1  # m, rad: where it is let go
RADIUS, DROP, SIDE, DEEP = 0.15, 0.03, 2.1, 0.6  # m: of the sphere, its tank's edge and water
CALM = 1.0  # s, until it is let go
PERIOD = "half a period, over linear theory's"


def run(quick: bool, arch: str) -> Outcome:
    """Let a barge go in a plane, and a sphere in space (quick: coarser, and no sphere)."""
    figures: list[Figure] = []
    series: dict[str, Sequence[float]] = {}
    for rolls in (False, True):
        name = "roll" if rolls else "heave"
        times, way = barge_decay(0.02 if quick else 0.01, 1.6, arch, rolls=rolls)
        theory = decay(BARGE, 0.02 if quick else 0.01, times, rolls=rolls)
        figures += compare(f"2-D barge, {name}", times, way, theory)
        series |= {f"time_{name}": times.tolist(), name: way.tolist(), f"{name}_theory": theory.tolist()}
    if not quick:
        times, way = sphere_decay(0.025, 1.2, arch)
        theory = sphere_theory(times)
        figures += compare("3-D sphere, heave", times, way, theory)
        series |= {"time_sphere": times.tolist(), "sphere": way.tolist(), "sphere_theory": theory.tolist()}

    def draw(plot: Any) -> None:
        names = [name for name in ("heave", "roll", "sphere") if name in series]
        for axis, name in zip(plot.subplots(1, len(names), sharey=True), names, strict=True):
            axis.plot(series[f"time_{name}"], series[name], color=BLUE, label="measured")
            axis.plot(series[f"time_{name}"], series[f"{name}_theory"], color=RED, lw=1.0, label="linear theory")
            axis.set(title=name, xlabel="time [s]", ylabel="of where it was let go")
            axis.legend(frameon=False)
            tidy(axis)

    return Outcome(figures, series, draw)


def barge_decay(spacing: float, seconds: float, arch: str, *, rolls: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] since the barge was let go, and how far it is from rest, over where it began."""
    middle, keel = 0.5 * BARGE.length, BARGE.depth - BARGE.draft
    start = (middle, keel + 0.5 * BARGE.height + (0.0 if rolls else LIFT))
    box = Box(
        name="body", center=start, size=(BARGE.beam, BARGE.height), density=1000.0 * BARGE.ratio, held=True,
        rotation=TILT if rolls else 0.0,
    )  # fmt: skip
    block = Block(lower=(0.0, 0.0), upper=(BARGE.length, BARGE.depth))
    tank = Tank(size=(BARGE.length, 2.0 * BARGE.depth))
    sim = Simulation(Scene(spacing=spacing, tank=tank, fluids=[block], solids=[box], foam=0.0), arch)
    sim.advance(CALM)
    body, times, ways = sim.bodies["body"], [0.0], [1.0]
    rest = (sim.count * spacing**2 + BARGE.draft * BARGE.beam) / BARGE.length - BARGE.draft + 0.5 * BARGE.height
    began = float(body.position[1]) - rest
    sim.hold("body", False)
    while times[-1] < seconds:
        sim.step()
        times.append(sim.time - CALM)
        angle = 2.0 * math.atan2(body.rotation[3], body.rotation[0])
        ways.append(angle / TILT if rolls else (float(body.position[1]) - rest) / began)
    return np.array(times), np.array(ways)


def sphere_decay(spacing: float, seconds: float, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the same of the sphere."""
    ball = Sphere(name="body", center=(0.5 * SIDE, DEEP + DROP, 0.5 * SIDE), radius=RADIUS, density=500.0, held=True)
    block = Block(lower=(0.0, 0.0, 0.0), upper=(SIDE, DEEP, SIDE))
    tank = Tank(size=(SIDE, DEEP + 0.3, SIDE))
    volume = 2.0 / 3.0 * math.pi * RADIUS**3
    sim = Simulation(Scene(spacing=spacing, tank=tank, fluids=[block], solids=[ball], foam=0.0), arch)
    sim.advance(CALM)
    body, times, ways = sim.bodies["body"], [0.0], [1.0]
    rest = (sim.count * spacing**3 + volume) / SIDE**2
    began = float(body.position[1]) - rest
    sim.hold("body", False)
    while times[-1] < seconds:
        sim.step()
        times.append(sim.time - CALM)
        ways.append((float(body.position[1]) - rest) / began)
    return np.array(times), np.array(ways)


def sphere_theory(times: np.ndarray) -> np.ndarray:
    """Return how far a sphere that is let go is from where it floats half immersed, over where it began.

    By the added mass A and damping B of all frequencies, so that waves are what they are from the first moment on
    (Cummins 1962, "The impulse response function and ship motions"): with C the stiffness and m the mass,

        x(t) = 2 / pi int_0^oo Re((i w (m + A) + B) / (C - w^2 (m + A) + i w B)) cos(w t) dw

    in open water, which lies as much lower than in the end as a sphere that is held up takes less room.
    """
    table = measured("hulme_hemisphere_heave.csv")
    w = np.arange(1, 100_000) * 1e-3  # over sqrt(g / a); masses are over that of the displaced water
    ratio, last = w**2, {name: float(column[-1]) for name, column in table.items()}
    far = np.minimum(1.0, last["Ka"] / ratio)  # beyond the table: towards a sphere that is suddenly moved
    added = 0.5 - far * (0.5 - np.interp(ratio, table["Ka"], table["A"]))
    damping = w * far**3 * np.interp(ratio, table["Ka"], table["B"])
    stiffness = 1.5 - ratio * (1.0 + added)
    course = ((1j * w * (1.0 + added) + damping) / (stiffness + 1j * w * damping)).real
    scaled = times * math.sqrt(9.81 / RADIUS)
    way = np.array([2.0 / math.pi * 1e-3 * float(course @ np.cos(w * t)) for t in scaled])
    lower = math.pi * RADIUS**2 / (SIDE**2 - math.pi * RADIUS**2)
    return (1.0 + lower) * way - lower


def compare(name: str, times: np.ndarray, way: np.ndarray, theory: np.ndarray) -> list[Figure]:
    """Compare the time from the first passing of rest to the second, and both courses until then."""
    own, other = passings(times, way), passings(times, theory)
    ratio = (own[1] - own[0]) / (other[1] - other[0]) if len(own) > 1 else math.nan
    until = times <= other[1]
    off = float(np.sqrt(np.mean((way[until] - theory[until]) ** 2)))
    source = "Hulme 1982" if "sphere" in name else "linear potential flow"
    return [
        Figure(f"{name}: {PERIOD}", ratio, "", 0.95, 1.05, "1", source),
        Figure(f"{name}: rms off theory until then, of the lift", off, "", reference="0", source=source),
    ]


def passings(times: np.ndarray, way: np.ndarray) -> list[float]:
    """Return when `way` passes zero [s], between samples on a straight line."""
    turns = np.nonzero(way[:-1] * way[1:] < 0.0)[0]
    return [float(times[k] + (times[k + 1] - times[k]) * way[k] / (way[k] - way[k + 1])) for k in turns]


CASE = Case("heave", "A floating body let go: heave and roll", run)
