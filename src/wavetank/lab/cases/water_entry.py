"""Bodies that fall into water: how deep they are, and when.

In a plane wedges of 30 degrees deadrise and four masses. Reference: von Karman 1929 (NACA TN 321), the momentum of
the body goes to the water that has joined it, with the mass of that water from the similarity solution for a wedge,
F = 14.139 rho V^3 t (Dobrovol'skaya 1969, 10.1017/S0022112069001868; Zhao and Faltinsen 1993,
10.1017/S002211209300028X, Table 1), until the spray leaves its edges.

In space the spheres of Aristoff, Truscott, Techet and Bush 2010 (10.1063/1.3309454): 12.7 mm in radius, at 2.17 m/s,
0.86, 1.14, 2.30 and 7.86 times as dense as water. Their measured depths are in a figure only, which we have not; so
the reference is a trajectory as theirs, of a sphere with an open cavity behind it: the added mass of its wet half,
1/4 of the water displaced, and the drag of a sphere in a cavity at vanishing cavitation number, 0.30
(May 1975, "Water entry and the cavity-running behavior of missiles"; Brennen 1995, "Cavitation and Bubble Dynamics").
It leaves out how the cavity closes, so that it holds for some ten radii and for light spheres roughly.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.shapes import Sphere
from wavetank.solids.solid import Solid

G, WATER = 9.81, 1000.0  # m/s^2, kg/m^3
DEADRISE, SLAMMING = math.radians(30.0), 14.139
HALF, DECK, SPEED, MASSES = 0.1, 0.04, 2.0, (5.0, 10.0, 20.0, 40.0)  # m, m, m/s, kg/m
WETTED = 0.035  # m: the spray is near the edges
RADIUS, IMPACT, RATIOS = 0.0127, 2.17, (0.86, 1.14, 2.30, 7.86)  # m, m/s
CAVITY_DRAG, WET_HALF = 0.30, 0.25
FAR = 6.0  # radii: how far a sphere would get undisturbed
Motion = Callable[[float, float], float]  # acceleration [m/s^2] at depth [m] and speed [m/s]


def run(quick: bool, arch: str) -> Outcome:
    """Drop four wedges and four spheres (quick: two of each, coarser)."""
    figures: list[Figure] = []
    series: dict[str, Sequence[float]] = {}
    masses, ratios = (MASSES[1:3], RATIOS[::2]) if quick else (MASSES, RATIOS)
    for mass in masses:
        times, depths = fall(wedge(mass, 0.005 if quick else 0.0025), arch, WETTED, SPEED)
        theory = course(wedge_motion(mass), times, SPEED)
        figures += compare(f"wedge of {mass:g} kg/m", times, depths, theory, WETTED, 0.1 if quick else 0.05)
        series |= columns(f"wedge_{mass:g}", time=times, depth=depths, theory=theory)
    for ratio in ratios:
        times, depths = fall(sphere(ratio, RADIUS / (4 if quick else 6)), arch, FAR * RADIUS, IMPACT)
        theory = course(sphere_motion(ratio), times, IMPACT)
        figures += compare(
            f"sphere of {ratio:g} times water's density", times, depths, theory, FAR * RADIUS, 0.15 if quick else 0.1
        )
        series |= columns(f"sphere_{ratio:g}", time=times, depth=depths, theory=theory)

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        for axis, kind, title in ((left, "wedge", "wedges, 2-D"), (right, "sphere", "spheres, 3-D")):
            for name in [name for name in series if name.startswith(f"depth_{kind}")]:
                times = 1e3 * np.array(series[name.replace("depth", "time")])
                axis.plot(times, 1e3 * np.array(series[name]), color=BLUE)
                axis.plot(times, 1e3 * np.array(series[name.replace("depth", "theory")]), color=RED, lw=1.0)
            axis.set(title=title, xlabel="time since it touched [ms]", ylabel="depth [mm]")
            axis.plot([], [], color=BLUE, label="measured")
            axis.plot([], [], color=RED, lw=1.0, label="theory")
            axis.legend(frameon=False)
            tidy(axis)

    return Outcome(figures, series, draw)


def wedge(mass: float, spacing: float) -> Scene:
    """Return a wedge whose keel is a spacing over a pool in a plane."""
    rise, depth = HALF * math.tan(DEADRISE), 0.4
    area = HALF * rise + 2.0 * HALF * DECK
    points = [(0.0, 0.0), (HALF, rise), (HALF, rise + DECK), (-HALF, rise + DECK), (-HALF, rise)]
    solid = Polygon(
        name="body", center=(0.5, depth + spacing), points=points, density=mass / area, velocity=(0.0, -SPEED)
    )
    return _pool(solid, spacing, (1.0, 0.7), depth, SPEED)


def sphere(ratio: float, spacing: float) -> Scene:
    """Return a sphere whose lowest point is a spacing over a pool in space."""
    width, depth = 12.0 * RADIUS, 10.0 * RADIUS
    center = (0.5 * width, depth + RADIUS + spacing, 0.5 * width)
    solid = Sphere(name="body", center=center, radius=RADIUS, density=WATER * ratio, velocity=(0.0, -IMPACT, 0.0))
    return _pool(solid, spacing, (width, 14.0 * RADIUS, width), depth, IMPACT)


def _pool(solid: Solid, spacing: float, size: tuple[float, ...], depth: float, speed: float) -> Scene:
    """Return the body over water of that depth [m], in frames in which it falls by a spacing."""
    upper = tuple(depth if k == 1 else edge for k, edge in enumerate(size))
    block = Block(lower=(0.0,) * len(size), upper=upper)
    return Scene(
        spacing=spacing, tank=Tank(size=size), fluids=[block], solids=[solid], foam=0.0, frame_time=spacing / speed
    )


def fall(scene: Scene, arch: str, far: float, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] since the body touched the water and depths of its lowest point [m].

    It ends when a body would have gone twice as `far` [m] at its first `speed` [m/s].
    """
    sim = Simulation(scene, arch)
    body, times, depths = sim.bodies["body"], [], []
    gap = scene.spacing
    start, wait = float(body.position[1]), gap / speed
    while sim.time < 2.0 * far / speed + wait:
        sim.step()
        times.append(sim.time - wait)
        depths.append(start - gap - float(body.position[1]))
    return np.array(times), np.array(depths)


