"""Particles come, go, take dye and turn to ice: what tools and scripts do to a world between its steps.

Every region is a capsule: all points within `radius` of the segment from `start` to `end`, which is a ball where both
are one point. Nothing here depends on the order of particles on the device, which the next sort makes anew; neither
does it on threads, as every particle or place is judged by itself.

    code     symbol   meaning                                   unit
    start             one end of the segment                    m
    end               its other end                             m
    gap               distance that free places keep            m
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.device.periods import NONE, Periods, nearest_image
from wavetank.device.state import LASTING, Grid, Particles, integers, new_particles, vectors, with_viscosity
from wavetank.foundation.errors import WavetankError
from wavetank.physics.predicted_positions import predict_at
from wavetank.physics.sorting import copy_particle
from wavetank.solids.distance import SolidSet, lift, signed_distance, vec3


@dataclasses.dataclass(frozen=True)
class Capsule:
    """Where something happens to particles."""

    start: vec3  # m
    end: vec3  # m
    radius: qd.f32  # m
    periods: Periods


@dataclasses.dataclass(frozen=True)
class Clearance:
    """How far free places are from what is there."""

    gap: qd.f32  # m, from particles
    wall: qd.f32  # m, from solids
    first: qd.i32 = 0  # solids before this number do not count
    periods: Periods = NONE  # of the world


def capsule_of(start: Any, end: Any, radius: Any, periods: Periods = NONE) -> Capsule:
    """Return the capsule around the segment between two points, [3] or in a plane [2]; raises `WavetankError`."""
    points = []
    for name, point in (("start", start), ("end", end)):
        try:
            place = np.asarray(point, np.float32)
        except (TypeError, ValueError):
            place = np.zeros(0, np.float32)
        if place.shape not in ((2,), (3,)) or not np.isfinite(place).all():
            raise WavetankError(f"{name} = {point!r} is not a point; give two or three finite numbers [m].")
        points.append(np.append(place, np.float32(0.0))[:3])
    if not (isinstance(radius, int | float | np.number) and 0.0 <= radius < np.inf):
        raise WavetankError(f"radius = {radius!r} is not allowed; it must be a finite number from 0 on [m].")
    return Capsule(start=points[0], end=points[1], radius=float(radius), periods=periods)


@qd.func
def is_inside(capsule: Capsule, point):
    """Say whether `point`, or its image that is nearest to the capsule's middle, is in the capsule."""
    way = capsule.end - capsule.start
    from_start = point - capsule.start
    if qd.static(capsule.periods.axes):
        from_start = nearest_image(from_start - 0.5 * way, capsule.periods) + 0.5 * way
    share = qd.min(qd.max(from_start.dot(way) / qd.max(way.norm_sqr(), 1e-20), 0.0), 1.0)
    return (from_start - share * way).norm_sqr() < capsule.radius * capsule.radius


@qd.kernel(fastcache=True)
def mark_particles(marks: qd.types.ndarray(), particles: Particles, capsule: Capsule, count: qd.i32):
    """Mark the particles inside with 1, the others with 0."""
    for i in range(count):
        marks[i] = qd.cast(is_inside(capsule, lift(particles.x[i])), qd.i32)


@qd.kernel(fastcache=True)
def mark_outside_box(
    marks: qd.types.ndarray(), particles: Particles, lower: vec3, upper: vec3, count: qd.i32
) -> qd.i32:
    """Mark the particles outside of a box with 1, the others with 0; return how many are outside."""
    total = 0
    for i in range(count):
        p = lift(particles.x[i])
        marks[i] = qd.cast(qd.max(lower - p, p - upper).max() > 0.0, qd.i32)
        qd.atomic_add(total, marks[i])
    return total


@qd.kernel(fastcache=True)
def dye_particles(particles: Particles, capsule: Capsule, dye: qd.i32, count: qd.i32):
    """Dye the particles inside."""
    for i in range(count):
        if is_inside(capsule, lift(particles.x[i])):
            particles.dye[i] = dye


@qd.kernel(fastcache=True)
def freeze_particles(particles: Particles, capsule: Capsule, frozen: qd.i32, count: qd.i32) -> qd.i32:
    """Turn the particles inside to ice (1) or water (0); return how many are ice in all."""
    total = 0
    for i in range(count):
        if is_inside(capsule, lift(particles.x[i])):
            particles.frozen[i] = frozen
            particles.v[i] *= 1.0 - frozen
        qd.atomic_add(total, particles.frozen[i])
    return total


@qd.kernel(fastcache=True)
def hold_ice(particles: Particles, count: qd.i32):
    """Put ice back where it was at the start of the substep."""
    for i in range(count):
        if particles.frozen[i] == 1:
            predict_at(particles, i, particles.x[i])


@qd.func
def forget_viscosity(particles: Particles, i):
    """Forget what viscosity did to particle `i`, where that is known."""
    if particles.viscous.shape[0] > 1:
        particles.viscous[i] *= 0.0


@qd.func
def forget_forces(particles: Particles, i):
    """Forget what accelerated particle `i` in the last step."""
    particles.a[i] *= 0.0
    forget_viscosity(particles, i)


@qd.kernel(fastcache=True)
def stop_ice(particles: Particles, count: qd.i32):
    """Take the velocity from ice."""
    for i in range(count):
        if particles.frozen[i] == 1:
            particles.v[i] *= 0.0
            forget_forces(particles, i)


