"""The first sloshing mode of a tank keeps the period of linear theory: L = 2 m, h = 1 m, in two dimensions.

Lamb, Hydrodynamics, art. 228: T = 2 pi / sqrt(g k tanh(k h)) with k = pi / L, 1.6713 s here. The amplitude of 0.06 m
makes the exact period longer by (k A)^2 / 8 or so, 0.1 %. The lattice starts displaced along the mode's own,
divergence-free field, at rest. The mode's amplitude is (2 / L) sum_i d^2 cos(k x_i), which no other mode enters.

The same wave, once whole, in a tank without ends that is one wavelength long, 2 L: its crest starts at the seam.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases import swing
from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LENGTH, DEPTH, AMPLITUDE, GRAVITY = 2.0, 1.0, 0.06, 9.81  # m, m, m, m/s^2
K = math.pi / LENGTH
PERIOD = 2.0 * math.pi / math.sqrt(GRAVITY * K * math.tanh(K * DEPTH))


def displaced(spacing: float, length: float = LENGTH) -> np.ndarray:
    """Return a filled lattice that flowed along the mode's displacement, [n, 2], by RK4 (area is kept)."""

    def field(x: np.ndarray) -> np.ndarray:
        scale = AMPLITUDE / math.sinh(K * DEPTH)
        across = -np.sin(K * x[:, 0]) * np.cosh(K * x[:, 1])
        up = np.cos(K * x[:, 0]) * np.sinh(K * x[:, 1])
        return scale * np.stack([across, up], axis=1)

    axes = [(np.arange(round(edge / spacing)) + 0.5) * spacing for edge in (length, DEPTH)]
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)
    step = 0.1
    for _ in range(10):
        k1 = field(x)
        k2 = field(x + 0.5 * step * k1)
        k3 = field(x + 0.5 * step * k2)
        k4 = field(x + step * k3)
        x = x + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return x


def run(quick: bool, arch: str) -> Outcome:
    """Follow the wave for four periods (quick: two, coarser)."""
    d, periods = (0.04, 2) if quick else (0.025, 4)
    start = displaced(d)
    t, a = follow(Tank(size=(LENGTH, 1.5)), start, d, periods, arch)
    period = swing.period(t, a)
    ring = Tank(size=(2.0 * LENGTH, 1.5), periodic=["x"])
    around = follow(ring, ring.within(displaced(d, 2.0 * LENGTH)), d, periods, arch)
    in_ring = 100.0 * (swing.period(*around) / PERIOD - 1.0)
    limit = 4.0 if quick else 2.0
    theory = f"{PERIOD:.4f} s"
    figures = [
        Figure("period, error", 100.0 * (period / PERIOD - 1.0), "%", -limit, limit, theory, "Lamb, art. 228"),
        Figure("period", period, "s", reference=theory, source="Lamb, art. 228"),
        Figure("period in a periodic tank, error", in_ring, "%", -limit, limit, theory, "Lamb, art. 228"),
        Figure("amplitude kept per period", 100.0 * swing.kept(t, a), "%", reference="100 %", source="no friction"),
    ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 1))
        left.plot(t, a, color=BLUE, label="computed")
        left.plot(t, AMPLITUDE * np.cos(2.0 * np.pi * t / PERIOD), color=RED, lw=0.8, ls="--", label="linear theory")
        left.set(xlabel="time [s]", ylabel="amplitude of the first mode [m]", ylim=(-1.15 * AMPLITUDE, 1.4 * AMPLITUDE))
        left.legend(frameon=False, loc="upper right", ncols=2)
        right.plot(start[:, 0], start[:, 1], ".", color=BLUE, ms=1)
        right.set(title="start", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        for axis in (left, right):
            tidy(axis)

    return Outcome(figures, {"time": t.tolist(), "amplitude": a.tolist()}, draw)


def follow(tank: Tank, start: np.ndarray, spacing: float, periods: int, arch: str) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the mode's amplitudes [m] of water that starts at these places."""
    sim = Simulation(Scene(spacing=spacing, tank=tank, fluids=[Points(positions=start)]), arch)
    times, amplitudes = [], []
    for frame in sim.frames((periods + 0.1) * PERIOD, 60.0):
        times.append(sim.time)
        mode = float(np.cos(K * frame.positions[:, 0].astype(float)).sum())
        amplitudes.append(2.0 / tank.size[0] * spacing * spacing * mode)
    return np.array(times), np.array(amplitudes)


CASE = Case("standing-wave", "First sloshing mode", run)
