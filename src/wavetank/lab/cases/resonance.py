"""A half-filled tank is swayed at its first sloshing period for eight periods, in two dimensions, and then let go.

Linear theory (Faltinsen and Timokha 2009, "Sloshing", ch. 5): the level is q(t) cos(k x), k = pi / L, where

    q'' + w^2 q = F sin(w t),    w^2 = g k tanh(k h),    F = (4 / pi) tanh(k h) a

while the tank is accelerated by a sin(w t), so that q = F (sin(w t) - w t cos(w t)) / (2 w^2) from rest: it grows by
pi F / w^2 in a period. The sway is so weak that (k q)^2 / 8 stays below 0.3 %. Bounds: 0.97 of the height a period, and
of the forced height what is left of it where each period keeps 0.97. The mode is (2 / L) sum_i d^2 cos(k x_i), as in
`standing_wave.py`. Known: calming and XSPH take part of what is lost.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases import swing
from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.forces.sway import Sway
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LENGTH, DEPTH, GRAVITY = 1.0, 0.5, 9.81  # m, m, m/s^2
K = math.pi / LENGTH
OMEGA = math.sqrt(GRAVITY * K * math.tanh(K * DEPTH))  # 1/s
PERIOD = 2.0 * math.pi / OMEGA  # s
GROWTH = 0.006  # m a period
ACCELERATION = GROWTH * OMEGA**2 / (4.0 * math.tanh(K * DEPTH))  # m/s^2
KEPT = 0.97  # of its height, a period
SOURCE = "Faltinsen and Timokha 2009"


def theory(t: np.ndarray) -> np.ndarray:
    """Return q [m] under the sway at times `t` [s]."""
    phase = OMEGA * t
    return np.asarray(GROWTH / (2.0 * math.pi) * (np.sin(phase) - phase * np.cos(phase)))


def left_of(periods: int) -> float:
    """Return the share of the forced height that is left where each period keeps `KEPT` of it."""
    return sum(KEPT**number for number in range(periods)) / periods


def follow(layers: int, forced: int, free: float, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the mode's height [m] over so many forced periods and then free ones."""
    sway = Sway(acceleration=(ACCELERATION, 0.0), frequency=1.0 / PERIOD)
    tank, block = Tank(size=(LENGTH, 2.0 * DEPTH)), Block(lower=(0.0, 0.0), upper=(LENGTH, DEPTH))
    scene = Scene(spacing=DEPTH / layers, tank=tank, fluids=[block], forces=[sway], foam=0.0)
    sim, found = Simulation(scene, arch), []
    for periods in (forced, free):
        for frame in sim.frames(periods * PERIOD, 60.0):
            mode = float(np.cos(K * frame.positions[:, 0].astype(float)).sum())
            found.append((sim.time, 2.0 / LENGTH * scene.spacing**2 * mode))
        sim.forces = []
    times, modes = np.array(found).T
    return times, modes


def run(quick: bool, arch: str) -> Outcome:
    """Sway for eight periods and watch for three more, at two spacings (quick: three and two at the coarser)."""
    forced, free = (3, 2.2) if quick else (8, 3.2)
    found = {layers: follow(layers, forced, free, arch) for layers in ((20,) if quick else (20, 40))}
    figures = []
    low, least = (75.0, 90.0) if quick else (100.0 * left_of(forced), 100.0 * KEPT)
    for layers, (t, q) in found.items():
        alone = t > forced * PERIOD
        grown = 100.0 * float(np.abs(q[~alone]).max() / np.abs(theory(t[~alone])).max())
        kept, off = 100.0 * swing.kept(t[alone], q[alone]), 100.0 * (swing.period(t[alone], q[alone]) / PERIOD - 1.0)
        name = f"{layers} layers"
        figures += [
            Figure(
                f"{name}: height after {forced} forced periods", grown, "% of theory's", low, 103.0, "100 %", SOURCE
            ),
            Figure(f"{name}: height kept a free period", kept, "%", least, 101.0, "100 %", "no friction"),
            Figure(f"{name}: free period, error", off, "%", -4.0, 4.0, f"{PERIOD:.4f} s", "Lamb, art. 228"),
        ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        for (layers, (t, q)), color in zip(found.items(), (BLUE, "0.5"), strict=False):
            axis.plot(t / PERIOD, q, color=color, label=f"{layers} layers")
        t = next(iter(found.values()))[0]
        t = t[t <= forced * PERIOD]
        axis.plot(t / PERIOD, theory(t), color=RED, lw=0.8, ls="--", label="linear theory, no friction")
        axis.axvline(forced, color="0.5", lw=0.8)
        axis.set(xlabel="time [periods]; let go at the line", ylabel="height of the first mode [m]")
        axis.legend(frameon=False, loc="upper left")
        tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for layers, (t, q) in found.items():
        series |= columns(layers, time=t, mode=q)
    return Outcome(figures, series, draw)


CASE = Case("resonance", "A tank swayed at its sloshing period", run)
