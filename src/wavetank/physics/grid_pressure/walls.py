"""What walls answer a particle that comes near, of which the grid is told what lacks.

Layers of a wall that move with a particle by half of its way (`smoothing.WALL_STIFFENING`) answer it with 3/4 of the
density that water would, so that the grid removed only 3/4 of what runs into a wall in a step, and water at rest made
up for it by standing too close. The grid is told the rest: `MISSING` times what the way of this step has added. As it
is the way that counts and not the place, it does not shift where water rests.

    code     meaning                                                                      unit
    way      of a particle in this step, in the motion of the solid                       m
    share    part of rho_0 that a wall contributes, and its slope                         1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Walls
from wavetank.physics.boundary import next_near, wall_share
from wavetank.solids.distance import SolidSet, plane_distance, rotate, signed_distance, to_local, vec3, vec4


@qd.func
def approached(x, p, near, solids: SolidSet, walls: Walls, c: Coefficients, searched: qd.template()):
    """Relative density that the marked solids have added on the way from `x` to `p`, in their motion."""
    added, free = 0.0, 1.0
    k = next_near(near, -1, solids)
    while k < (solids.count if qd.static(searched) else solids.tank_count):
        value = vec4(0.0, 0.0, 0.0, 0.0)
        way = p - x
        if qd.static(searched):
            value = signed_distance(solids, k, p)
            if k >= solids.tank_count:
                own = to_local(solids.old_position[k], solids.old_rotation[k], x)
                way = p - solids.position[k] - rotate(solids.rotation[k], own)
        else:
            value = plane_distance(solids, k, p)
        if value.w < c.h:
            share = wall_share(walls, value.w, c.h) * c.wall_density
            inward = -way.dot(vec3(value.x, value.y, value.z))
            added = added * (1.0 - share[0]) + inward * free * share[1] / c.h
            free *= 1.0 - share[0]
        k = next_near(near, k, solids)
    return added