@qd.kernel(fastcache=True)
def append_rows(
    particles: Particles,
    x: qd.types.ndarray(),
    v: qd.types.ndarray(),
    dye: qd.types.ndarray(),
    material: qd.types.ndarray(),
    first: qd.i32,
    first_id: qd.i32,
    count: qd.i32,
):
    """Write `count` new particles from place `first` on, with ids from `first_id` on."""
    for i in range(count):
        particles.x[first + i] = x[i]
        particles.v[first + i] = v[i]
        particles.a[first + i] = 0.0 * v[i]
        if particles.viscous.shape[0] > 1:
            particles.viscous[first + i] = 0.0 * v[i]
        particles.id[first + i] = first_id + i
        particles.near[first + i] = 0
        particles.dye[first + i] = dye[i]
        particles.material[first + i] = material[i]
        particles.frozen[first + i] = 0


@qd.kernel(fastcache=True)
def copy_chosen(target: Particles, particles: Particles, grid: Grid, count: qd.i32):
    """Copy the first `count` particles that `grid.order` names to the front of `target`.

    What viscosity did is forgotten: it no longer sums up to nothing where a neighbour has gone.
    """
    for n in range(count):
        copy_particle(target, n, particles, grid.order[n])
        forget_viscosity(target, n)


@qd.kernel(fastcache=True)
def clear_forces(particles: Particles, count: qd.i32):
    """Forget what accelerated the particles in the last step."""
    for i in range(count):
        forget_forces(particles, i)


@qd.kernel(fastcache=True)
def mark_occupied(
    occupied: qd.types.ndarray(),
    places: qd.types.ndarray(),
    particles: Particles,
    solids: SolidSet,
    free: Clearance,
    middle: vec3,
    reach: qd.f32,
    count: qd.i32,
    number: qd.i32,
):
    """Mark places that are not `free`; all of them are within `reach` of `middle`."""
    for k in range(number):
        occupied[k] = 0
        for solid in range(free.first, solids.count):
            if signed_distance(solids, solid, lift(places[k])).w < free.wall:
                occupied[k] = 1
    for i in range(count):
        if nearest_image(lift(particles.x[i]) - middle, free.periods).norm() < reach + free.gap:
            for k in range(number):
                if nearest_image(particles.x[i] - places[k], free.periods).norm() < free.gap:
                    occupied[k] = 1


def inside_capsule(particles: Particles, count: int, capsule: Capsule) -> np.ndarray:
    """Say for every particle, in device order, whether it is inside, bool [count]."""
    if not count:
        return np.zeros(0, bool)
    marks = integers(count)
    mark_particles(marks, particles, capsule, count)
    result: np.ndarray = download(marks)[:count] == 1
    return result


def inside_box(particles: Particles, marks: Any, lower: np.ndarray, upper: np.ndarray, count: int) -> np.ndarray | None:
    """Say for every particle, in device order, whether it is between the corners [3], bool [count]; None for all.

    `marks` is room for a number of each.
    """
    if not count or not mark_outside_box(marks, particles, lower, upper, count):
        return None
    result: np.ndarray = download(marks)[:count] == 0
    return result


def free_places(
    places: np.ndarray, particles: Particles, solids: SolidSet, count: int, clearance: Clearance
) -> np.ndarray:
    """Say which of the places [n, dim] have that `clearance`, bool [n]."""
    if not len(places):
        return np.zeros(0, bool)
    device, occupied = vectors(places.shape[1], len(places)), integers(len(places))
    upload(device, places)
    middle = np.zeros(3, np.float32)
    middle[: places.shape[1]] = places.mean(axis=0)
    reach = float(np.linalg.norm(places - places.mean(axis=0), axis=1).max())
    mark_occupied(occupied, device, particles, solids, clearance, middle, reach, count, len(places))
    result: np.ndarray = download(occupied)[: len(places)] == 0
    return result


@qd.kernel(fastcache=True)
def count_near(particles: Particles, solids: SolidSet, number: qd.i32, reach: qd.f32, count: qd.i32) -> qd.i32:
    """Count the particles within `reach` [m] of the solid `number`, where both are now."""
    total = 0
    for i in range(count):
        if signed_distance(solids, number, lift(particles.x[i])).w < reach:
            total += 1
    return total


def forget_solid(particles: Particles, count: int, solids: SolidSet, number: int, reach: float) -> None:
    """Forget what pressed and dragged the fluid if any is within `reach` [m] of the solid `number`, which is to go.

    Thick fluids carry pressure on, and start where viscosity left off: they would go on lying on what is gone.
    """
    if count and count_near(particles, solids, number, reach, count):
        clear_forces(particles, count)


def append(
    particles: Particles, count: int, x: np.ndarray, v: np.ndarray, dye: np.ndarray, material: np.ndarray, first_id: int
) -> None:
    """Write new particles behind the first `count`; there must be room."""
    rows = len(x)
    arrays = [vectors(x.shape[1], rows), vectors(x.shape[1], rows), integers(rows), integers(rows)]
    for array, values in zip(arrays, (x, v, dye, material), strict=True):
        upload(array, values)
    append_rows(particles, *arrays, count, first_id, rows)


def keep_only(particles: Particles, spare: Particles, grid: Grid, keep: np.ndarray) -> int:
    """Copy the particles where `keep`, bool [count] in device order, to the front of `spare`.

    Return how many of them are ice.
    """
    chosen = np.flatnonzero(keep)
    upload(grid.order, chosen)
    copy_chosen(spare, particles, grid, len(chosen))
    return int(np.count_nonzero(download(spare.frozen)[: len(chosen)]))


def at_capacity(particles: Particles, dim: int, capacity: int) -> Particles:
    """Return a copy with room for `capacity` particles; where they are predicted to go is left open."""
    larger, names = new_particles(dim, capacity), LASTING
    if particles.viscous.shape == particles.x.shape:
        larger, names = with_viscosity(larger), (*LASTING, "viscous")
    for name in names:
        upload(getattr(larger, name), download(getattr(particles, name))[: capacity + 1])
    return larger
