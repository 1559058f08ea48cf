"""How tools move solids: along a path, and bodies by a force or a spring at a point.

A body takes an impulse at once, as velocity; the water around it takes its share in the next time steps.

    code       symbol    meaning                                             unit
    arm        r         from the centre of mass to the point                m
    mobility   K         1/m - [r] I^-1 [r]: speed of the point by impulse   1/kg
    stretch    s         from the point to the hand                          m
    stiffness  k                                                             N/m
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.foundation.rotations import inverse, turned
from wavetank.simulation.body import Body
from wavetank.simulation.simulation import Simulation

TOOL_SOLID = "tool: "  # prefix of the names of solids that belong to a tool and are removed with it
TURN_DAMPING = 6.0  # 1/s, of the rotation of a body on a spring
REFERENCE = 0.25  # of the world's length: edge of the cube of water whose weight is the unit of force


def move_towards(
    sim: Simulation, name: str, goal: np.ndarray, rotation: Any, most: float, *, inside: bool = True
) -> bool:
    """Move a solid towards `goal` [m] by at most `most` [m] in the next frame; return whether it gets there.

    With `inside` its origin stays in the tank, so that it cannot get lost behind a wall.
    """
    where = sim.solids.poses[sim.solids.find(name)][0]
    place = np.array(goal, float)
    if inside and sim.scene.tank is not None:
        dim = sim.scene.dim
        place[:dim] = np.clip(place[:dim], *sim.scene.tank.box())
        place[dim:] = 0.0
    way = place - where
    length = float(np.linalg.norm(way))
    place = where + way * min(1.0, most / max(length, 1e-12))
    sim.move(name, tuple(place[: sim.scene.dim]), rotation)
    return length <= most


def force_unit(sim: Simulation, length: float) -> float:
    """Return the weight [N] of a cube of water a quarter as large as the world's `length` [m].

    In a 2-D world that of a square, a metre long.
    """
    return 9810.0 * (REFERENCE * length) ** sim.scene.dim


def to_body_frame(body: Body, place: np.ndarray) -> np.ndarray:
    """Transform a point [m] from the world to the frame of a body."""
    position = np.array([*body.position, 0.0][:3])
    return turned(inverse(body.rotation), place - position)


def to_world_frame(body: Body, point: np.ndarray) -> np.ndarray:
    """Transform a point [m] from the frame of a body to the world."""
    return np.array([*body.position, 0.0][:3]) + turned(body.rotation, point)


def apply_force(body: Body, point: np.ndarray, force: np.ndarray, duration: float) -> None:
    """Apply a force [N] at a point of a body for a `duration` [s]."""
    arm = to_world_frame(body, point) - body.center
    _apply_impulse(body, arm, np.asarray(force, float) * duration)


@dataclasses.dataclass(frozen=True)
class Spring:
    """A critically damped spring that reaches `max_force` [N], and stays there, at a `stretch` [m]."""

    max_force: float
    stretch: float


def pull_with_spring(
    sim: Simulation, body: Body, point: np.ndarray, goal: np.ndarray, speed: np.ndarray, spring: Spring, duration: float
) -> np.ndarray:
    """Pull a point of a body towards a `goal` [m] that moves with a `speed` [m/s], and return the force [N].

    Implicit in time, (1 + (c dt + k dt^2) K) J = (k s + (c + k dt) ds/dt) dt for the impulse J, where ds/dt is what it
    will be by the weight and the water alone. The rotation of the body is damped.
    """
    place = to_world_frame(body, point)
    arm = place - body.center
    moving = np.array([*body.velocity, 0.0][:3]) + np.cross(body.angular_velocity, arm)
    moving += duration * np.array([*(np.array(sim.gravity) + body.force / body.mass), 0.0][:3])
    stiffness = spring.max_force / spring.stretch
    damping = 2.0 * np.sqrt(stiffness * body.mass)
    mobility = _point_mobility(body, arm)
    drive = (stiffness * (goal - place) + (damping + stiffness * duration) * (speed - moving)) * duration
    whole = np.eye(3) + (damping * duration + stiffness * duration**2) * mobility
    impulse = np.linalg.solve(whole, drive)
    if len(body.position) == 2:
        impulse[2] = 0.0
    impulse *= min(1.0, spring.max_force * duration / max(float(np.linalg.norm(impulse)), 1e-30))
    body.angular_velocity = body.angular_velocity * max(0.0, 1.0 - TURN_DAMPING * duration)
    _apply_impulse(body, arm, impulse)
    force: np.ndarray = impulse / duration
    return force


def _point_mobility(body: Body, arm: np.ndarray) -> np.ndarray:
    cross = np.cross(np.eye(3), arm)  # its rows times a vector are arm x vector, up to the sign that squares away
    mobility: np.ndarray = np.eye(3) / body.mass + cross @ _inverse_inertia(body) @ cross.T
    return mobility


def _inverse_inertia(body: Body) -> np.ndarray:
    """Return the inverse inertia tensor in the world [1/(kg m^2)], [3, 3]; in 2-D about the normal only."""
    turn = np.array([turned(body.rotation, axis) for axis in np.eye(3)]).T
    inertia = turn @ body.dry.tensor @ turn.T
    if len(body.position) == 2:
        return np.diag([0.0, 0.0, 1.0 / inertia[2, 2]])
    return np.linalg.inv(inertia)


def _apply_impulse(body: Body, arm: np.ndarray, impulse: np.ndarray) -> None:
    body.velocity = body.velocity + impulse[: len(body.position)] / body.mass
    body.angular_velocity = body.angular_velocity + _inverse_inertia(body) @ np.cross(arm, impulse)
