"""Every bundled scene and level comes to rest and stays there, for two minutes of water.

Reference: hydrostatics; nothing acts on water at rest. `still-tank` has the bounds of water that was never touched from
the third second on; scenes that splash, from the second minute on. Roughness is the standard deviation of the tops of
columns two spacings wide, in spacings; it has a bound where the surface is level. Particles count as still below
0.02 m/s: a spacing of 2.5 cm in a second and a quarter. Waves of a whole tank are meant to last and do not count:
there the bound is on how fast a particle goes past those around it, which a throw does and a wave does not. What is
driven never rests, and is not faster in the second minute than in the first.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, surface
from wavetank.lab.cases.still_tank import DEPTH
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.physics.measure import kinetic_energy, potential_energy
from wavetank.scene.scene import Scene, bundled_levels, bundled_scenes
from wavetank.simulation.simulation import Simulation

SECONDS, QUICK_SECONDS = 120.0, 20.0
QUICK = ("still-tank", "still-tank-2d", "double-dam-2d", "dam-break-2d")
SETTLED = 60.0  # s after which a splash is over, see `SPLASHES`
MOST = 6_000  # particles: scenes of more are coarsened
#: Not at rest by then, each for a reason of its own; their figures have no bounds (notebook/calm.md).
RESTLESS = {
    "weightless-drop": "a drop under tension shivers",
    "weightless-drop-2d": "a drop under tension shivers",
    "dam-break-2d": "its waves keep 95 % a period",
    "mountain-lake": "films run down the valley",
    "river": "runs downhill without an end",
}
#: Tanks with little in them to break a wave.
WAVES = ("dam-break", "double-dam-2d", "dry-feet", "lock-exchange-2d", "oil-and-water-2d")
WAVING = "its waves keep 96 % a period"
DRIVEN = "a tap, a motor or a motion goes on"
GROWTH = 1.5  # at most, of how fast the fastest is that is driven: the same at any time
AROUND = 4.0  # spacings: edge of the cells in which particles are around each other
V_RMS, V_MAX, STILL, ROUGH = 0.001, 0.01, 0.02, 0.06  # m/s, m/s, m/s, d


@dataclasses.dataclass
class Rest:
    """What was seen of a scene, a row each half second."""

    name: str
    spacing: float
    driven: bool = False
    time: list[float] = dataclasses.field(default_factory=list)
    v_rms: list[float] = dataclasses.field(default_factory=list)
    v_max: list[float] = dataclasses.field(default_factory=list)  # of the half second
    past: list[float] = dataclasses.field(default_factory=list)  # those around, m/s: the most of the half second
    roughness: list[float] = dataclasses.field(default_factory=list)
    level: list[float] = dataclasses.field(default_factory=list)  # m
    energy: list[float] = dataclasses.field(default_factory=list)  # J

    def since(self, name: str, start: float) -> np.ndarray:
        """Return the values of a column from a time [s] on."""
        return np.array(getattr(self, name))[np.array(self.time) > start - 1e-6]


def fastest_past(x: np.ndarray, v: np.ndarray, edge: float) -> float:
    """Return by how much a velocity [m/s] differs at most from the mean of those in the same cell of an `edge` [m].

    Where fewer than three particles share a cell it is the velocity itself.
    """
    place = np.floor((x - x.min(axis=0)) / edge).astype(np.int64)
    cell = np.ravel_multi_index(tuple(place.T), tuple(place.max(axis=0) + 1))
    number = np.bincount(cell)
    mean = np.stack([np.bincount(cell, part) for part in v.T], axis=1) / np.maximum(number, 1)[:, None]
    alone = number[cell] < 3
    return float(np.linalg.norm(np.where(alone[:, None], v, v - mean[cell]), axis=1).max())


def watch(name: str, seconds: float, arch: str) -> Rest:
    """Let a bundled scene run, and look at it each half second."""
    scene = Scene.load(name)
    count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    if count > 1.2 * MOST and not name.startswith("still"):  # whose layers would not fit
        scene = scene.changed(spacing=scene.spacing * (count / MOST) ** (1.0 / scene.dim))
    sim = Simulation(scene, arch)
    moved = any(solid.motion is not None for solid in scene.solids)
    turned = any(getattr(joint, "speed", None) is not None for joint in scene.joints)
    rest = Rest(name, scene.spacing, bool(scene.emitters) or moved or turned)
    fastest = past = 0.0
    for number in range(1, round(seconds * 60.0) + 1):
        sim.advance(1.0 / 60.0)
        frame = sim.frame(measured=False)
        speed = np.linalg.norm(frame.velocities.astype(float), axis=1)
        fastest = max(fastest, float(speed.max()))
        x = frame.positions.astype(float)
        past = max(past, fastest_past(x, frame.velocities, AROUND * scene.spacing))
        if number % 30:
            continue
        tops = surface(x - scene.tank.box()[0], scene.spacing, scene.tank.size) if scene.tank else np.zeros(1)
        mass = frame.rest_densities.astype(float) * scene.spacing**scene.dim
        rest.time.append(sim.time)
        rest.v_rms.append(float(np.sqrt(np.mean(speed**2))))
        rest.v_max.append(fastest)
        rest.past.append(past)
        rest.roughness.append(float(tops.std() / scene.spacing))
        rest.level.append(float(tops.mean()))
        rest.energy.append(kinetic_energy(frame.velocities, mass) + potential_energy(x, mass, scene.gravity))
        fastest = past = 0.0
    return rest


def run(quick: bool, arch: str) -> Outcome:
    """Let all bundled scenes and levels run for 120 s (quick: four of them for 20 s)."""
    seconds = QUICK_SECONDS if quick else SECONDS
    names = QUICK if quick else (*bundled_scenes(), *bundled_levels())
    watched = [watch(name, seconds, arch) for name in names]
    figures = [figure for rest in watched for figure in _figures(rest, seconds)]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2)
        for rest in watched:
            color = "0.6" if rest.name in (*RESTLESS, *WAVES) else BLUE if rest.name.startswith("still") else RED
            left.semilogy(rest.time, np.maximum(rest.v_max, 1e-5), color=color, lw=0.7, alpha=0.6)
            if rest.name.startswith("still"):
                right.plot(rest.time, rest.roughness, label=rest.name)
        left.axhline(STILL, color=RED, lw=0.8, ls=":")
        left.set(xlabel="time [s]", ylabel="fastest particle [m/s]")
        right.axhline(ROUGH, color="0.5", lw=0.8, ls=":")
        right.set(xlabel="time [s]", ylabel="roughness of the surface [d]", ylim=(0.0, 0.2))
        right.legend(frameon=False)
        for axis in (left, right):
            tidy(axis)

    series = {"time": watched[0].time} | {
        f"{column} {rest.name}": getattr(rest, column)
        for rest in watched
        for column in ("v_max", "past", "v_rms", "roughness", "level", "energy")
    }
    return Outcome(figures, series, draw)


def _figures(rest: Rest, seconds: float) -> list[Figure]:
    if rest.name.startswith("still"):
        level, fastest = rest.since("level", 3.0) / DEPTH, float(rest.since("v_max", 3.5).max())
        return [
            Figure(f"{rest.name}: v_max from 3 s on", fastest, "m/s", None, V_MAX, "0", "rest"),
            Figure(f"{rest.name}: v_rms", float(rest.since("v_rms", 3.0).max()), "m/s", None, V_RMS, "0", "rest"),
            Figure(f"{rest.name}: roughness", float(rest.since("roughness", 3.0).max()), "d", None, ROUGH, "0", "rest"),
            Figure(f"{rest.name}: lowest level / filled", float(level.min()), "", 0.99, 1.01, "1", "hydrostatics"),
            Figure(f"{rest.name}: highest level / filled", float(level.max()), "", 0.99, 1.01, "1", "hydrostatics"),
        ]
    settled = SETTLED if seconds > SETTLED else seconds - 2.0
    bound = None if rest.driven or rest.name in RESTLESS or seconds < SETTLED else STILL
    source = DRIVEN if rest.driven else RESTLESS.get(rest.name, "rest")
    fastest, past = (float(rest.since(name, settled).max()) for name in ("v_max", "past"))
    waves = rest.name in WAVES
    figures = [
        Figure(
            f"{rest.name}: v_max after {settled:g} s",
            fastest,
            "m/s",
            None,
            None if waves else bound,
            "0",
            WAVING if waves else source,
        ),
        Figure(f"{rest.name}: the same past those around", past, "m/s", None, bound, "0", source),
    ]
    if rest.driven and seconds > SETTLED:
        sooner, later = (float(np.median(half)) for half in np.array_split(rest.v_max, 2))
        growth = Figure(
            f"{rest.name}: fastest, second half over first", later / sooner, "", None, GROWTH, "1", "an even drive"
        )
        figures.append(growth)
    return figures


CASE = Case("rest", "All scenes come to rest", run, is_long=True)
