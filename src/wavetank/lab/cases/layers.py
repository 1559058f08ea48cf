"""Two fluids at rest, the heavy one below: they stay where they are, at small and at large ratios of density.

Reference: hydrostatics. The interface is where the lower fluid was filled to; no particle crosses it by more than two
spacings. v_rms is weighted with mass, as the kinetic energy is. And the heavy one above, by a half: what rolls over
(Rayleigh and Taylor's instability) ends in the same layers, of the least potential energy.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

LOWER, UPPER, WIDTH = 0.3, 0.6, 1.0  # m


def scene(ratio: float, spacing: float, lower: str = "heavy", upper: str = "light") -> Scene:
    """Return water under a fluid `ratio` times lighter, or the other way round, in a 2-D tank."""
    table = {
        "spacing": spacing,
        "tank": {"size": [WIDTH, 0.9]},
        "materials": [{"name": "heavy", "density": 1000.0}, {"name": "light", "density": 1000.0 / ratio}],
        "fluids": [
            {"lower": [0, 0], "upper": [WIDTH, LOWER], "material": lower},
            {"lower": [0, LOWER], "upper": [WIDTH, UPPER], "material": upper},
        ],
    }
    result: Scene = Scene.parse(table)
    return result


def overturned(spacing: float, seconds: float, arch: str) -> list[Figure]:
    """Let a fluid that is half as heavy again lie on the other one, and look at how they lie in the end."""
    sim = Simulation(scene(1.5, spacing, "light", "heavy"), arch)
    sim.advance(seconds)
    frame = sim.frame()
    y, heavy = frame.positions[:, 1].astype(float), frame.rest_densities > 999.0
    interface = np.sort(y)[heavy.sum() - 1]
    over = np.where(heavy, y - interface, interface - y) / spacing
    wrong, mean = 100.0 * float(np.mean(over > 1.0)), float(2.0 * y[heavy].mean() / LOWER)
    name, source = f"heavy above light, {seconds:g} s", "hydrostatics"
    return [
        Figure(f"{name}: share on the wrong side", wrong, "%", None, 0.1, "0", source),
        Figure(f"{name}: lower layer, twice its mean height", mean, "", 0.975, 1.02, "1", source),
    ]


def run(quick: bool, arch: str) -> Outcome:
    """Let ratios of 1.25 and 100 stand for 4 s (quick: 2 s, coarser)."""
    d, seconds = (0.05, 2.0) if quick else (0.02, 4.0)
    figures, series, last = [], {}, {}
    for ratio in (1.25, 100.0):
        sim = Simulation(scene(ratio, d), arch)
        times, rms = [], []
        for frame in sim.frames(seconds, 20.0):
            times.append(sim.time)
            speed = np.linalg.norm(frame.velocities.astype(float), axis=1)
            rms.append(float(np.sqrt(np.average(speed**2, weights=frame.rest_densities))))
        x, heavy = frame.positions.astype(float), frame.materials == 1
        over = np.where(heavy, x[:, 1] - LOWER, LOWER - x[:, 1]) / d
        mean = float(2.0 * x[heavy, 1].mean() / LOWER)
        name = f"ratio {ratio:g}"
        figures += [
            Figure(f"{name}: farthest across the interface", float(over.max()), "d", None, 2.0, "0", "hydrostatics"),
            Figure(f"{name}: lower layer, twice its mean height", mean, "", 0.975, 1.01, "1", "hydrostatics"),
            Figure(f"{name}: v_rms at the end", max(rms[-5:]), "m/s", None, 0.03 if quick else 0.02, "0", "rest"),
        ]
        series["time"], series[f"v_rms_{ratio:g}"] = times, rms
        last[name] = (x, heavy)
    figures += overturned(0.05 if quick else 0.025, 30.0 if quick else 60.0, arch)

    def draw(plot: Any) -> None:
        panels = plot.subplots(1, 3)
        for panel, (name, (x, heavy)) in zip(panels[:2], last.items(), strict=True):
            for chosen, color in ((heavy, BLUE), (~heavy, RED)):
                panel.plot(x[chosen, 0], x[chosen, 1], ".", color=color, ms=2)
            panel.axhline(LOWER, color="k", lw=0.6)
            panel.set(title=name, aspect="equal", xlabel="x [m]")
        for ratio, color in ((1.25, BLUE), (100.0, RED)):
            panels[2].semilogy(series["time"][1:], series[f"v_rms_{ratio:g}"][1:], color=color, label=f"{ratio:g}")
        panels[2].set(xlabel="time [s]", ylabel="v_rms [m/s]")
        panels[2].legend(frameon=False, title="ratio")
        tidy(panels[2])

    return Outcome(figures, series, draw)


CASE = Case("layers", "Two fluids in layers", run)
