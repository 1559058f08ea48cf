"""Sunlight that was refracted or reflected by the water: photon maps.

H. W. Jensen, "Global illumination using photon maps" (1996), with two maps in place of a tree: the floor has texels,
and solids read the flow of light in the cells of the water's grid (vector irradiance, A. Gershun 1936), which is
estimated from the path lengths of photons in the cells. Light that comes straight from the sun is not in the
maps: shadow rays add it. All sums are whole numbers.

    code      symbol   meaning                                                        unit
    floor              light on a texel over that of the bare sun on a plane to it    1
    flow      J        light through a cell: its vector, and its colours              1
    power              part of the sun's cross section that a photon stands for       m^2
"""

import dataclasses

from wavetank.device.compiler import qd
from wavetank.view.film.grid import Field, Grid, outward_at, value_at
from wavetank.view.film.march import Hit, World, cross_water, first_hit, past
from wavetank.view.film.medium import Medium, absorption_at, through_water
from wavetank.view.film.sampling import lamp_direction, pair, uniform_direction
from wavetank.view.film.turbidity import albedo_of, color_of, is_opaque, turbidity_at
from wavetank.view.lens import vec3
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import share_of
from wavetank.view.optics.hash_noise import scrambled
from wavetank.view.optics.interface import bent, index_of_water, mirrored, through_drop
from wavetank.view.paints import Finish

UNIT = 4096.0  # steps of a map in the light of the bare sun


@dataclasses.dataclass(frozen=True, eq=False)
class Photons:
    """The maps of the sun's light, on the device."""

    floor: qd.types.ndarray()  # i32 [rows, columns, 3]: along z and x
    flow: qd.types.ndarray()  # i32 [cells, 6]
    corner: vec3  # m: of the floor's map; y is the edge of a texel
    begin: vec3  # m: corner of the rectangle that photons start from
    right: vec3  # m: its sides
    up: vec3
    across: qd.i32  # photons along each side
    rows: qd.i32
    power: qd.f32  # m^2
    has_flow: qd.i32  # 1 where the flow is gathered


@qd.dataclass
class Photon:
    """A photon on its way; flags are 0 or 1."""

    p: vec3  # m
    ahead: vec3  # unit direction
    power: vec3  # share that is left of it, per colour
    in_water: qd.i32
    crossed: qd.i32  # whether it has met the water, so that shadow rays do not see to it
    going: qd.i32
    bounces: qd.i32


@qd.kernel(fastcache=True)
def trace_photons(photons: Photons, world: World, look: Look, medium: Medium, round: qd.i32):
    """Trace one round of photons from the sun, each from its own place of the rectangle, and add them to the maps."""
    for number in range(photons.across * photons.rows):
        column, row = number % photons.across, number // photons.across
        seed = scrambled(qd.cast(number, qd.u32) ^ qd.u32(0x51ED270B))
        u, lamp = pair(seed, round, 0), pair(seed, round, 1)
        p = (
            photons.begin
            + ((column + u.x) / photons.across) * photons.right
            + ((row + u.y) / photons.rows) * photons.up
        )
        photon = begun_photon(p, -lamp_direction(look.to_sun, look.sun_size, lamp))
        while photon.going == 1:
            hit, what, which, was_wet = first_hit(world, photon.p, photon.ahead, photon.in_water, 1)
            n = vec3(hit.x, hit.y, hit.z)
            at = photon.p + hit.w * photon.ahead
            chance, reached = pair(seed, round, 2 + 2 * photon.bounces), qd.min(hit.w, 1e3)
            transmittance = vec3(1.0, 1.0, 1.0)
            if was_wet == 1:
                free_depth = -qd.log(qd.max(1.0 - chance.y, 1e-7))
                transmittance, _added, reached = through_water(
                    medium, world.field.grid, photon.p, photon.ahead, reached, free_depth
                )
                if reached < qd.min(hit.w, 1e3):
                    what, at = Hit.SCATTERING, photon.p + reached * photon.ahead
            if photon.crossed > 0 and photons.has_flow == 1:
                add_to_flow(photons, world.field.grid, photon, reached, medium, was_wet)
            photon.power *= transmittance
            if what == Hit.SURFACE:
                direction, p, wet, _inward = cross_water(
                    photon.ahead, at, n, was_wet, chance.x, world.field.grid.step.x
                )
                photon.ahead, photon.p, photon.in_water, photon.crossed = direction, p, wet, 1
            elif what == Hit.DROP:
                cross_drop(photon, world, medium, which, at, n, chance.x)
            elif what == Hit.SOLID and world.finish[which] == Finish.GLASS:
                cross_glass(photon, world.paints[which], at, n, hit.w, was_wet)
            elif what == Hit.SCATTERING:
                scatter(photon, world, medium, at, pair(seed, round, 3 + 2 * photon.bounces))
            else:
                if what == Hit.FLOOR and photon.crossed > 0:
                    add_to_floor(photons, at, photon.power)
                photon.going = 0
            photon.bounces += 1
            if photon.bounces >= 12 + 60 * medium.is_turbid or photon.power.max() < 0.01:
                photon.going = 0


