"""Inflow: which particles leave an inlet in a frame, where they are at its end, and the jet force in the inlet.

code     symbol   meaning                                                       unit
phase             share of a row that has passed since the last whole one       1
age               time since a particle left                                    s
pitch             distance of rows at rest density                              m
"""

import dataclasses
import itertools
import math
from collections.abc import Iterable

import numpy as np

from wavetank.foundation.rotations import turned
from wavetank.physics.forces.jet import opening_of
from wavetank.scene.emitters import Emitter, unit_vector
from wavetank.scene.forces.jet import Jet
from wavetank.scene.inlets import Inlet, frame_of
from wavetank.scene.scene import Scene
from wavetank.scene.schedule import gravity_at

HELD = 2.5  # d: distance from the inlet up to which a jet is held at its speed


@dataclasses.dataclass(frozen=True)
class Emission:
    """Particles that leave an inlet, in the order in which they left."""

    place: np.ndarray  # int [n]: index of the place in the inlet
    age: np.ndarray  # since they left: in rows, or in seconds

    def first(self, number: int) -> "Emission":
        """Return the first `number` of them."""
        return Emission(self.place[:number], self.age[:number])

    def aged(self, since: float, interval: float) -> "Emission":
        """Return them with ages in seconds: rows take an `interval` [s] each, and the last ended `since` [s] ago."""
        return Emission(self.place, since + interval * self.age)


def particles_due(inlet: Inlet, phase: float, rows: float) -> tuple[Emission, float]:
    """Return the particles that leave while `rows` pass an inlet, with ages in rows, and the next phase."""
    after = phase + rows
    whole = np.floor(after - inlet.phases).astype(int)
    number = whole - np.floor(phase - inlet.phases).astype(int)
    place = np.repeat(np.arange(len(inlet)), number)
    earlier = np.arange(len(place)) - np.repeat(np.cumsum(number) - number, number)
    age = after - inlet.phases[place] - (whole[place] - earlier)
    order = np.lexsort((place, -age))
    return Emission(place[order], age[order]), after - math.floor(after)


def one_row(inlet: Inlet) -> Emission:
    """Return a particle in each place that leaves now."""
    return Emission(np.arange(len(inlet)), np.zeros(len(inlet)))


