"""A body that is let go out of its rest: how long it takes to swing, in heave and roll.

References: linear theory with added mass and waves in the very same tank (`linear_waves.py`; its added mass of a square
section is that of Newman 1977, Table 4.3, within 1 %). In 3-D, the sphere of Kramer et al. 2021 (10.3390/en14020269, a
public benchmark: 0.3 m across, half immersed, drop heights from 0.03 m): linear theory with the added mass and damping
of Hulme 1982 (10.1017/S0022112082001980, Table 1) gives its course.

Half a period is from the trough to the crest, as decay tests are read in towing tanks (ITTC 7.5-02-07-04.5, "Estimation
of roll damping"): the second passing of rest comes where the course is flat, and a millimetre decides it
(notebook/bodies.md, "From trough to crest"). That is given next to it. Each figure is the mean over starts of other
depths and lifts.
"""

import dataclasses
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
DEPTHS = (0.38, 0.39, 0.4, 0.41)  # m: of its water, for as many starts
LIFTS, TILTS = (0.02, 0.025), (0.1, 0.12)  # m, rad: where it is let go, at each of these depths
DROPS = (0.03, 0.035)  # m: of the sphere
RADIUS, SIDE, DEEP = 0.15, 2.1, 0.6  # m: of the sphere, its tank's edge and water
CALM = 1.0  # s, until it is let go
FINE = 0.01  # m: spacing around the barge
PERIOD = "trough to crest, over linear theory's"
PASSING = "first passing of rest to the second, over linear theory's"


@dataclasses.dataclass
class Decay:
    """How a body swings back to rest, from one start."""

    times: np.ndarray  # s since it was let go
    way: np.ndarray  # from rest, over where it began
    theory: np.ndarray  # the same by linear theory


def run(quick: bool, arch: str) -> Outcome:
    """Let a barge go in a plane, and a sphere in space (quick: at one depth, and no sphere)."""
    barges = [dataclasses.replace(BARGE, depth=depth) for depth in (DEPTHS[2:3] if quick else DEPTHS)]
    found = {
        "heave": [barge_decay(barge, FINE, arch, lift=lift) for barge in barges for lift in LIFTS],
        "roll": [barge_decay(barge, FINE, arch, tilt=tilt) for barge in barges for tilt in TILTS],
    }
    figures = [figure for name, decays in found.items() for figure in compare(f"2-D barge, {name}", decays)]
    if not quick:
        found["sphere"] = [sphere_decay(drop, 0.025, arch) for drop in DROPS]
        figures += compare("3-D sphere, heave", found["sphere"])
    series: dict[str, Sequence[float]] = {}
    for name, decays in found.items():
        series[f"time_{name}"] = decays[0].times.tolist()
        series |= {f"{name}_{number}": one.way.tolist() for number, one in enumerate(decays)}
        series[f"{name}_theory"] = decays[0].theory.tolist()

    def draw(plot: Any) -> None:
        for axis, (name, decays) in zip(plot.subplots(1, len(found), sharey=True), found.items(), strict=True):
            for one in decays:
                label = "measured" if one is decays[0] else None
                axis.plot(one.times, one.way, color=BLUE, lw=0.8, alpha=0.6, label=label)
            axis.plot(decays[0].times, decays[0].theory, color=RED, lw=1.2, label="linear theory")
            axis.set(title=name, xlabel="time [s]", ylabel="of where it was let go")
            axis.legend(frameon=False)
            tidy(axis)

    return Outcome(figures, series, draw)


def barge_decay(barge: Barge, spacing: float, arch: str, *, lift: float = 0.0, tilt: float = 0.0) -> Decay:
    """Let the barge go from a `lift` [m] or a `tilt` [rad]."""
    middle, keel = 0.5 * barge.length, barge.depth - barge.draft
    start = (middle, keel + 0.5 * barge.height + lift)
    box = Box(
        name="body",
        center=start,
        size=(barge.beam, barge.height),
        density=1000.0 * barge.ratio,
        held=True,
        rotation=tilt,
    )
    block = Block(lower=(0.0, 0.0), upper=(barge.length, barge.depth))
    tank = Tank(size=(barge.length, 2.0 * BARGE.depth))
    sim = Simulation(Scene(spacing=spacing, tank=tank, fluids=[block], solids=[box], foam=0.0), arch)
    rest = (sim.count * spacing**2 + barge.draft * barge.beam) / barge.length - barge.draft + 0.5 * barge.height
    times, way = let_go(sim, 1.6, rest, tilt)
    return Decay(times, way, decay(barge, spacing, times, rolls=tilt > 0.0))