@qd.func
def begun_photon(p, ahead):
    """A photon that leaves the sun at a point in a direction."""
    return Photon(p=p, ahead=ahead, power=vec3(1.0, 1.0, 1.0), in_water=0, crossed=0, going=1, bounces=0)


@qd.func
def cross_drop(photon: qd.template(), world: World, medium: Medium, which, at, n, chance):
    """Reflect a photon at a drop, or send it through."""
    ball = world.balls.ball[which]
    through = bent(photon.ahead, n, 1.0 / index_of_water())
    photon.crossed = 1
    if chance < through.w:
        photon.ahead = mirrored(photon.ahead, n)
        photon.p = at + 1e-4 * ball.w * n
    else:
        inner = vec3(through.x, through.y, through.z)
        out, ahead = through_drop(ball, at, n, inner, photon.ahead)
        photon.ahead = ahead
        photon.p = vec3(out.x, out.y, out.z)
        photon.power *= qd.exp(-out.w * absorption_at(medium, world.field.grid, at))


@qd.func
def cross_glass(photon: qd.template(), color, at, n, way, was_wet):
    """Send a photon straight through a wall of glass, without what its two faces reflect in air."""
    mirror = bent(photon.ahead, qd.select(n.dot(photon.ahead) > 0.0, -n, n), 0.667).w
    if was_wet == 0:
        photon.power *= 1.0 - 2.0 * mirror / (1.0 + mirror)
    photon.power *= color
    photon.p, photon.in_water = at + past(way, n, photon.ahead) * photon.ahead, was_wet


@qd.func
def scatter(photon: qd.template(), world: World, medium: Medium, at, u):
    """Scatter a photon in a turbid fluid, the same to all sides; an opaque one ends it."""
    here = turbidity_at(medium.turbidity, world.field.grid, at)
    photon.power *= albedo_of(color_of(here))
    photon.p, photon.ahead, photon.in_water = at, uniform_direction(u), 1
    photon.crossed = 1
    if is_opaque(here, world.field.grid) == 1:
        photon.going = 0


