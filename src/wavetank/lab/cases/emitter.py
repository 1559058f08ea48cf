"""Jets and taps: how much comes out of a mouth, how far it flies, how dense it is, and a level between tap and drain.

References: the flow that was asked for; the parabola of a free jet, x = v sqrt(2 fall / g) (Torricelli 1644); the same
tank filled by a block; what goes in and comes out at equal rates leaves the level where it is.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter
from wavetank.scene.fluids import Block
from wavetank.scene.gauges import Gauge
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

G = 9.81  # m/s^2
SPEED, RADIUS, HEIGHT = 2.0, 0.05, 0.6  # of the jet: m/s, m, m
FALLS = (0.1, 0.2, 0.3, 0.4)  # m, after which its range is taken
DEPTH = 0.2  # m, of the tank between tap and drain
SPLASH = 4  # s, until the waves are gone that the first water of the tap makes


def run(quick: bool, arch: str) -> Outcome:
    """Let a jet run for 2 s and a tank fill and drain for 60 s, in 3-D and 2-D (quick: 1 s, 8 s, coarser)."""
    figures: list[Figure] = []
    series: dict[str, list[float]] = {}
    spacing = {3: 0.025 if quick else 0.02, 2: 0.01}
    for dim in (3, 2):
        own, flights = jet(dim, spacing[dim], 1.0 if quick else 2.0, arch)
        figures += own
        series |= flights
        figures += settled_error(dim, spacing[dim], 6.0 if quick else 12.0, arch)
        own, levels = tap_and_drain(dim, spacing[dim], 8.0 if quick else 60.0, arch)
        figures += own
        series |= levels

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        fall = np.linspace(0.0, HEIGHT, 60)
        left.plot(SPEED * np.sqrt(2.0 * fall / G), HEIGHT - fall, color=RED, lw=1.0, label="parabola")
        for dim, mark in ((3, "o"), (2, "s")):
            y = HEIGHT - np.array(FALLS)
            left.plot(series[f"range_{dim}d"], y, mark, color=BLUE, ms=4, label=f"{dim}-D jet")
            times, level = (np.array(series[f"{name}_{dim}d"]) for name in ("time", "level"))
            means = np.convolve(level, np.ones(60) / 60, "valid")  # of a second
            color = BLUE if dim == 3 else RED
            right.plot(times[59:], 100.0 * (means - 1.0), color=color, lw=0.8, label=f"{dim}-D tank")
        left.set(xlabel="x [m]", ylabel="height [m]", ylim=(0, None))
        right.set(xlabel="time [s]", ylabel="level of a second, error [%]", ylim=(-2, 2))
        for axis in (left, right):
            axis.legend(frameon=False)
            tidy(axis)

    return Outcome(figures, series, draw)


def mouth(dim: int, radius: float, position: tuple[float, ...], direction: tuple[float, ...], speed: float) -> Emitter:
    """Return a round mouth, in 2-D a slit as wide."""
    shape = {"width": 2.0 * radius} if dim == 2 else {"radius": radius}
    emitter: Emitter = Emitter(position=position[:dim], direction=direction[:dim], speed=speed, **shape)
    return emitter


def area_of(dim: int, radius: float) -> float:
    """Return the area of such a mouth [m^2], in 2-D its width [m]."""
    return 2.0 * radius if dim == 2 else math.pi * radius**2


def jet(dim: int, spacing: float, seconds: float, arch: str) -> tuple[list[Figure], dict[str, list[float]]]:
    """Measure a jet that leaves a wall level and falls to a floor that swallows it."""
    size = (1.4, 0.9, 0.4)[:dim]
    emitter = mouth(dim, RADIUS, (0.0, HEIGHT, 0.2), (1.0, 0.0, 0.0), SPEED)
    floor = Drain(lower=(0.0,) * dim, upper=tuple(0.16 if k == 1 else edge for k, edge in enumerate(size)))
    sim = Simulation(Scene(spacing=spacing, tank=Tank(size=size), emitters=[emitter], drains=[floor], foam=0.0), arch)
    times, volumes, worst = [], [], []
    crossings: dict[float, list[float]] = {fall: [] for fall in FALLS}
    while sim.time < seconds - 1e-6:
        sim.step()
        stats = sim.stats()
        times.append(sim.time)
        volumes.append(stats["emitted"] * spacing**dim)
        worst.append(100.0 * stats["density_error_mean"])
        x = sim.positions.astype(float)
        for fall in FALLS:
            near = x[np.abs(x[:, 1] - HEIGHT + fall) < spacing]
            # Each particle flies its own parabola: its range at this fall follows from where it is now.
            crossings[fall] += (near[:, 0] * np.sqrt(fall / (HEIGHT - near[:, 1]))).tolist()
    rate = float(np.polyfit(times, volumes, 1)[0])
    asked = SPEED * area_of(dim, RADIUS)
    ranges = [float(np.mean(crossings[fall])) for fall in FALLS]
    ratio = ranges[-1] / (SPEED * math.sqrt(2.0 * FALLS[-1] / G))
    return [
        Figure(f"{dim}-D jet: flow / asked", rate / asked, "", 0.99, 1.01, "1", "speed times area"),
        Figure(f"{dim}-D jet: range / parabola", ratio, "", 0.98, 1.02, "1", "Torricelli 1644"),
        Figure(f"{dim}-D jet: density error, mean, worst frame", max(worst), "%", None, 0.3, "0", "incompressibility"),
    ], {f"range_{dim}d": ranges}


def settled_error(dim: int, spacing: float, seconds: float, arch: str) -> list[Figure]:
    """Compare the density errors of a tank that a tap has filled with those after as much water fell as a block.

    What a tap pours stirs for longer than what fell, in a plane above all, and water that moves is denser; and packings
    differ from start to start by half of either error. So both settle for `seconds`, and means of three starts count.
    """
    size, area = (0.4, 0.6, 0.3)[:dim], area_of(dim, 0.05)
    pouring = 0.4 * 0.15 * (0.3 if dim == 3 else 1.0) / area
    mouths = (mouth(dim, 0.05, (0.2 + k * spacing / 4, 0.55, 0.15), (0.0, -1.0, 0.0), 1.0) for k in (-1, 0, 1))
    taps = [{"emitters": [tap.model_copy(update={"duration": pouring})]} for tap in mouths]
    # Perfect rows would stay perfect if they did not fall over.
    blocks = [
        {"fluids": [Block(lower=(0.0,) * dim, upper=(*edges, 0.3)[:dim])]}
        for edges in ((0.2, 0.3), (0.12, 0.5), (0.3, 0.2))
    ]
    poured, fallen = (
        [_density_error(parts, size, spacing, pouring + seconds, arch) for parts in starts] for starts in (taps, blocks)
    )
    return [
        Figure(
            f"{dim}-D tank: density error, mean, poured less block",
            float(np.mean(poured) - np.mean(fallen)),
            "%",
            None,
            0.05,
            "0",
            "as much water that fell as a block",
        )
    ]


def _density_error(parts: dict[str, Any], size: tuple[float, ...], spacing: float, seconds: float, arch: str) -> float:
    """Return the mean density error [%] over half a second that begins at `seconds`."""
    sim = Simulation(Scene(spacing=spacing, tank=Tank(size=size), foam=0.0, **parts), arch)
    sim.advance(seconds)
    errors = []
    for _ in range(30):
        sim.step()
        errors.append(100.0 * sim.stats()["density_error_mean"])
    return float(np.mean(errors))


def tap_and_drain(dim: int, spacing: float, seconds: float, arch: str) -> tuple[list[Figure], dict[str, list[float]]]:
    """Measure the level of a tank that a tap fills as fast as a drain empties it."""
    size = (0.6, 0.5, 0.3)[:dim]
    tap = mouth(dim, 0.03, (0.15, 0.3, 0.15), (0.0, -1.0, 0.0), 0.6)
    flow = 0.6 * area_of(dim, 0.03) / (1.0 if dim == 2 else 1e-3)
    drain = Drain(center=(0.5, 0.0, 0.15)[:dim], radius=0.05, direction=(0.0, 1.0, 0.0)[:dim], flow=flow)
    block = Block(lower=(0.0,) * dim, upper=tuple(DEPTH if k == 1 else edge for k, edge in enumerate(size)))
    scene = Scene(spacing=spacing, tank=Tank(size=size), fluids=[block], emitters=[tap], drains=[drain], foam=0.0)
    sim = Simulation(scene, arch)
    times, levels, counts, n = [], [], [], sim.count
    # Around the middle, where the longest standing wave has its node.
    gauge = Gauge(lower=(0.2, 0.0, 0.0)[:dim], upper=(0.4, 0.5, 0.3)[:dim])
    while sim.time < seconds - 1e-6:
        sim.step()
        times.append(sim.time)
        levels.append(gauge.level(sim.positions, spacing, sim.scene.upward))
        counts.append(sim.count / n)
    second = round(1.0 / sim.scene.frame_time)
    means = np.convolve(levels, np.ones(second) / second, "valid")[SPLASH * second :]
    usual = float(means.mean())
    source = "what comes in and goes out at equal rates"
    return [
        Figure(
            f"{dim}-D tank: level, farthest of a second",
            100.0 * float(np.abs(means / usual - 1.0).max()),
            "%",
            None,
            1.0,
            "0",
            source,
        ),
        Figure(
            f"{dim}-D tank: water, farthest",
            100.0 * float(np.abs(np.array(counts) - 1.0).max()),
            "%",
            None,
            1.0,
            "0",
            source,
        ),
    ], {f"time_{dim}d": times, f"level_{dim}d": [level / usual for level in levels]}


CASE = Case("emitter", "Jets, taps and drains", run)
