"""Boxes of seven densities in a pool: how deep they float, and whether they rest.

References: Archimedes; a body of the water's density stays where it is put; at rest nothing moves. And the scene of
SPlisHSPlasH #378 (https://github.com/InteractiveComputerGraphics/SPlisHSPlasH/issues/378), where at a particle radius
of 0.05 m a body had to be 7 to 10 times as dense as water not to rise, whether put under water or dropped from above,
and by how much depended on the particles: here a ball of the water's density.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box, Sphere

TALL, WIDE = 0.2, 0.3  # m, of the box
POOL, DEEP = 0.8, 0.4  # m
RATIOS = (0.05, 0.3, 0.5, 0.9, 1.0, 1.1, 8.0)
QUIET = 0.005  # m/s
UNIT = 1000.0  # kg/m^3, of water
BALL, BASIN, BRIM = 0.5, 4.0, 2.5  # m: radius of the ball of the last scene, its basin's edge, its water's depth


@dataclasses.dataclass(frozen=True)
class Track:
    """Where a body was, and how fast."""

    times: np.ndarray
    heights: np.ndarray  # m, of its centre
    speeds: np.ndarray  # m/s
    level: float  # m: the surface, with the body in it as Archimedes says


def run(quick: bool, arch: str) -> Outcome:
    """Let each box float for 6 s, and a ball for 5 s (quick: two boxes, 4 s, coarser, and no ball dropped)."""
    figures: list[Figure] = []
    series: dict[str, Sequence[float]] = {}
    seconds = 4.0 if quick else 6.0
    for dim in (3, 2):
        spacing = TALL / 6 if quick else TALL / 10
        for ratio in (0.5, 8.0) if quick else RATIOS:
            track = box_track(dim, ratio, spacing, seconds, arch)
            figures += box_figures(f"{dim}-D, {ratio:g}", ratio, track, spacing)
            series |= {"time": track.times.tolist(), f"height_{dim}d_{ratio:g}": track.heights.tolist()}
    for spacing in (0.1,) if quick else (0.1, 0.05):
        figures += ball_figures(spacing, arch, dropped=not quick)

    def draw(plot: Any) -> None:
        axes = plot.subplots(1, 2, sharey=True)
        for axis, dim in zip(axes, (3, 2), strict=True):
            for ratio in RATIOS:
                name = f"height_{dim}d_{ratio:g}"
                if name in series:
                    axis.plot(series["time"], series[name], color=BLUE, lw=1.0)
                    axis.axhline(expected(dim, ratio), color=RED, lw=0.8, ls=":")
            axis.set(title=f"{dim}-D", xlabel="time [s]", ylabel="height of the centre [m]", ylim=(0.0, 0.7))
            tidy(axis)

    return Outcome(figures, series, draw)


def level_of(dim: int, ratio: float) -> float:
    """Return the level of the pool's water [m] with the box in it."""
    area, foot = POOL ** (dim - 1), WIDE ** (dim - 1)
    start = DEEP * area - max(0.0, DEEP - _start(ratio) + 0.5 * TALL if ratio <= 1.0 else TALL) * foot
    return (start + min(ratio, 1.0) * TALL * foot) / area


def expected(dim: int, ratio: float) -> float:
    """Return where the centre of a box comes to rest [m]."""
    if ratio > 1.0:
        return 0.5 * TALL
    return _start(ratio) if ratio == 1.0 else level_of(dim, ratio) + (0.5 - ratio) * TALL


def _start(ratio: float) -> float:
    """Return where a box begins [m]: those that float about as deep as they will, others well under water."""
    return 0.5 * DEEP if ratio == 1.0 else DEEP + (0.5 - ratio) * TALL if ratio < 1.0 else DEEP - 0.75 * TALL


