"""Nothing creeps: what small worlds measure ten seconds after their start and after ten minutes is the same.

Reference: hydrostatics; nothing acts on water at rest. Each quantity is the mean over five seconds, from 10 s on and
before the end. The worlds: still water; a dam break, whose foam must be gone and whose water still swings after 10 s;
oil on water; a drop that tension and adhesion hold on the floor, under gravity; honey.
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, surface
from wavetank.lab.plots import tidy
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame
from wavetank.simulation.simulation import Simulation

SETTLED, SECONDS, QUICK_SECONDS, WINDOW = 10.0, 600.0, 25.0, 5.0  # s
#: How much quantities may change, and how fast particles may still be at the end.
SAME, LOOSE, STILL = 1.0, 3.0, 0.01  # %, %, m/s
FULL = 2.0  # supports from the surface and the walls of the tank that are inside
QUICK = ("water", "oil on water")


@dataclasses.dataclass(frozen=True)
class World:
    """A small world, and the quantities that are watched in it, each with how much it may change [%]."""

    name: str
    table: dict[str, Any]
    measure: Callable[[Frame, Scene], dict[str, float]]
    bounds: dict[str, float]
    still: float = STILL  # m/s


def level(frame: Frame, scene: Scene) -> float:
    """Return the mean height [m] of the surface."""
    assert scene.tank is not None
    return float(surface(frame.positions.astype(float), scene.spacing, scene.tank.size).mean())


def packing(frame: Frame, scene: Scene) -> float:
    """Return the number of particles inside of the water times their volume, over the volume that they are in.

    The volume is what lies deeper than a layer of the thickness `FULL`; nan where nothing does.
    """
    assert scene.tank is not None
    x, margin = frame.positions.astype(float), FULL * scene.support * scene.spacing
    top = level(frame, scene) - margin
    low, high = np.full(x.shape[1], margin), np.array(scene.tank.size) - margin
    high[1] = top
    # A box with a blurred edge: particles count by a ramp as wide as two spacings, so that rows do not show.
    ramp = 2.0 * scene.spacing
    share = np.clip((x - low) / ramp + 0.5, 0.0, 1.0) * np.clip((high - x) / ramp + 0.5, 0.0, 1.0)
    return float(share.prod(axis=1).sum() * scene.spacing ** x.shape[1] / np.prod(high - low))


def pool(frame: Frame, scene: Scene) -> dict[str, float]:
    """Measure still water."""
    x = frame.positions.astype(float)
    return {"level": level(frame, scene), "mean height": float(x[:, 1].mean()), "packing": packing(frame, scene)}


def layers(frame: Frame, scene: Scene) -> dict[str, float]:
    """Measure two layers."""
    y = frame.positions[:, 1].astype(float)
    lower = frame.materials == 1
    return {
        "level": level(frame, scene),
        "mean height of the water": float(y[lower].mean()),
        "mean height of the oil": float(y[~lower].mean()),
    }


def drop(frame: Frame, scene: Scene) -> dict[str, float]:
    """Measure a drop on the floor: four standard deviations for its width, twice its mean height."""
    x = frame.positions.astype(float)
    return {"width": float(4.0 * x[:, 0].std()), "height": float(2.0 * x[:, 1].mean())}


WORLDS = (
    World(
        "water",
        {
            "spacing": 0.05,
            "tank": {"size": [0.8, 0.8, 0.5]},
            "fluids": [{"lower": [0, 0, 0], "upper": [0.8, 0.5, 0.5]}],
        },
        pool,
        {"level": SAME, "mean height": SAME, "packing": SAME},
    ),
    World(
        "dam break",
        {"spacing": 0.025, "tank": {"size": [1.0, 0.8]}, "fluids": [{"lower": [0, 0], "upper": [0.4, 0.7]}]},
        pool,
        {"level": LOOSE, "mean height": LOOSE, "packing": SAME},
    ),
    World(
        "oil on water",
        {
            "spacing": 0.025,
            "tank": {"size": [0.8, 0.8]},
            "materials": [{"name": "water", "density": 1000.0}, {"name": "oil", "density": 850.0, "viscosity": 0.1}],
            "fluids": [
                {"lower": [0, 0], "upper": [0.8, 0.25], "material": "water"},
                {"lower": [0, 0.25], "upper": [0.8, 0.5], "material": "oil"},
            ],
        },
        layers,
        {"level": SAME, "mean height of the water": SAME, "mean height of the oil": SAME},
    ),
    World(
        "drop on a wall",
        {
            "spacing": 0.001,
            "tank": {"size": [0.06, 0.02]},
            "surface_tension": 0.072,
            "contact_angle": 75.0,
            "dynamic_viscosity": 0.005,
            "fluids": [{"lower": [0.022, 0], "upper": [0.038, 0.008]}],
        },
        drop,
        {"width": LOOSE, "height": LOOSE},
        still=0.05,  # a particle that the floor holds is told the speed that it would have
    ),
    World(
        "honey",
        {
            "spacing": 0.002,
            "tank": {"size": [0.06, 0.06]},
            "materials": [{"name": "honey", "density": 1400.0, "viscosity": 10.0}],
            "fluids": [{"lower": [0.015, 0], "upper": [0.045, 0.05], "material": "honey"}],
        },
        pool,
        {"level": SAME, "mean height": SAME},
    ),
)


@dataclasses.dataclass
class Watched:
    """What was seen of a world, a row each second."""

    time: list[float] = dataclasses.field(default_factory=list)
    v_max: list[float] = dataclasses.field(default_factory=list)  # of the second
    foam: list[int] = dataclasses.field(default_factory=list)
    measured: list[dict[str, float]] = dataclasses.field(default_factory=list)

    def mean(self, quantity: str, start: float) -> float:
        """Return the mean of a quantity over `WINDOW` from a time [s] on."""
        rows = zip(self.time, self.measured, strict=True)
        return float(np.mean([row[quantity] for time, row in rows if start < time < start + WINDOW + 0.5]))


def watch(world: World, seconds: float, arch: str) -> Watched:
    """Let a world run, and measure it each second."""
    scene: Scene = Scene.parse(world.table)
    sim, watched, fastest = Simulation(scene, arch), Watched(), 0.0
    for number in range(1, round(seconds * 60.0) + 1):
        sim.advance(1.0 / 60.0)
        if number % 6 == 0:
            fastest = max(fastest, float(np.linalg.norm(sim.velocities.astype(float), axis=1).max()))
        if number % 60 == 0:
            frame = sim.frame(measured=False)
            watched.time.append(sim.time)
            watched.v_max.append(fastest)
            watched.foam.append(len(frame.foam_positions))
            watched.measured.append(world.measure(frame, scene))
            fastest = 0.0
    return watched


def run(quick: bool, arch: str) -> Outcome:
    """Let the worlds run for ten minutes of water (quick: two of them for 25 s)."""
    seconds = QUICK_SECONDS if quick else SECONDS
    worlds = [world for world in WORLDS if not quick or world.name in QUICK]
    all_watched = {world.name: watch(world, seconds, arch) for world in worlds}
    figures: list[Figure] = []
    series: dict[str, list[float]] = {"time": all_watched[worlds[0].name].time}
    for world in worlds:
        seen = all_watched[world.name]
        for quantity, bound in world.bounds.items():
            change = 100.0 * (seen.mean(quantity, seconds - WINDOW) / seen.mean(quantity, SETTLED) - 1.0)
            figures.append(Figure(f"{world.name}: {quantity}, change", change, "%", -bound, bound, "0", "rest"))
            series[f"{quantity} {world.name}"] = [row[quantity] for row in seen.measured]
        last = max(seen.v_max[-round(WINDOW) :])
        figures.append(Figure(f"{world.name}: v_max at the end", last, "m/s", None, world.still, "0", "rest"))
        series[f"v_max {world.name}"] = seen.v_max
        if max(seen.foam) > 0:
            figures.append(Figure(f"{world.name}: foam at the end", seen.foam[-1], "", None, 0, "0", "rest"))
            series[f"foam {world.name}"] = [float(count) for count in seen.foam]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        for world in worlds:
            seen = all_watched[world.name]
            (line,) = left.semilogy(seen.time, np.maximum(seen.v_max, 1e-6), lw=0.8, label=world.name)
            for quantity in world.bounds:
                values = np.array([row[quantity] for row in seen.measured])
                right.plot(
                    seen.time, 100.0 * (values / seen.mean(quantity, SETTLED) - 1.0), color=line.get_color(), lw=0.8
                )
        left.axhline(STILL, color="0.5", lw=0.8, ls=":")
        left.set(xlabel="time [s]", ylabel="fastest particle [m/s]")
        right.set(xlabel="time [s]", ylabel="change since 10 s [%]", ylim=(-4.0, 4.0))
        left.legend(frameon=False, fontsize="small")
        for axis in (left, right):
            tidy(axis)

    return Outcome(figures, series, draw)


CASE = Case("creep", "Nothing creeps", run, is_long=True)
