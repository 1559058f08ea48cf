"""Solids by sphere tracing: step along the ray by the distance to the solid until it is reached.

Each ray looks only at solids whose bounding ball it meets, and no farther than what is already there. A window in
the world clips what is drawn: solids without end stop at the tank, and a 2-D world shows the cut at its plane. Where
a ray enters the window inside a solid, the cut face is drawn.

    code     symbol   meaning                                       unit
    t                 depth along the ray                           m
    pace              way per metre of depth, the ray's length      m/m
    first, last       depths between which a solid may be met       m
"""

from wavetank.compiler import qd
from wavetank.distance import SolidSet, signed_distance
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, vec2, vec3, vec4, view_ray
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Draw the solids that are not walls of the tank, in front of or behind what is there."""
    solids = shot.frame.solids
    if solids.count > solids.tank_count:
        lower, upper = window(shot)
        trace(
            solids, lower, upper, shot.lens, shot.look.solid, buffers.depth, buffers.surface, buffers.normal,
            buffers.color,
        )  # fmt: skip


def window(shot: Shot) -> tuple[vec3, vec3]:
    """Return the corners [m] of the box within which solids are drawn."""
    lower, upper = [-1e4] * 3, [1e4] * 3
    if shot.frame.dim == 2:
        # In front of the particles, which are balls around the plane and would cover the rim of the solid.
        lower[2] = upper[2] = shot.radius
    return vec3(*lower), vec3(*upper)


@qd.func
def box_interval(origin, direction, lower, upper):
    """Depths at which a ray enters and leaves a box; enters after leaving where it misses."""
    first, last = -1e9, 1e9
    for k in qd.static(range(3)):
        slope = direction[k]
        if qd.abs(slope) < 1e-9:
            slope = 1e-9
        a, b = (lower[k] - origin[k]) / slope, (upper[k] - origin[k]) / slope
        first, last = qd.max(first, qd.min(a, b)), qd.min(last, qd.max(a, b))
    return vec2(first, last)


@qd.func
def ball_interval(origin, direction, center, r):
    """Depths at which a ray enters and leaves a ball; enters after leaving where it misses."""
    square = direction.dot(direction)
    nearest = (center - origin).dot(direction) / square
    miss = center - origin - nearest * direction
    half = r * r - miss.dot(miss)
    interval = vec2(1.0, -1.0)
    if half >= 0.0:
        reach = qd.sqrt(half / square)
        interval = vec2(nearest - reach, nearest + reach)
    return interval


@qd.func
def meet(solids: SolidSet, k, origin, direction, first, last):
    """(normal, depth) where a ray meets solid `k` between two depths; depth -1 where it does not."""
    pace = direction.norm()
    t = first
    hit = vec4(0.0, 0.0, 0.0, -1.0)
    value = signed_distance(solids, k, origin + t * direction)
    if value.w <= 0.0:
        toward = -direction / pace
        hit = vec4(toward.x, toward.y, toward.z, t)  # the cut face
    else:
        steps = 0
        # A ray that grazes a surface creeps; after so many steps it is near enough to none.
        while steps < 128 and t <= last:
            if value.w < 2e-4 * t + 1e-6:
                hit = vec4(value.x, value.y, value.z, t)
                break
            t += value.w / pace
            value = signed_distance(solids, k, origin + t * direction)
            steps += 1
    return hit


@qd.func
def nearest_solid(solids: SolidSet, lower, upper, origin, direction, near, far):
    """(normal, depth) of the first solid on a ray between two depths; depth -1 where there is none."""
    best = vec4(0.0, 0.0, 0.0, -1.0)
    last = far
    inside = box_interval(origin, direction, lower, upper)
    for k in range(solids.tank_count, solids.count):
        bound = ball_interval(origin, direction, solids.position[k], 1.001 * solids.reach[k] + 1e-4)
        first = qd.max(near, bound[0], inside[0])
        end = qd.min(last, bound[1], inside[1])
        if first <= end:
            hit = meet(solids, k, origin, direction, first, end)
            if hit.w >= 0.0:
                best = hit
                last = hit.w
    return best


@qd.kernel(fastcache=True)
def trace(
    solids: SolidSet, lower: vec3, upper: vec3, lens: Lens, albedo: vec3, depth: qd.types.ndarray(),
    surface: qd.types.ndarray(), normal: qd.types.ndarray(), color: qd.types.ndarray(),
):  # fmt: skip
    """Draw the nearest solid at every pixel where it is nearer than what is there."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        far = qd.min(qd.bit_cast(depth[row, column], qd.f32), 1e4)
        hit = nearest_solid(solids, lower, upper, ray_origin(lens, ray), ray_direction(lens, ray), lens.near, far)
        if hit.w > 0.0:
            depth[row, column] = qd.bit_cast(hit.w, qd.i32)
            surface[row, column] = -1  # SOLID
            normal[row, column] = vec3(hit.x, hit.y, hit.z)
            color[row, column] = albedo


@qd.kernel(fastcache=True)
def trace_depth(solids: SolidSet, lower: vec3, upper: vec3, lens: Lens, depth: qd.types.ndarray()):
    """Lower `depth` to that of the nearest solid."""
    for row, column in qd.ndrange(depth.shape[0], depth.shape[1]):
        ray = view_ray(lens, row, column)
        far = qd.min(qd.bit_cast(depth[row, column], qd.f32), 1e4)
        hit = nearest_solid(solids, lower, upper, ray_origin(lens, ray), ray_direction(lens, ray), lens.near, far)
        if hit.w > 0.0:
            depth[row, column] = qd.bit_cast(hit.w, qd.i32)
