"""Signed distances on the device: one function per shape, and the program that combines them.

A solid is a small program in postfix order over `DISTANCES` and the operations union, intersection and difference;
it runs with a stack of `deepest` values. Every value is (gradient, distance): distance [m] is negative inside, the
gradient is the unit outward normal. Shapes are exact; set operations are exact outside of a union and inside of an
intersection and a lower bound elsewhere, as usual for constructive distance fields.

Two-dimensional worlds are the plane z = 0 of the same solids: a box without a third size is an infinite prism.

Distance functions after Inigo Quilez, "3D SDF functions" (2013); the gradients are worked out here.

A mesh is a grid of distances (`meshes/grid.py`) between whose nodes they are trilinear; its gradient is theirs, of unit
length. Beyond the grid no distance is overestimated: the nearest point of the grid lies between.

    code      symbol   meaning                                  unit
    p                  point in the frame of the shape          m
    size      a        sizes of the shape, see each function    m
    q                  signed excess over the half sizes        m
"""

import dataclasses
from typing import Final

from wavetank.device.compiler import qd

vec2 = qd.types.vector(2, qd.f32)
vec3 = qd.types.vector(3, qd.f32)
vec4 = qd.types.vector(4, qd.f32)


# The numbers of `solid.Code` and the other constants there: functions, because the compiler's cache does not see
# constants of modules.


@qd.func
def deepest():
    """Deepest nesting of set operations."""
    return 8


@qd.func
def union():
    """Operation of all that is in one of two shapes."""
    return -1


@qd.func
def intersection():
    """Operation of what is in both."""
    return -2


@qd.func
def difference():
    """Operation of what is in the first and not in the second."""
    return -3


@qd.func
def grids():
    """The code of the first grid, numbered as in `SolidSet.grid`; others follow."""
    return 1 << 16


@qd.func
def parts():
    """Numbers that each solid has in `SolidSet.reaction`."""
    return 15


@qd.func
def around():
    """Reach [m] of a container, which is all of space but its hollow: pictures look through it at what it holds."""
    return 4.0e5


@qd.func
def half_space_distance(p, size):
    """Everything below y = 0."""
    return vec4(0.0, 1.0, 0.0, p.y)


@qd.func
def sphere_distance(p, size):
    """Ball of radius size.x around the origin."""
    r = p.norm()
    n = vec3(0.0, 1.0, 0.0)
    if r > 1e-9:
        n = p / r
    return vec4(n.x, n.y, n.z, r - size.x)


@qd.func
def box_distance(p, size):
    """Box of half sizes size.xyz around the origin."""
    q = qd.abs(p) - vec3(size.x, size.y, size.z)
    side = vec3(1.0, 1.0, 1.0)
    for k in qd.static(range(3)):
        if p[k] < 0.0:
            side[k] = -1.0
    n = vec3(0.0, 0.0, 0.0)
    d = qd.max(q.x, q.y, q.z)
    if d > 0.0:
        outside = qd.max(q, 0.0)
        d = outside.norm()
        n = side * outside / d
    elif q.x >= q.y and q.x >= q.z:
        n.x = side.x
    elif q.y >= q.z:
        n.y = side.y
    else:
        n.z = side.z
    return vec4(n.x, n.y, n.z, d)


@qd.func
def capsule_distance(p, size):
    """Ball of radius size.x swept along y from -size.y to size.y."""
    return sphere_distance(vec3(p.x, p.y - qd.min(qd.max(p.y, -size.y), size.y), p.z), size)


@qd.func
def cylinder_distance(p, size):
    """Cylinder of radius size.x along y from -size.y to size.y."""
    r = qd.sqrt(p.x * p.x + p.z * p.z)
    radial = vec3(1.0, 0.0, 0.0)
    if r > 1e-9:
        radial = vec3(p.x / r, 0.0, p.z / r)
    axial = vec3(0.0, 1.0, 0.0)
    if p.y < 0.0:
        axial = vec3(0.0, -1.0, 0.0)
    q_r = r - size.x
    q_y = qd.abs(p.y) - size.y
    d = qd.max(q_r, q_y)
    n = radial
    if q_y > q_r:
        n = axial
    if q_r > 0.0 and q_y > 0.0:
        d = qd.sqrt(q_r * q_r + q_y * q_y)
        n = (radial * q_r + axial * q_y) / d
    return vec4(n.x, n.y, n.z, d)


#: The places of the shapes in `shape_distance`.
DISTANCES = (half_space_distance, box_distance, sphere_distance, capsule_distance, cylinder_distance)


@qd.func
def shape_distance(shape, p, size):
    """(gradient, distance) of the shape with that number in DISTANCES.

    Written out, because the compiler's cache sees this text and not the contents of the tuple.
    """
    value = vec4(0.0, 0.0, 0.0, 0.0)
    if shape == 0:
        value = half_space_distance(p, size)
    elif shape == 1:
        value = box_distance(p, size)
    elif shape == 2:
        value = sphere_distance(p, size)
    elif shape == 3:
        value = capsule_distance(p, size)
    elif shape == 4:
        value = cylinder_distance(p, size)
    return value


