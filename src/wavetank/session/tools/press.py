"""What a hand does to a body: it presses at a point, or holds that point with a spring.

A body gets the hand's impulse at once, as velocity; the water that goes along with it gets its share in the next steps.

    code       symbol    meaning                                             unit
    arm        r         from the centre of mass to the point                m
    softness   K         1/m - [r] I^-1 [r]: speed of the point by impulse   1/kg
    stretch    s         from the point to the hand                          m
    stiffness  k                                                             N/m
"""

import dataclasses

import numpy as np

from wavetank.foundation.rotations import inverse, turned
from wavetank.simulation.body import Body
from wavetank.simulation.simulation import Simulation

STEADY = 6.0  # 1/s: how fast a body that is held stops turning
REFERENCE = 0.25  # of the world's length: edge of the cube of water whose weight is the unit of strength


def unit_of_force(sim: Simulation, length: float) -> float:
    """Return the weight [N] of a cube of water a quarter as large as the world's `length` [m].

    In a 2-D world that of a square, a metre long.
    """
    return 9810.0 * (REFERENCE * length) ** sim.scene.dim


def point_on(body: Body, place: np.ndarray) -> np.ndarray:
    """Return a place in the world [m] in the frame of a body."""
    position = np.array([*body.position, 0.0][:3])
    return turned(inverse(body.rotation), place - position)


def place_of(body: Body, point: np.ndarray) -> np.ndarray:
    """Return where that point of the body is in the world [m]."""
    return np.array([*body.position, 0.0][:3]) + turned(body.rotation, point)


def press(body: Body, point: np.ndarray, force: np.ndarray, duration: float) -> None:
    """Press on a point of a body with a force [N] for a `duration` [s]."""
    arm = place_of(body, point) - body.center
    _hit(body, arm, np.asarray(force, float) * duration)


@dataclasses.dataclass(frozen=True)
class Spring:
    """Pulls with `strongest` [N] where it is stretched by `far` [m], and never more; it is damped critically."""

    strongest: float
    far: float


def hold(
    sim: Simulation, body: Body, point: np.ndarray, goal: np.ndarray, speed: np.ndarray, spring: Spring, duration: float
) -> np.ndarray:
    """Pull a point of a body towards a `goal` [m] that moves with a `speed` [m/s], and return the force [N].

    Implicit in time, (1 + (c dt + k dt^2) K) J = (k s + (c + k dt) ds/dt) dt for the impulse J, where ds/dt is what it
    will be by the weight and the water alone. The body turns ever slower in the hand.
    """
    place = place_of(body, point)
    arm = place - body.center
    moving = np.array([*body.velocity, 0.0][:3]) + np.cross(body.angular_velocity, arm)
    moving += duration * np.array([*(np.array(sim.gravity) + body.force / body.mass), 0.0][:3])
    stiffness = spring.strongest / spring.far
    damping = 2.0 * np.sqrt(stiffness * body.mass)
    softness = _softness(body, arm)
    drive = (stiffness * (goal - place) + (damping + stiffness * duration) * (speed - moving)) * duration
    whole = np.eye(3) + (damping * duration + stiffness * duration**2) * softness
    impulse = np.linalg.solve(whole, drive)
    if len(body.position) == 2:
        impulse[2] = 0.0
    impulse *= min(1.0, spring.strongest * duration / max(float(np.linalg.norm(impulse)), 1e-30))
    body.angular_velocity = body.angular_velocity * max(0.0, 1.0 - STEADY * duration)
    _hit(body, arm, impulse)
    force: np.ndarray = impulse / duration
    return force


def _softness(body: Body, arm: np.ndarray) -> np.ndarray:
    cross = np.cross(np.eye(3), arm)  # its rows times a vector are arm x vector, up to the sign that squares away
    softness: np.ndarray = np.eye(3) / body.mass + cross @ _turning(body) @ cross.T
    return softness


def _turning(body: Body) -> np.ndarray:
    """Return the inverse of the inertia in the world [1/(kg m^2)]; in a plane a body turns about its normal only."""
    turn = np.array([turned(body.rotation, axis) for axis in np.eye(3)]).T
    inertia = turn @ body.dry.tensor @ turn.T
    if len(body.position) == 2:
        return np.diag([0.0, 0.0, 1.0 / inertia[2, 2]])
    return np.linalg.inv(inertia)


def _hit(body: Body, arm: np.ndarray, impulse: np.ndarray) -> None:
    body.velocity = body.velocity + impulse[: len(body.position)] / body.mass
    body.angular_velocity = body.angular_velocity + _turning(body) @ np.cross(arm, impulse)
