"""Narrow phase of contact: where the path of a particle ends that would lead into solids.

Conservative advancement along the path (Hart 1996, "Sphere tracing", 10.1007/s003710050084): whatever the speed,
nothing passes through a wall that the distance function resolves. Bodies feel the opposite of what they stop.

    code      meaning                                                        unit
    gap       distance that particles keep from solids                       m
    origin    where the path begins: the position at the start of the step   m
    target    where it leads: the predicted position                         m
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Particles, Temporaries
from wavetank.physics.bodies import push_back
from wavetank.physics.broad_phase import marked_walls, next_marked, swept_length
from wavetank.physics.predicted_positions import predict_at, predicted
from wavetank.solids.distance import SolidSet, image_near, lift, local_distance, plane_distance, rotate, to_local, vec3


@qd.func
def advance(k, at, end, solids: SolidSet, gap):
    """Return where a particle that moves from `at` towards `end` arrives, both in the frame of solid `k`.

    The path is followed in steps as long as the distance to the solid; where it touches, the rest of it slides along
    the surface. One call of `local_distance` serves all phases, because each is inlined and compiled.
    """
    nearest = 0.1 * gap
    # 0: does the path touch the solid? 1: follow it, in 64 steps at most. 2 and 3: keep the gap where it ends.
    phase, steps = 0, 0
    while phase < 4:
        probe = end
        if phase == 1:
            probe = at
        value = local_distance(solids, k, probe)
        n = vec3(value.x, value.y, value.z)
        way = end - at
        length = way.norm()
        if phase == 0:
            # A path no longer than the distance at its end does not touch.
            phase = 4 if value.w >= qd.max(gap, length) else 1
        elif phase == 1:
            inward = way.dot(n)
            if value.w >= length:
                at = end
            elif value.w > nearest or inward >= 0.0:
                at += way * (qd.max(value.w, nearest) / length)
            else:
                end -= n * inward
                # What is left of a path straight into the wall is rounding.
                if (end - at).norm() < 1e-3 * length:
                    end = at
            steps += 1
            if steps == 64:
                end = at  # the rest of the path is not known to be free
                phase = 2
        else:
            end += n * qd.max(gap - value.w, 0.0)
            phase += 1
        if phase == 1 and (end - at).norm() == 0.0:
            phase = 2
    return end


@qd.func
def clamp_to_tank(target, near, solids: SolidSet, gap):
    """Return the point `target` moved back in front of the marked walls of the tank; nothing passes a half-space."""
    walls = marked_walls(near, solids)
    while walls != 0:
        value = plane_distance(solids, qd.math.ffs(walls) - 1, target)
        target += vec3(value.x, value.y, value.z) * qd.max(gap - value.w, 0.0)
        walls &= walls - 1
    return target


@qd.func
def image_of(point, place, image, solids: SolidSet):
    """The image of a `point` [m] that is as near to the `image` of a `place` as the point is to the place."""
    moved = point
    if qd.static(solids.repeats):
        moved += image - place
    return moved


@qd.func
def end_of_path(origin, target, near, solids: SolidSet, gap, mass, coupled: qd.template()):
    """Return where the path from `origin` to `target` ends outside of the marked solids, in their motion.

    Where `coupled`, bodies are pushed by what moves this `mass`, over that of a particle of the heaviest fluid. The
    tank comes last, as it is convex from inside. Where a solid has moved the particle all are tested a second time.
    """
    times, moved = 0, 1
    while times < 2 and moved == 1:
        moved = 0
        last, push = -1, vec3(0.0, 0.0, 0.0)
        k = next_marked(near, solids.tank_count - 1, solids)
        while k < solids.count:
            image = image_near(solids, k, target)
            away = (image - solids.position[k]).norm()
            if away < solids.reach[k] + gap + swept_length(k, (target - origin).norm(), image, solids):
                rotation = solids.rotation[k]
                end = to_local(solids.position[k], rotation, image)
                at = to_local(solids.old_position[k], solids.old_rotation[k], image_of(origin, target, image, solids))
                out = advance(k, at, end, solids, gap)
                if (out - end).norm() > 0.0:
                    before = target
                    target = image_of(solids.position[k] + rotate(rotation, out), image, before, solids)
                    moved = 1
                    if qd.static(coupled):
                        last, push = k, target - before
                        push_back(solids, k, target, mass * push)
            k = next_marked(near, k, solids)
        walls = near if moved == 0 else -1  # once moved, perhaps beyond its marks
        inside = clamp_to_tank(target, walls, solids, gap)
        if (inside - target).norm_sqr() > 0.0:
            if qd.static(coupled):
                if last >= 0:  # what is held between body and tank goes nowhere, and is not a push
                    undone = qd.max(0.0, qd.min(1.0, (target - inside).dot(push) / push.norm_sqr()))
                    push_back(solids, last, target, (-mass * undone) * push)
            target = inside
            moved = 1
        times += 1
    return target


@qd.func
def flattened(point, x: qd.template()):
    """The vector `point` of space as one of the world of `x`, 2-D or 3-D."""
    result = x
    for k in qd.static(range(x.n)):
        result[k] = point[k]
    return result


@qd.func
def mass_ratio(particles: Particles, i, rows: qd.template()):
    """Mass of particle i over that of the heaviest fluid; 1 before the first step, which writes the `rows`."""
    weight = rows[particles.material[i]][0]
    return 1.0 / weight if weight > 0.0 else 1.0


@qd.kernel(fastcache=True)
def resolve_contacts(
    particles: Particles,
    temporaries: Temporaries,
    solids: SolidSet,
    rows: qd.types.ndarray(),
    c: Coefficients,
    count: qd.i32,
    coupled: qd.template(),
):
    """Move predicted positions out of solids, of particles whose path may touch some; bodies feel it if `coupled`."""
    for i in range(count):
        if temporaries.touching[i] == 1:
            x = lift(particles.x[i])
            p = predicted(particles, i)
            near, mass = particles.near[i], mass_ratio(particles, i, rows)
            out = end_of_path(x, lift(p), near, solids, c.wall_gap, mass, coupled)
            predict_at(particles, i, flattened(out, p))
