"""A heavy fluid on one half as dense: how fast a wave of their interface grows, in two dimensions.

Two inviscid fluids, each a layer h deep between two walls, the heavy one above (Taylor 1950, 10.1098/rspa.1950.0052;
Lamb, Hydrodynamics, art. 231): a(t) cos(k x) grows as exp(s t), with

    s^2 = A g k tanh(k h),    A = (rho_2 - rho_1) / (rho_2 + rho_1) = 1 / 3

It starts at a_0 with the speed s a_0, all particles moved by the flow of that wave, and is read from three to twelve
times a_0, while k a is below a half. The amplitude is that of what stands over x: -(2 h) times the mean of cos(k x)
over the heavy particles. The bound is 10 %, and three spacings tell whether it converges. Known: the pressure grid
gives a particle among those of another fluid too little.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.materials import Material
from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LENGTH, DEEP, GRAVITY = 0.4, 0.2, 9.81  # m, m of each layer, m/s^2
K, ATWOOD = 2.0 * math.pi / LENGTH, 1.0 / 3.0
RATE = math.sqrt(ATWOOD * GRAVITY * K * math.tanh(K * DEEP))  # 1/s
START, FIRST, LAST = 0.0025, 3.0, 12.0  # m; times that, where it is read
SOURCE = "Taylor 1950"


def follow(spacing: float, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and amplitudes [m] until the last that is read, or twice as long as that should take."""
    fluids = [
        Block(lower=(0.0, 0.0), upper=(LENGTH, DEEP), material="light"),
        Block(lower=(0.0, DEEP), upper=(LENGTH, 2.0 * DEEP), material="heavy"),
    ]
    scene = Scene(
        spacing=spacing,
        gravity=(0.0, -GRAVITY),
        tank=Tank(size=(LENGTH, 2.0 * DEEP)),
        materials=[Material(name="light", density=500.0), Material(name="heavy", density=1000.0)],
        fluids=fluids,
        foam=0.0,
    )
    sim = Simulation(scene, arch)
    heavy = sim.frame().rest_densities > 999.0
    x = sim.positions.astype(float)
    side = np.sign(x[:, 1] - DEEP)
    beyond = np.abs(2.0 * DEEP * (side > 0.0) - x[:, 1])  # from the wall that bounds the layer
    flow = np.stack(
        [side * np.sin(K * x[:, 0]) * np.cosh(K * beyond), np.cos(K * x[:, 0]) * np.sinh(K * beyond)], axis=1
    ) / math.sinh(K * DEEP)
    sim.positions = (x + START * flow).astype(np.float32)
    sim.velocities = (RATE * START * flow).astype(np.float32)
    times, sizes = [0.0], [START]
    while sizes[-1] < LAST * START and times[-1] < 2.0 * math.log(LAST) / RATE:
        sim.advance(0.05 / RATE)
        times.append(sim.time)
        sizes.append(-2.0 * DEEP * float(np.cos(K * sim.positions[heavy, 0].astype(float)).mean()))
    return np.array(times), np.array(sizes)


def rate(times: np.ndarray, sizes: np.ndarray) -> float:
    """Return the growth rate [1/s] between `FIRST` and `LAST` times the start; NaN where it did not grow so far."""
    read = (sizes > FIRST * START) & (sizes < LAST * START)
    return float(np.polyfit(times[read], np.log(sizes[read]), 1)[0]) if np.sum(read) > 2 else math.nan


def run(quick: bool, arch: str) -> Outcome:
    """Let the wave grow at three spacings (quick: at the coarsest)."""
    found = {spacing: follow(spacing, arch) for spacing in ((0.02,) if quick else (0.02, 0.01, 0.00625))}
    figures = [
        Figure(
            f"d = {1000.0 * spacing:g} mm: growth rate, error",
            100.0 * (rate(*grown) / RATE - 1.0),
            "%",
            -10.0,
            10.0,
            f"{RATE:.3g} /s",
            SOURCE,
        )
        for spacing, grown in found.items()
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (spacing, (times, sizes)), color in zip(found.items(), (BLUE, "0.5", "0.1"), strict=False):
            axis.plot(times, sizes / START, color=color, label=f"d = {1000.0 * spacing:g} mm")
        t = np.linspace(0.0, math.log(LAST) / RATE)
        axis.plot(t, np.exp(RATE * t), color=RED, lw=0.8, ls="--", label="linear theory")
        axis.set(xlabel="time [s]", ylabel="amplitude, over the first", yscale="log")
        axis.legend(frameon=False)
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for spacing, (times, sizes) in found.items():
        series |= columns(spacing, time=times, amplitude=sizes)
    return Outcome(figures, series, draw)


CASE = Case("rayleigh-taylor", "A heavy fluid on a light one", run)