def fly_freely(
    scene: Scene, emitter: Emitter, inlet: Inlet, due: Emission, end: float, dt: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return positions [m] and velocities [m/s], [n, dim], at `end` [s] of particles with these ages [s].

    They have flown freely since they left; `dt` [s] is the length of a time step.
    """
    x, v = np.zeros((len(due.place), 3)), np.zeros((len(due.place), 3))
    g = np.zeros(3)
    g[: scene.dim] = gravity_at(scene, end - scene.start_time)
    for age in np.unique(due.age).tolist():
        chosen = due.age == age
        left, places = end - age, due.place[chosen]
        then = emitter.at(left)
        speed = max(then.pace(inlet), 1e-3 * inlet.pitch / dt)
        middle, axes = inlet_frame(then, scene.dim, left)
        earlier, _ = inlet_frame(then, scene.dim, max(0.0, left - dt)) if then.motion else (middle, axes)
        ways = inlet.ways[places] @ axes
        if then.mesh is not None and then.direction is not None:
            ways = np.tile(unit_vector(then.direction), (len(places), 1))
        carried = (middle - earlier) / dt if left > dt else np.zeros(3)
        own = speed * ways + carried
        # A particle that has left is half a pitch ahead of the inlet, and has fallen since its center passed it.
        fallen = age + min(
            0.5 * inlet.pitch / speed, 0.5 * math.sqrt(inlet.pitch / max(float(np.linalg.norm(g)), 1e-9))
        )
        x[chosen] = middle + inlet.places[places] @ axes + 0.5 * inlet.pitch * ways + own * age + 0.5 * g * fallen**2
        # Velocities are those at the middle of a step: the next one moves x by (v + g dt) dt.
        v[chosen] = own + g * (fallen - 0.5 * dt)
    return x[:, : scene.dim].astype(np.float32), v[:, : scene.dim].astype(np.float32)


def inlet_frame(emitter: Emitter, dim: int, clock: float) -> tuple[np.ndarray, np.ndarray]:
    """Return center [m] and frame of an inlet at a time of the scene's clock [s]."""
    rest = np.zeros(3)
    rest[:dim] = emitter.middle
    axes = np.eye(3)
    if emitter.mesh is None:
        assert emitter.direction is not None
        side = None if emitter.side is None else np.array(emitter.side, float)
        axes = frame_of(unit_vector(emitter.direction), dim, side)
    if emitter.mesh is not None:
        axes = np.stack([turned(emitter.mesh.quaternion, row) for row in axes])
    if emitter.motion is not None:
        rest, turn = emitter.motion.path().pose(clock, (rest, np.array([1.0, 0.0, 0.0, 0.0])))
        axes = np.stack([turned(turn, row) for row in axes])
    return rest, axes


def jet_force(scene: Scene, emitter: Emitter, clock: float) -> Jet:
    """Return the force that holds the speed of a jet in its inlet at `clock` [s] of the scene."""
    inlet, dim = emitter.inlet(scene.spacing), scene.dim
    middle, axes = inlet_frame(emitter, dim, clock)
    g = np.zeros(3)
    g[:dim] = gravity_at(scene, clock - scene.start_time)
    half = (inlet.half[0] + 0.5 * scene.spacing, inlet.half[1] + 0.5 * scene.spacing)
    return Jet(
        opening=opening_of(
            middle,
            axes,
            half,
            is_round=int(emitter.shape in ("disc", "ring")),
            length=HELD * scene.spacing,
            speed=emitter.pace(inlet) * math.cos(emitter.spread),
            fall=float(g @ axes[2]),
        )
    )


def closing_speed(jets: Iterable[Jet]) -> float:
    """Return the largest relative speed [m/s] of two jets that meet; 0 where none do.

    Particles that move half a spacing in a step towards each other overlap after it, and the constraint separates them
    faster than they came. Two jets meet where their straight paths come as close as their inlets are large.
    """
    mouths = [jet.opening for jet in jets]
    fastest = 0.0
    for one, other in itertools.combinations(mouths, 2):
        (place, speed), (goal, pace) = (
            (np.array(opening.middle, float), float(opening.speed) * np.array(opening.ahead, float))
            for opening in (one, other)
        )
        way, relative = goal - place, pace - speed
        approach, square = -float(way @ relative), float(relative @ relative)
        if approach <= 0.0:
            continue
        nearest = np.linalg.norm(way + approach / square * relative)
        if nearest <= sum(math.hypot(opening.half_across, opening.half_up) for opening in (one, other)):
            fastest = max(fastest, math.sqrt(square))
    return fastest


def outlines(scene: Scene, time: float) -> list[tuple[str, np.ndarray]]:
    """Return outlines of inlets and of outlets in walls at `time` [s], each a closed line of points [n, 3] [m]."""
    found, clock, turn = list[tuple[str, np.ndarray]](), time + scene.start_time, np.linspace(0.0, math.tau, 25)
    circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)], float)
    for emitter in (emitter.at(clock) for emitter in scene.emitters if emitter.mesh is None):
        middle, axes = inlet_frame(emitter, scene.dim, clock)
        edge = circle if emitter.shape in ("disc", "ring") else corners
        found.append(("emitter", middle + (edge * emitter.inlet(scene.spacing).half) @ axes[:2]))
    for drain in (drain.at(clock) for drain in scene.drains if drain.shape == "mouth"):
        assert drain.radius is not None
        axes = frame_of(unit_vector(drain.direction), scene.dim)
        flat = circle * (1.0, 0.0 if scene.dim == 2 else 1.0)
        found.append(("drain", np.array([*(drain.center or ()), 0.0][:3], float) + drain.radius * flat @ axes[:2]))
    return found