def sphere_decay(drop: float, spacing: float, arch: str) -> Decay:
    """Let the sphere go from a `drop` [m] above where it floats."""
    ball = Sphere(name="body", center=(0.5 * SIDE, DEEP + drop, 0.5 * SIDE), radius=RADIUS, density=500.0, held=True)
    block = Block(lower=(0.0, 0.0, 0.0), upper=(SIDE, DEEP, SIDE))
    tank = Tank(size=(SIDE, DEEP + 0.3, SIDE))
    volume = 2.0 / 3.0 * math.pi * RADIUS**3
    sim = Simulation(Scene(spacing=spacing, tank=tank, fluids=[block], solids=[ball], foam=0.0), arch)
    times, way = let_go(sim, 1.2, (sim.count * spacing**3 + volume) / SIDE**2)
    return Decay(times, way, sphere_theory(times))


def let_go(sim: Simulation, seconds: float, rest: float, tilt: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] since the body was let go in calm water, and its height over `rest` [m], or angle, from 1 on."""
    sim.advance(CALM)
    body, times, ways = sim.bodies["body"], [0.0], [1.0]
    began = float(body.position[1]) - rest
    sim.hold("body", False)
    while times[-1] < seconds:
        sim.step()
        times.append(sim.time - CALM)
        angle = 2.0 * math.atan2(body.rotation[3], body.rotation[0])
        ways.append(angle / tilt if tilt > 0.0 else (float(body.position[1]) - rest) / began)
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


def compare(name: str, decays: Sequence[Decay]) -> list[Figure]:
    """Compare the times from trough to crest and between passings of rest, and the courses, with theory's."""
    halves, passes, offs = [], [], []
    for one in decays:
        (trough, crest), (own_trough, own_crest) = extremes(one.times, one.theory), extremes(one.times, one.way)
        halves.append((own_crest - own_trough) / (crest - trough))
        own, other = passings(one.times, one.way), passings(one.times, one.theory)
        passes.append((own[1] - own[0]) / (other[1] - other[0]) if len(own) > 1 else math.nan)
        until = one.times <= crest
        offs.append(float(np.sqrt(np.mean((one.way[until] - one.theory[until]) ** 2))))
    source = "Hulme 1982" if "sphere" in name else "linear potential flow"
    half, scatter, off = float(np.mean(halves)), float(np.std(halves)), float(np.mean(offs))
    return [
        Figure(f"{name}: {PERIOD}", half, "", 0.95, 1.05, "1", source),
        Figure(f"{name}: the same, standard deviation of {len(halves)} starts", scatter, ""),
        Figure(f"{name}: {PASSING}", float(np.mean(passes)), "", reference="1", source=source),
        Figure(f"{name}: rms off theory until the crest, of the lift", off, "", reference="0", source=source),
    ]


def extremes(times: np.ndarray, way: np.ndarray) -> tuple[float, float]:
    """Return when `way` is least [s], and when greatest after that, between samples on a parabola.

    Raises `ValueError` where it is at an end of the samples.
    """
    least = int(np.argmin(way))
    found = []
    for at in (least, least + int(np.argmax(way[least:]))):
        before, here, after = way[at - 1 : at + 2]
        found.append(
            float(times[at] + 0.5 * (times[at + 1] - times[at]) * (before - after) / (before - 2 * here + after))
        )
    return found[0], found[1]


def passings(times: np.ndarray, way: np.ndarray) -> list[float]:
    """Return when `way` passes zero [s], between samples on a straight line."""
    turns = np.nonzero(way[:-1] * way[1:] < 0.0)[0]
    return [float(times[k] + (times[k + 1] - times[k]) * way[k] / (way[k] - way[k + 1])) for k in turns]


CASE = Case("heave", "A floating body let go: heave and roll", run)
