"""How solids are approached: what of their answer the grid is told, because their layers do not give it.

A wall's layers answer the way of a particle towards it by a share that falls with the distance: in full where water
presses on it, by a third below a body, where water stands off a little. `MISSING` of `correction.py` makes up for what
lacks where water rests. What a solid moves by itself in a step is answered in full, whatever the distance: the layer of
particles at it has to make room for all of that way. Else a body closes the gap first and hits the water three steps
later (notebook/bodies.md, "A barge that is pushed down").

    code      meaning                                                              unit
    driven    way of a particle in this step but for gravity and carried pressure  m
    missing   share by which the answer of solids is increased                     1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Scratch, Walls
from wavetank.physics.boundary import next_near, wall_share
from wavetank.physics.near_solids import facing_at, known, place_of
from wavetank.solids.distance import SolidSet, image_near, plane_distance, rotate, to_local, vec3


@qd.func
def approached(
    i,
    x,
    p,
    driven,
    near,
    scratch: Scratch,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    missing,
    spacing,
    searched: qd.template(),
):
    """Relative density that the solids near particle `i` have added on its way from `x` to `p`, in their motion."""
    added, free = 0.0, 1.0
    k = next_near(near, -1, solids)
    while k < solids.tank_count:
        add_approach(added, free, plane_distance(solids, k, p), p - x, walls, c, missing)
        k = next_near(near, k, solids)
    if qd.static(searched):
        if near >> solids.tank_count != 0:
            for slot in range(known(scratch, i)):
                at = place_of(scratch, i, slot)
                value = facing_at(scratch, at, i, p)
                if value.w < qd.max(c.h, farthest() * spacing):  # else nothing of it counts
                    k = scratch.solid[at]
                    before = image_near(solids, k, x)
                    own = to_local(solids.old_position[k], solids.old_rotation[k], before)
                    moved = solids.position[k] + rotate(solids.rotation[k], own) - before
                    if solids.sweep[k].norm_sqr() > 0.0:
                        added += free * not_answered(value, moved - driven, walls, c, missing, spacing)
                    add_approach(added, free, value, p - x - moved, walls, c, missing)
    return added


@qd.func
def farthest():
    """Spacings from a solid up to which particles have to make room for it."""
    return 1.25


@qd.func
def not_answered(value, moved, walls: Walls, c: Coefficients, missing, spacing):
    """What lacks of the answer to a solid, (gradient, distance) as `value`, that has `moved` [m] in this step.

    Its layer of particles has to make room for all of its way.
    """
    layer = qd.min(qd.max(2.0 * farthest() - 2.0 * value.w / spacing, 0.0), 1.0) / spacing
    answer = (1.0 + missing) * wall_share(walls, value.w, c.h)[1] * c.wall_density / c.h
    return moved.dot(vec3(value.x, value.y, value.z)) * qd.max(layer - answer, 0.0)


@qd.func
def add_approach(added: qd.template(), free: qd.template(), value, way, walls: Walls, c: Coefficients, missing):
    """Add what a solid, (gradient, distance) as `value`, has added on a `way` [m] relative to it."""
    if value.w < c.h:
        share = wall_share(walls, value.w, c.h) * c.wall_density
        inward = -missing * way.dot(vec3(value.x, value.y, value.z))
        added = added * (1.0 - share[0]) + inward * free * share[1] / c.h
        free *= 1.0 - share[0]
