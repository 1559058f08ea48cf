"""Body forces of a scene on rigid bodies: each piece of a body is accelerated as the water would be in its place.

A force is a kernel over particles, and may be a user's own. So it is given particles in place of pieces of the bodies,
with the velocities of these pieces, and the change of their velocities, by mass and lever arm, is that of the body.

    code      meaning                                            unit
    places    of the pieces, in the frame of the solid           m
    shares    mass of a piece over that of its body              1
"""

from collections.abc import Iterable, Sequence

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.device.state import new_particles
from wavetank.foundation.rotations import turned
from wavetank.scene.forces import Force
from wavetank.scene.forces.jet import Jet
from wavetank.simulation.body import Body
from wavetank.simulation.forces import apply_force
from wavetank.solids.mass import Ruler

ACROSS = 4  # pieces along the largest extent of a body


class BodyForces:
    """Pieces of all bodies, as particles that forces act on."""

    def __init__(self, members: Sequence[Body], dim: int, spacing: float) -> None:
        self.members, self.dim = members, dim
        self.places, self.shares = [], []
        for body in members:
            cut = Ruler(body.solid, dim, spacing).cut(2.0 * body.solid.reach() / ACROSS)
            weights = cut.shells if body.solid.hollow else cut.volumes
            self.places.append(cut.places)
            self.shares.append(weights / weights.sum())
        self.ends = np.cumsum([0, *map(len, self.places)])
        self.particles = new_particles(dim, int(self.ends[-1]))

    def impulses(self, forces: Iterable[Force], dt: float, time: float) -> np.ndarray:
        """Return the impulses [n, 6] [kg m/s, kg m^2/s] of forces on bodies in a step of `dt` [s] from `time` [s]."""
        result = np.zeros((len(self.members), 6))
        forces = [force for force in forces if not isinstance(force, Jet)]  # it acts on the water in an inlet
        if not forces:
            return result
        x, v = np.zeros((2, int(self.ends[-1]), 3))
        for number, body in enumerate(self.members):
            place, turn = body.pose()
            piece = slice(self.ends[number], self.ends[number + 1])
            x[piece] = place + turned(turn, self.places[number])
            velocity = body.coupling.velocity[body.row]
            v[piece] = velocity[:3] + np.cross(velocity[3:], x[piece] - body.center)
        before = np.float32(v[:, : self.dim])
        upload(self.particles.x, x[:, : self.dim])
        upload(self.particles.v, before)
        for force in forces:
            apply_force(force, self.particles, len(x), dt, time)
        gained = np.zeros_like(x)
        gained[:, : self.dim] = download(self.particles.v)[: len(x)] - before
        for number, body in enumerate(self.members):
            piece = slice(self.ends[number], self.ends[number + 1])
            momentum = body.mass * self.shares[number][:, None] * gained[piece]
            result[number, :3] = momentum.sum(axis=0)
            result[number, 3:] = np.cross(x[piece] - body.center, momentum).sum(axis=0)
        return result