def box_track(dim: int, ratio: float, spacing: float, seconds: float, arch: str) -> Track:
    """Follow a box of that share of the water's density."""
    size, edges = (POOL, 2.0 * DEEP, POOL)[:dim], (WIDE, TALL, WIDE)[:dim]
    box = Box(name="body", center=(0.5 * POOL, _start(ratio), 0.5 * POOL)[:dim], size=edges, density=UNIT * ratio)
    block = Block(lower=(0.0,) * dim, upper=(POOL, DEEP, POOL)[:dim])
    scene = Scene(spacing=spacing, tank=Tank(size=size), fluids=[block], solids=[box], foam=0.0)
    return follow(scene, min(ratio, 1.0) * TALL * WIDE ** (dim - 1), seconds, arch)


def follow(scene: Scene, displaced: float, seconds: float, arch: str) -> Track:
    """Run a scene whose body displaces so much water [m^3, in 2-D m^2] once it floats."""
    assert scene.tank is not None
    sim = Simulation(scene, arch)
    times, heights, speeds = [], [], []
    while sim.time < seconds - 1e-6:
        sim.step()
        body = sim.bodies["body"]
        times.append(sim.time)
        heights.append(float(body.position[1]))
        speeds.append(float(np.linalg.norm(body.velocity)))
    area = float(np.prod(scene.tank.size)) / scene.tank.size[1]
    level = (sim.count * scene.spacing**scene.dim + displaced) / area
    return Track(np.array(times), np.array(heights), np.array(speeds), level)


def box_figures(name: str, ratio: float, track: Track, spacing: float) -> list[Figure]:
    """Compare with Archimedes; the last 2 s count."""
    last = track.times > track.times[-1] - 2.0
    mean, v_rms = float(track.heights[last].mean()), float(np.sqrt(np.mean(track.speeds[last] ** 2)))
    if ratio < 1.0:
        draft = track.level - (mean - 0.5 * TALL)
        where = Figure(
            f"{name}: draft less ratio, of the height",
            100.0 * (draft / TALL - ratio),
            "%",
            -3.0,
            3.0,
            "0",
            "Archimedes",
        )
    elif ratio == 1.0:
        way = float(np.abs(track.heights[track.times < 5.0] - track.heights[0]).max())
        where = Figure(f"{name}: farthest from its place in 5 s", way / spacing, "d", None, 1.0, "0", "Archimedes")
    else:
        where = Figure(f"{name}: above the floor", (mean - 0.5 * TALL) / spacing, "d", -0.5, 0.5, "0", "it is heavier")
    fastest = float(track.speeds.max())
    return [
        where,
        Figure(f"{name}: v_rms at rest", v_rms, "m/s", None, QUIET, "0", "rest"),
        Figure(f"{name}: fastest", fastest, "m/s", None, 2.0 * (9.81 * DEEP) ** 0.5, "", "no explosion"),
    ]


def ball_figures(spacing: float, arch: str, *, dropped: bool) -> list[Figure]:
    """Rebuild the scene of the report: a ball as dense as water, under water and dropped."""
    volume, figures = 4.0 / 3.0 * np.pi * BALL**3, []
    for height, what in ((0.5 * BRIM, "under water"), (BRIM + 1.2 * BALL, "dropped"))[: 1 + dropped]:
        ball = Sphere(name="body", center=(0.5 * BASIN, height, 0.5 * BASIN), radius=BALL, density=UNIT)
        block = Block(lower=(0.0, 0.0, 0.0), upper=(BASIN, BRIM, BASIN))
        tank = Tank(size=(BASIN, 1.6 * BRIM, BASIN))
        scene = Scene(spacing=spacing, tank=tank, fluids=[block], solids=[ball], foam=0.0)
        track = follow(scene, volume, 5.0, arch)
        name = f"ball as dense as water, {what}, particle radius {0.5 * spacing:g} m"
        if what == "dropped":
            top = track.heights[track.times > 3.0].max() + BALL - track.level
            figures.append(
                Figure(f"{name}: how far it ever rises out again", float(top) / BALL, "radii", None, 0.2, "0", "#378")
            )
        else:
            way = float(np.abs(track.heights - track.heights[0]).max())
            figures.append(Figure(f"{name}: farthest in 5 s", way / spacing, "d", None, 1.0, "0", "#378"))
    return figures


CASE = Case("buoyancy", "Bodies of seven densities", run)
