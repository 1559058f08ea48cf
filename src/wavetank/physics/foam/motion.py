"""How spray flies, foam drifts and bubbles rise.

Ihmsen et al. 2012 (10.1007/s00371-012-0697-9), Sec. 3.3 and 3.4. What a particle is follows from the share of water
around it: spray has hardly any, a bubble is surrounded by it, foam is what is at the surface.

    code       symbol          meaning                                                        unit
    share      phi             share of water around a point, 1 in the bulk, 1/2 at a surface 1
    medium     v_f             velocity of the water (of the air: zero)                       m/s
    keep       e = exp(-k dt)  part of the relative velocity that drag leaves                 1
    path       (1 - e) / k     way per relative velocity                                      s
    bend       (dt - path) / k way per acceleration                                           s^2
    k          k               drag rate                                                      1/s

Where we differ, and why:
- Drag is linear and integrated exactly, x'' = a - k (x' - v_f), so that one step a frame is enough and is stable for
  any k. A spray particle follows x = x_0 + v_f t + (v_0 - v_f) path + a bend to rounding.
- A bubble accelerates with 2 g (buoyancy over the added mass of a sphere, half its volume of water) up to a terminal
  speed of a tenth of U above the water's.
- The share of water is a smooth sum instead of a number of neighbours, and what solids take of the support is left
  out of it, so that water at a wall is not taken for a surface.
- All kinds age.
- Looking around is most of the work, and a frame is a short time for much water: each looks once in an interval
  (`update.INTERVAL`, two frames of a tank of half a metre and more) and keeps its velocity between; spray falls on.
"""

from wavetank.device.compiler import qd
from wavetank.device.periods import nearest_image, within
from wavetank.device.state import Air, Births, Coefficients, Diffuse, Grid, Particles, bubble, foam, spray
from wavetank.device.sums import sum_up
from wavetank.physics.broad_phase import obstacles_in_reach
from wavetank.physics.contact import end_of_path, flattened
from wavetank.physics.neighbors import for_each_row_around, near_bits, row_block
from wavetank.physics.predicted_positions import predicted
from wavetank.solids.distance import SolidSet, image_near, lift, signed_distance, vec2, vec3


@qd.func
def add_water(sums: qd.template(), point, begin, end, water: Particles, grid: Grid, h):
    """Add the water particles of a row to (sum W, sum v W) with Poly6."""
    block = qd.static(row_block(point.n))
    place = qd.Matrix.zero(qd.f32, point.n, 1)
    for k in qd.static(range(point.n)):
        place[k, 0] = point[k]
    first = begin
    while first < end:
        hits = near_bits(water, place, first, qd.min(end - first, block), h * h, grid, True)
        while hits != qd.u32(0):
            j = first + qd.math.ffs(hits) - 1
            hits &= hits - qd.u32(1)
            r = nearest_image(point - predicted(water, j), grid.periods)
            t = qd.max(1.0 - r.norm_sqr() / (h * h), 0.0)
            w = t * t * t
            sums[0] += w
            for k in qd.static(range(point.n)):
                sums[1 + k] += w * water.v[j][k]
        first += block


@qd.func
def surroundings(point, solids: SolidSet, h):
    """(distance to the nearest solid [m], share of the support around `point` that is not inside of one).

    The share is that of Poly6 over a half-space for each solid. The polynomial is the integral in space; in the plane
    it is off by 0.02 at most. Solids beyond the support are not asked: without any the distance is h.
    """
    nearest, free = h, 1.0
    for k in range(solids.count):
        if k < solids.tank_count or (image_near(solids, k, point) - solids.position[k]).norm() < solids.reach[k] + h:
            distance = signed_distance(solids, k, point).w
            if distance < h:
                nearest = qd.min(nearest, distance)
                t = qd.max(distance / h, -1.0)
                s = t * t
                free *= 0.5 + 1.2304688 * t * (1.0 - s * (1.3333333 - s * (1.2 - s * (0.57142857 - s / 9.0))))
    return vec2(nearest, free)