@qd.func
def add_to_floor(photons: Photons, at, weight):
    """Add a photon to the four texels around its place."""
    texel = photons.corner.y
    x, z = (at.x - photons.corner.x) / texel - 0.5, (at.z - photons.corner.z) / texel - 0.5
    c, r = qd.cast(qd.floor(x), qd.i32), qd.cast(qd.floor(z), qd.i32)
    if r >= 0 and c >= 0 and r < photons.floor.shape[0] - 1 and c < photons.floor.shape[1] - 1:
        u, v = x - c, z - r
        for k in range(4):
            share = share_of(k, v, u)
            amount = 4096.0 * share * photons.power / (texel * texel)
            for color in qd.static(range(3)):
                qd.atomic_add(
                    photons.floor[r + k // 2, c + k % 2, color], qd.cast(amount * weight[color] + 0.5, qd.i32)
                )


@qd.func
def cell_of(grid: Grid, x):
    """Number of the cell at a point, -1 outside of the grid."""
    c = qd.cast(qd.floor((x - grid.lower) / (2.0 * grid.step)), qd.i32)
    mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    result = -1
    if qd.min(c.x, c.y, c.z) >= 0 and c.x < mx and c.y < my and c.z < mz:
        result = c.x + mx * (c.y + my * c.z)
    return result


@qd.func
def add_to_flow(photons: Photons, grid: Grid, photon: qd.template(), far, medium: Medium, wet):
    """Add a straight segment of a photon, `far` [m] long, to the cells that it crosses, in steps of half a cell."""
    p, ahead = photon.p, photon.ahead
    step = grid.step
    cell = 8.0 * step.x * step.y * step.z
    pace = step.x
    amount = 4096.0 * photons.power * pace / cell
    count = qd.min(qd.cast(far / pace + 0.5, qd.i32), 2000)
    left, gone = photon.power, 0
    for part in range(count):
        if gone == 0:
            number = cell_of(grid, p + (part + 0.5) * pace * ahead)
            if number >= 0:
                for k in qd.static(range(3)):
                    bright = amount * (left.x + left.y + left.z) / 3.0
                    qd.atomic_add(photons.flow[number, k], qd.cast(qd.floor(bright * ahead[k] + 0.5), qd.i32))
                    qd.atomic_add(photons.flow[number, 3 + k], qd.cast(amount * left[k] + 0.5, qd.i32))
            elif part > 2:
                gone = 1
            if wet == 1:
                left *= qd.exp(-pace * absorption_at(medium, grid, p + (part + 0.5) * pace * ahead))


@qd.func
def floor_light(photons: Photons, at):
    """Light on the floor that came by the water, per colour, over that of the bare sun."""
    texel = photons.corner.y
    x, z = (at.x - photons.corner.x) / texel - 0.5, (at.z - photons.corner.z) / texel - 0.5
    c, r = qd.cast(qd.floor(x), qd.i32), qd.cast(qd.floor(z), qd.i32)
    total = vec3(0.0, 0.0, 0.0)
    if r >= 0 and c >= 0 and r < photons.floor.shape[0] - 1 and c < photons.floor.shape[1] - 1:
        u, v = x - c, z - r
        for k in range(4):
            share = share_of(k, v, u) / 4096.0
            for color in qd.static(range(3)):
                total[color] += share * photons.floor[r + k // 2, c + k % 2, color]
    return total


@qd.func
def flow_at(photons: Photons, grid: Grid, x):
    """(vector of the light that came by the water, its colours), each a vec3, between the cells around a point."""
    mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    q = (x - grid.lower) / (2.0 * grid.step) - 0.5
    q = qd.max(qd.min(q, vec3(mx - 1.001, my - 1.001, mz - 1.001)), 0.0)
    i, j, k = qd.cast(q.x, qd.i32), qd.cast(q.y, qd.i32), qd.cast(q.z, qd.i32)
    vector, colors = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
    for m in range(8):
        u, v, w = q.x - i, q.y - j, q.z - k
        share = qd.select(m % 2 == 1, u, 1.0 - u) * qd.select(m // 2 % 2 == 1, v, 1.0 - v)
        share *= qd.select(m // 4 == 1, w, 1.0 - w) / 4096.0
        at = qd.min(i + m % 2, mx - 1) + mx * (qd.min(j + m // 2 % 2, my - 1) + my * qd.min(k + m // 4, mz - 1))
        for c in qd.static(range(3)):
            vector[c] += share * photons.flow[at, c]
            colors[c] += share * photons.flow[at, 3 + c]
    return vector, colors


@qd.func
def light_within(photons: Photons, field: Field, at):
    """Mean over all directions of the sun's light in a turbid fluid, per colour, over that of the bare sun."""
    # A cell of its depth off the surface: those at it lie half in the air.
    cell, depth = 2.0 * field.grid.step.x, value_at(field.level, field.grid, at)
    x = at
    if depth < cell:
        x -= (cell - depth) * outward_at(field.level, field.grid, at)
    _vector, colors = flow_at(photons, field.grid, x)
    return 0.25 * colors


@qd.func
def solid_light(photons: Photons, grid: Grid, at, n):
    """Light on a surface with the normal `n` that came by the water, per colour, over that of the bare sun."""
    result = vec3(0.0, 0.0, 0.0)
    if photons.has_flow == 1:
        # A cell and a bit before the surface: nearer ones reach into the solid, where no light flows.
        vector, colors = flow_at(photons, grid, at + 2.2 * grid.step.x * n)
        mean = (colors.x + colors.y + colors.z) / 3.0
        if mean > 1e-6:
            result = (qd.max(-n.dot(vector), 0.0) / mean) * colors
    return result
