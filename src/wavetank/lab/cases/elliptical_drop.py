"""A free disc of water is pulled into an ellipse: two dimensions, no walls, no gravity.

Monaghan 1994, J. Comput. Phys. 110, 399, doi:10.1006/jcph.1994.1034: radius 1, v = (-A0 x, A0 y) at the start. The flow
stays linear in space, dA/dtau = A^2 (a^4 - 1) / (a^4 + 1), da/dtau = -a A, with tau = A0 t; the half axes are a and
b = 1 / a, and b(1) = 2.2755. `data/` holds the solution.

b is measured twice: from the second moment (a full ellipse has <y^2> = b^2 / 4) and as the farthest particle and half a
spacing. The area is that of the convex hull of the particles, each a disc of diameter d. The disc is cut out of settled
water: the rows of a lattice would stay rows, and swell (`packing.py`).
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, measured
from wavetank.lab.cases.packing import settled
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

SOURCE = "Monaghan 1994"
BOX = 2.4  # m: edge of the settled water that the disc is cut out of


def run(quick: bool, arch: str) -> Outcome:
    """Pull the disc until tau = 1, A0 = 1 / s (quick: coarser): of settled water, and of a square lattice."""
    d = 0.05 if quick else 0.02
    times, moments, extents, areas, x = pull(disc(settled(d, (BOX, BOX), arch) - 0.5 * BOX), d, arch)
    axis = (np.arange(-math.ceil(1.0 / d), math.ceil(1.0 / d)) + 0.5) * d
    _, _, _, lattice, _ = pull(disc(np.stack(np.meshgrid(axis, axis, indexing="ij"), -1).reshape(-1, 2)), d, arch)
    exact = measured("elliptical_drop_exact.csv")
    b = float(np.interp(1.0, exact["tau"], exact["b"]))
    limit = 4.0 if quick else 3.0
    figures = [
        Figure("b at tau = 1, moment, error", 100 * (moments[-1] / b - 1), "%", -limit, limit, f"b = {b:.4f}", SOURCE),
        Figure("b at tau = 1, extent, error", 100 * (extents[-1] / b - 1), "%", -limit, limit, f"b = {b:.4f}", SOURCE),
        Figure("area at tau = 1, error", 100 * (areas[-1] - 1), "%", -limit, limit, "pi", "incompressibility"),
        Figure("area, largest error", 100 * (max(areas, key=lambda s: abs(s - 1)) - 1), "%", reference="0"),
        Figure(
            "area of a lattice at tau = 1, error", 100 * (lattice[-1] - 1), "%", reference="0", source="rows stay rows"
        ),
    ]

    def draw(plot: Any) -> None:
        left, middle, right = plot.subplots(1, 3)
        left.plot(times, moments, color=BLUE, label="from the moment")
        left.plot(times, extents, color=BLUE, ls="--", label="from the extent")
        past = exact["tau"] <= 1.0
        left.plot(exact["tau"][past], exact["b"][past], "o", color=RED, ms=4, label="exact")
        left.set(xlabel="tau", ylabel="half axis b")
        left.legend(frameon=False)
        middle.plot(times, areas, color=BLUE, label="settled water")
        middle.plot(times, lattice, color=BLUE, ls=":", label="square lattice")
        middle.legend(frameon=False)
        middle.axhspan(1 - limit / 100, 1 + limit / 100, color="0.9", zorder=0)
        middle.set(xlabel="tau", ylabel="area / area at the start")
        right.plot(x[:, 0], x[:, 1], ".", color=BLUE, ms=1)
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        right.plot(np.cos(angle) / b, b * np.sin(angle), color=RED, lw=1)
        right.set(title="tau = 1", aspect="equal", xticks=(-0.4, 0.4))
        for panel in (left, middle, right):
            tidy(panel)

    return Outcome(
        figures, {"tau": times, "b_moment": moments, "b_extent": extents, "area": areas, "lattice": lattice}, draw
    )


def disc(x: np.ndarray) -> np.ndarray:
    """Return the points [n, 2] inside the unit circle."""
    return x[(x**2).sum(axis=1) < 1.0]


def pull(x: np.ndarray, d: float, arch: str) -> tuple[list[float], list[float], list[float], list[float], np.ndarray]:
    """Return times, b by the moment and by the extent, area over that at the start, and the last positions [n, 2]."""
    fluid = Points(positions=x, velocities=x * (-1.0, 1.0))
    sim = Simulation(Scene(spacing=d, gravity=(0.0, 0.0), fluids=[fluid]), arch)
    full = hull_area(x, 0.5 * d)  # its edge is jagged: 1 % more than the number of particles says
    times, moments, extents, areas = [], [], [], []
    for frame in sim.frames(1.0, 60.0):
        x = frame.positions.astype(float)
        times.append(sim.time)
        moments.append(2.0 * float(np.sqrt(np.mean(x[:, 1] ** 2))))
        extents.append(float(np.abs(x[:, 1]).max()) + 0.5 * d)
        areas.append(hull_area(x, 0.5 * d) / full)
    return times, moments, extents, areas, x


def hull_area(x: np.ndarray, margin: float) -> float:
    """Return the area of the convex hull of the points [n, 2], widened by `margin` (Andrew's monotone chain)."""
    points = x[np.lexsort((x[:, 1], x[:, 0]))]
    hull: list[np.ndarray] = []
    for part in (points, points[::-1]):
        chain: list[np.ndarray] = []
        for point in part:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0.0:
                chain.pop()
            chain.append(point)
        hull += chain[:-1]
    corners = np.array(hull)
    after = np.roll(corners, -1, axis=0)
    area = 0.5 * float(np.sum(corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]))
    edge = float(np.linalg.norm(after - corners, axis=1).sum())
    return area + margin * edge + math.pi * margin**2


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


CASE = Case("elliptical-drop", "A drop drawn into an ellipse", run)