@qd.func
def water_at(point: qd.template(), free, water: Particles, grid: Grid, c: Coefficients, a: Air):
    """(share of water, its mean velocity [m/s]) around `point`, of whose support the share `free` is outside solids."""
    sums = qd.Vector([0.0] * (point.n + 1))
    for_each_row_around(sums, add_water, point, water, grid, c.h)
    for k in qd.static(range(point.n)):
        sums[1 + k] /= qd.max(sums[0], 1e-12)
    sums[0] *= a.share / qd.max(free, 0.1)
    return sums


@qd.func
def kind_in(share):
    """Spray, foam or bubble, by the share of water around it."""
    kind = foam()
    if share < 0.2:
        kind = spray()
    elif share > 0.7:
        kind = bubble()
    return kind


@qd.kernel(fastcache=True)
def move(
    packed: Diffuse,
    diffuse: Diffuse,
    births: Births,
    water: Particles,
    grid: Grid,
    solids: SolidSet,
    c: Coefficients,
    a: Air,
    frame: qd.i32,
    count: qd.i32,
    shared: qd.template(),
) -> qd.i32:
    """Move everything by one frame, and copy those who live on to the front, in their order.

    Return the number of those. Each looks around every so many frames, tells anew what it is and takes the velocity
    that it keeps until it looks again. Threads share the sums where `shared`.
    """
    for i in range(count):
        x = diffuse.x[i]
        v = diffuse.v[i]
        kind = diffuse.kind[i]
        target, later = x + a.dt * v, v
        medium, pull = x * 0.0, x * 0.0
        gravity = vec3(c.gravity_x, c.gravity_y, c.gravity_z)
        for k in qd.static(range(x.n)):
            pull[k] = gravity[k]
        looks = (diffuse.id[i] + frame) % a.every == 0
        if looks:
            # The water has moved already: what is around is asked where the particle gets to.
            room = surroundings(lift(target), solids, c.h)
            here = water_at(target, room[1], water, grid, c, a)
            kind = kind_in(here[0])
            for k in qd.static(range(x.n)):
                medium[k] = here[1 + k]
        if kind == spray():
            later = v * a.spray_keep + pull * a.spray_path
            target = x + v * a.spray_path + pull * a.spray_bend
        elif looks and kind == foam():
            later = medium
            target = x + 0.5 * a.dt * (v + medium)
        elif looks:
            slip = v - medium
            later = medium + slip * a.bubble_keep - 2.0 * pull * a.bubble_gain
            target = x + a.dt * medium + slip * a.bubble_path - 2.0 * pull * a.bubble_bend
        near = obstacles_in_reach(lift(x), lift(target), solids, c.wall_gap) | ((1 << solids.tank_count) - 1)
        out = end_of_path(lift(x), lift(target), near, solids, c.wall_gap, 0.0, False)
        if (out - lift(target)).norm_sqr() > 0.0:
            target = flattened(out, x)
            later = (target - x) / a.dt
        diffuse.x[i] = within(target, grid.periods)
        diffuse.v[i] = later
        diffuse.kind[i] = kind
        age = diffuse.age[i] + a.dt
        diffuse.age[i] = age
        # Written so that what is not a number ends as well.
        births.kept[i] = qd.cast(age < diffuse.life[i] and target.norm_sqr() < 1e30, qd.i32)
    sum_up(births.kept, births.blocks, count, shared)
    for i in range(count):
        place = births.kept[i]
        if births.kept[i + 1] > place:
            packed.x[place] = diffuse.x[i]
            packed.v[place] = diffuse.v[i]
            packed.kind[place] = diffuse.kind[i]
            packed.age[place] = diffuse.age[i]
            packed.life[place] = diffuse.life[i]
            packed.id[place] = diffuse.id[i]
    return births.kept[count]
