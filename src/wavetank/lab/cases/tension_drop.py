"""Surface tension: a square of water without weight becomes a disc, and a drop drawn out oscillates.

Oscillation of the mode n = 2: omega^2 = n (n - 1) (n + 2) sigma / (rho R^3) = 8 sigma / (rho R^3) for a ball (Rayleigh
1879, Proc. R. Soc. 29, 71; Lamb, Hydrodynamics, Art. 275), n (n^2 - 1) sigma / (rho R^3) = 6 sigma / (rho R^3) for a
disc. The period is that between extremes of the difference of the second moments. The tension's factor in
`physics/terms/tension.py` was measured with this case: the period checks it over resolutions rather than predicts it.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block, Points
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

RADIUS, SIGMA, STRETCH = 0.01, 0.072, 1.1  # m, N/m, of the long axis at the start
SIDE = 0.01  # m, of the square
#: Five times that of water: what is left of the particles' own motion dies within an oscillation.
VISCOSITY = 0.005
#: Of the tension, of five squares: where their corners stay is chance, 0.6 to 5 % of the radius.
SHARES = (1.0, 0.98, 1.02, 0.96, 1.04)
LAMB = "Rayleigh 1879; Lamb"


def run(quick: bool, arch: str) -> Outcome:
    """Follow five squares and an ellipse, and an ellipsoid in 3-D (quick: three and without it, coarser)."""
    runs = [square(12 if quick else 20, share * SIGMA, arch) for share in (SHARES[:3] if quick else SHARES)]
    times, _, squares = runs[0]
    all_roundness = [roundness for _, roundness, _ in runs]
    spread = float(np.mean([roundness[len(times) // 2 :] for roundness in all_roundness]))  # they still swing
    figures = [Figure("squares: spread of the radius", spread, "%", None, 8.0 if quick else 5.0, "0", "least area")]
    curves = {}
    for dim, number in ((2, 16), (3, 10)):
        if quick and dim == 3:
            continue
        t, shape = oscillation(dim, number, arch)
        found = 100.0 * (periods(t, shape) - 1.0)
        figures.append(Figure(f"{dim}-D drop: period, error", _mean(found), "%", -20, 20, "0", LAMB))
        figures.append(Figure(f"{dim}-D drop: period, spread", float(np.ptp(found)) if len(found) else math.nan, "%"))
        curves[f"{dim}-D"] = (t, shape)

    def draw(plot: Any) -> None:
        left, middle, right = plot.subplots(1, 3)
        left.plot(1e3 * squares[0][:, 0], 1e3 * squares[0][:, 1], ".", color="0.7", ms=2)
        left.plot(1e3 * squares[1][:, 0], 1e3 * squares[1][:, 1], ".", color=BLUE, ms=2)
        left.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
        for roundness in all_roundness:
            middle.plot(times, roundness, color=BLUE, lw=1)
        middle.set(xlabel="time [s]", ylabel="spread of the radius [%]", ylim=(0, None))
        tidy(middle)
        for (name, (t, shape)), color in zip(curves.items(), (BLUE, RED), strict=False):
            right.plot(t, shape, color=color, label=name)
        right.axhline(0, color="k", lw=0.5)
        right.set(xlabel="time / Rayleigh's period", ylabel="difference of moments")
        right.legend(frameon=False)
        tidy(right)

    series = {"time": times, "roundness_percent": np.mean(all_roundness, axis=0).tolist()}
    for name, (t, shape) in curves.items():
        series |= {f"periods {name}": t, f"shape {name}": shape}
    return Outcome(figures, series, draw)


def _mean(values: np.ndarray) -> float:
    """Return the mean, not a number of none."""
    return float(values.mean()) if len(values) else math.nan


def square(number: int, tension: float, arch: str) -> tuple[list[float], list[float], list[np.ndarray]]:
    """Return times [s], spread of the radius over its mean [%], and the particles at start and end [m]."""
    block = Block(lower=(-SIDE / 2, -SIDE / 2), upper=(SIDE / 2, SIDE / 2))
    scene = Scene(
        spacing=SIDE / number,
        gravity=(0.0, 0.0),
        surface_tension=tension,
        dynamic_viscosity=VISCOSITY,
        fluids=[block],
        frame_time=1e-3,
        largest_substeps=100,
    )
    times, spread, shots = [], [], []
    sim = Simulation(scene, arch)
    for frame in sim.frames(0.2, 100.0):
        x = frame.positions.astype(float)
        x = x - x.mean(axis=0)
        r, sector = np.linalg.norm(x, axis=1), ((np.arctan2(x[:, 1], x[:, 0]) / math.pi + 1.0) * 12).astype(int) % 24
        edge = np.array([r[sector == k].max() for k in range(24)]) + 0.5 * scene.spacing
        times.append(sim.time)
        spread.append(100.0 * float(edge.std() / edge.mean()))
        shots.append(x)
    return times, spread, [shots[0], shots[-1]]


def oscillation(dim: int, number: int, arch: str) -> tuple[list[float], list[float]]:
    """Return times over the exact period and the relative difference of moments; `number` spacings make the radius."""
    d = RADIUS / number
    axes = [(np.arange(-number - 3, number + 3) + 0.5) * d] * dim
    x = np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, dim)
    scale = np.full(dim, STRETCH ** (-1.0 / (dim - 1)))
    scale[0] = STRETCH
    x = x[np.sum((x / scale) ** 2, axis=1) < RADIUS**2]
    exact = 2.0 * math.pi / math.sqrt((6.0 if dim == 2 else 8.0) * SIGMA / (1000.0 * RADIUS**3))
    scene = Scene(
        spacing=d,
        gravity=(0.0,) * dim,
        surface_tension=SIGMA,
        dynamic_viscosity=VISCOSITY,
        fluids=[Points(positions=x)],
        frame_time=exact / 60,
        largest_substeps=100,
    )
    sim = Simulation(scene, arch)
    times, shape = [], []
    for frame in sim.frames(2.0 * exact, 40.0 / exact):
        moment = np.var(frame.positions.astype(float), axis=0)
        times.append(sim.time / exact)
        shape.append(float((moment[0] - moment[1:].mean()) / moment.mean()))
    return times, shape


def periods(times: list[float], shape: list[float]) -> np.ndarray:
    """Return twice the time from each extreme of `shape` to the next one, empty with fewer than two.

    Extremes, not zeros: a lattice that is left in the middle of a drop shifts its mean shape. Each is the vertex of the
    parabola through three values of the smoothed curve.
    """
    smooth = np.convolve(shape, np.full(5, 0.2), "same")
    turns = []
    for k in range(4, len(smooth) - 4):  # the ends of the smoothed curve are those of the average, not of the drop
        before, after = smooth[k] - smooth[k - 1], smooth[k + 1] - smooth[k]
        if before * after < 0.0:
            turns.append(times[k] + 0.5 * (times[k + 1] - times[k]) * (before + after) / (before - after))
    return 2.0 * np.diff(turns)


CASE = Case("tension-drop", "Drops under surface tension", run)