@qd.func
def rotate(q, v):
    """Turn vector `v` by the unit quaternion `q` = (w, x, y, z)."""
    u = vec3(q[1], q[2], q[3])
    return v + 2.0 * u.cross(u.cross(v) + q[0] * v)


@qd.func
def conjugate(q):
    """Inverse of a unit quaternion."""
    return vec4(q[0], -q[1], -q[2], -q[3])


@qd.func
def lift(x: qd.template()):
    """A point of a 2-D or 3-D world as a point in space."""
    point = vec3(0.0, 0.0, 0.0)
    for k in qd.static(range(x.n)):
        point[k] = x[k]
    return point


@dataclasses.dataclass(frozen=True, eq=False)
class SolidSet:
    """All solids of a world on the device; frames are nested: node in solid in world."""

    op: qd.types.ndarray()  # i32 [nodes]: `solid.Code` of a shape or a set operation, or of a grid
    size: qd.types.ndarray()  # vec4 [nodes], m
    offset: qd.types.ndarray()  # vec3 [nodes], m: origin of the node in its solid
    turn: qd.types.ndarray()  # vec4 [nodes]: quaternion, node to solid
    first: qd.types.ndarray()  # i32 [solids + 1]: where each solid's program starts
    reach: qd.types.ndarray()  # f32 [solids], m: radius around the solid's origin that holds all of it
    friction: qd.types.ndarray()  # f32 [solids]: Coulomb coefficient
    position: qd.types.ndarray()  # vec3 [solids], m, at the end of the substep
    rotation: qd.types.ndarray()  # vec4 [solids], at the end of the substep
    old_position: qd.types.ndarray()  # vec3 [solids], m, at its start
    old_rotation: qd.types.ndarray()  # vec4 [solids], at its start
    plane: qd.types.ndarray()  # vec4 [solids]: walls of the tank as planes (n, b) at the end, distance n x + b [1, m]
    sweep: qd.types.ndarray()  # vec2 [solids]: way in the substep of the origin [m], and by turning at 1 m from it
    center: qd.types.ndarray()  # vec3 [solids], m: centre of mass at the end of the substep
    unit: qd.types.ndarray()  # f32 [solids], 1/m: steps of the sums in `reaction`; 0 where no reaction is summed
    grip: qd.types.ndarray()  # f32 [solids]: largest share of sliding that friction removes, less for light bodies
    reaction: qd.types.ndarray()  # i32 [15 solids]: fixed-point reactions of the water, see `physics/bodies.py`
    grid: qd.types.ndarray()  # i32 vec4 [grids]: number of its first sample, numbers of nodes along x, y, z
    samples: qd.types.ndarray()  # f32: for each grid its cell edge, then the distances at its nodes, x fastest; m
    period: qd.types.ndarray()  # vec3 [solids], m: of the world, for solids that are seen at their nearest image
    count: qd.i32
    tank_count: qd.i32  # the first `tank_count` are the walls of the tank, all of them half-spaces
    repeats: Final[int]  # bit k is set where the world repeats along axis k
    has_grids: Final[bool]  # whether any solid has a grid of distances: a mesh, a polygon or a height field
    has_operations: Final[bool]  # whether any solid is more than one shape


@qd.func
def grid_distance(solids: SolidSet, number, p, scale):
    """(gradient, distance) of a grid of distances around the origin, enlarged by `scale`."""
    first, nx, ny, nz = solids.grid[number][0], solids.grid[number][1], solids.grid[number][2], solids.grid[number][3]
    cell = solids.samples[first]
    last = vec3(nx - 1, ny - 1, nz - 1)
    q = p / (cell * scale) + 0.5 * last
    inside = qd.max(qd.min(q, last), 0.0)
    low = qd.min(qd.floor(inside), last - 1.0)
    f = inside - low
    at = first + 1 + qd.cast(low.x, qd.i32) + nx * (qd.cast(low.y, qd.i32) + ny * qd.cast(low.z, qd.i32))
    up, back = nx, nx * ny
    a, b = solids.samples[at], solids.samples[at + 1]
    c, d = solids.samples[at + up], solids.samples[at + up + 1]
    e, g = solids.samples[at + back], solids.samples[at + back + 1]
    h, k = solids.samples[at + back + up], solids.samples[at + back + up + 1]
    ac, bd = a + (c - a) * f.y, b + (d - b) * f.y
    eh, gk = e + (h - e) * f.y, g + (k - g) * f.y
    near, far = ac + (bd - ac) * f.x, eh + (gk - eh) * f.x
    value = (near + (far - near) * f.z) / cell
    slope = (
        vec3(
            (bd - ac) + ((gk - eh) - (bd - ac)) * f.z,
            ((c - a) + ((d - b) - (c - a)) * f.x) * (1.0 - f.z) + ((h - e) + ((k - g) - (h - e)) * f.x) * f.z,
            far - near,
        )
        / cell
    )
    beyond = q - inside
    if beyond.dot(beyond) > 0.0:
        for axis in qd.static(range(3)):
            if beyond[axis] != 0.0:
                slope[axis] = 0.0
        slope = beyond + value * slope
        value = qd.sqrt(beyond.dot(beyond) + value * value)
    n = vec3(0.0, 1.0, 0.0)
    if slope.norm() > 1e-6:
        n = slope.normalized()
    return vec4(n.x, n.y, n.z, value * cell * scale)