def wedge_motion(mass: float) -> Motion:
    """Return how a wedge is slowed down by the water that joins it, and by what it displaces."""
    joined = 0.5 * SLAMMING * WATER

    def acceleration(z: float, v: float) -> float:
        z = max(z, 0.0)
        push = mass * G - WATER * G * z * z / math.tan(DEADRISE) - 2.0 * joined * z * v * abs(v)
        return push / (mass + joined * z * z)

    return acceleration


def sphere_motion(ratio: float) -> Motion:
    """Return how a sphere is slowed down in an open cavity."""
    volume = 4.0 / 3.0 * math.pi * RADIUS**3

    def acceleration(z: float, v: float) -> float:
        h = min(max(z, 0.0), 2.0 * RADIUS)
        wet = math.pi * h * h * (3.0 * RADIUS - h) / 3.0  # of a cap
        half = min(h, RADIUS)
        joined = WET_HALF * volume * (half / RADIUS) ** 2 * (1.5 - 0.5 * half / RADIUS)  # grows as the wet half does
        rate = 0.0 if h >= RADIUS else WET_HALF * volume * (3.0 * half / RADIUS**2 - 1.5 * half**2 / RADIUS**3)
        drag = 0.5 * CAVITY_DRAG * math.pi * half * (2.0 * RADIUS - half)  # of the disc at the surface, then the widest
        push = (ratio * volume - wet) * G - (drag + rate) * v * abs(v)
        return push / (ratio * volume + joined)

    return acceleration


def course(motion: Motion, times: np.ndarray, speed: float) -> np.ndarray:
    """Return the depth [m] of what touches the water at time 0 with that `speed` [m/s]."""
    z, v, now, depths = 0.0, speed, 0.0, []
    for time in times:
        steps = max(1, math.ceil(abs(time - now) / 1e-5))
        dt = (time - now) / steps
        for _ in range(steps):
            middle = v + 0.5 * dt * motion(z, v)
            z, v = z + dt * middle, v + dt * motion(z + 0.5 * dt * v, middle)
        now = float(time)
        depths.append(z)
    return np.array(depths)


def compare(
    name: str, times: np.ndarray, depths: np.ndarray, theory: np.ndarray, far: float, within: float
) -> list[Figure]:
    """Compare depths when the body should have come as far as `far` [m], or at the end."""
    at = float(np.interp(far, theory, times))
    ratio = float(np.interp(at, times, depths) / np.interp(at, times, theory))
    until = (times > 0.0) & (times <= at)
    off = float(np.sqrt(np.mean((depths[until] - theory[until]) ** 2)) / far)
    source = "von Karman 1929; Zhao and Faltinsen 1993" if "wedge" in name else "cavity drag 0.30, added mass 1/4"
    return [
        Figure(
            f"{name}: depth at {1e3 * at:.0f} ms, over theory's", ratio, "", 1.0 - within, 1.0 + within, "1", source
        ),
        Figure(f"{name}: rms off theory until then", 100.0 * off, "%", reference="0", source=source),
    ]


CASE = Case("water-entry", "Bodies that fall into water", run)