@qd.func
def node_distance(solids: SolidSet, node, p):
    """(gradient, distance) of one shape of a program, at the point `p` in the solid's frame."""
    turn = solids.turn[node]
    at = rotate(conjugate(turn), p - solids.offset[node])
    op = solids.op[node]
    value = vec4(0.0, 0.0, 0.0, 0.0)
    if qd.static(solids.has_grids):
        if op >= grids():
            value = grid_distance(solids, op - grids(), at, solids.size[node].x)
        else:
            value = shape_distance(op, at, solids.size[node])
    else:
        value = shape_distance(op, at, solids.size[node])
    n = rotate(turn, vec3(value.x, value.y, value.z))
    return vec4(n.x, n.y, n.z, value.w)


@qd.func
def program_distance(solids: SolidSet, k, p):
    """(gradient, distance) of the program of solid `k` at the point `p` in its own frame."""
    stack = qd.Matrix([[0.0] * 4 for _ in range(deepest())])
    depth = 0
    # The top of the stack stays in registers: most solids are a single shape and never touch the rest.
    top = vec4(0.0, 0.0, 0.0, 0.0)
    for node in range(solids.first[k], solids.first[k + 1]):
        op = solids.op[node]
        if op >= 0:
            if node > solids.first[k]:
                for c in qd.static(range(4)):
                    stack[depth, c] = top[c]
                depth += 1
            top = node_distance(solids, node, p)
        else:
            depth -= 1
            below = vec4(stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3])
            if op == difference():
                top = -top
            if (op == union() and below.w < top.w) or (op != union() and below.w > top.w):
                top = below
    return top


@qd.func
def local_distance(solids: SolidSet, k, p):
    """(gradient, distance) of solid `k` at the point `p` in its own frame."""
    value = vec4(0.0, 0.0, 0.0, 0.0)
    if qd.static(solids.has_operations):
        value = program_distance(solids, k, p)
    else:
        value = node_distance(solids, solids.first[k], p)
    return value


@qd.func
def grain(solids: SolidSet, k):
    """Largest cell edge [m] of the grids that solid `k` is made of; 0 where its distances are exact."""
    largest = 0.0
    if qd.static(solids.has_grids):
        for node in range(solids.first[k], solids.first[k + 1]):
            if solids.op[node] >= grids():
                cell = solids.samples[solids.grid[solids.op[node] - grids()][0]]
                largest = qd.max(largest, cell * solids.size[node].x)
    return largest


@qd.func
def to_local(position, rotation, x):
    """World point `x` in the frame of a solid at that pose."""
    return rotate(conjugate(rotation), x - position)


@qd.func
def image_near(solids: SolidSet, k, x):
    """The image of the world point `x` (vec3) that is nearest to solid `k`: it is where the solid sees it.

    A solid that keeps moving along an axis may be many lengths of the world away.
    """
    image = x
    if qd.static(solids.repeats):
        for axis in qd.static(range(3)):
            if qd.static(solids.repeats >> axis & 1):
                period = solids.period[k][axis]
                image[axis] -= period * qd.round((x[axis] - solids.position[k][axis]) / period)
    return image


@qd.func
def plane_distance(solids: SolidSet, k, x):
    """(gradient, distance) of wall `k` of the tank at the world point `x`, with the pose of the substep's end."""
    plane = solids.plane[k]
    return vec4(plane.x, plane.y, plane.z, plane.x * x.x + plane.y * x.y + plane.z * x.z + plane.w)


@qd.func
def signed_distance(solids: SolidSet, k, x):
    """(gradient, distance) of solid `k` at the world point `x` (vec3), with the pose of the substep's end."""
    value = vec4(0.0, 0.0, 0.0, 0.0)
    if k < solids.tank_count:
        value = plane_distance(solids, k, x)
    else:
        q = solids.rotation[k]
        own = local_distance(solids, k, to_local(solids.position[k], q, image_near(solids, k, x)))
        n = rotate(q, vec3(own.x, own.y, own.z))
        value = vec4(n.x, n.y, n.z, own.w)
    return value
