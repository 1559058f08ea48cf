"""What the water does to light between its surfaces: Beer-Lambert, in one colour or in as many as there are cells.

code               symbol   meaning                                                   unit
cell_absorption    sigma_a  absorption in every cell, per colour                      1/m
cell_glow                   radiance that comes back out of deep water there          1
turbidity          sigma_t  extinction of fluids that are not clear, see `turbidity.py`   1/m
emission                    radiance of fluids that glow                              1
transmittance      T        share of the light that passes a straight way, per colour 1
added                       radiance that is scattered into the way                   1
free_depth         tau      optical depth at which the ray is scattered               1
"""

import dataclasses

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.view.film.grid import Grid
from wavetank.view.film.turbidity import turbidity_at
from wavetank.view.lens import vec3, vec4, vector
from wavetank.view.matter import matter_of
from wavetank.view.shot import Shot

COLUMNS = 13  # of what is known of a particle
OFTEN = 2.0  # light is scattered as often as other pictures have it hidden: it takes some events to get the colour
STRONG = 2.5  # layers as thick as is usual hold so much of a fluid's colour, as in `optics/mixture.py`


@dataclasses.dataclass(frozen=True, eq=False)
class Medium:
    """What water does to light on its way, on the device."""

    absorption: vec3  # 1/m, where all of it is the same
    scattering: qd.f32  # 1/m
    glow: vec3  # radiance of light that comes back out of deep water, likewise
    cell_absorption: qd.types.ndarray()  # vec3 [cells], 1/m; [1] where all of it is the same
    cell_glow: qd.types.ndarray()  # vec3 [cells], likewise
    is_varied: qd.i32  # 1 where it is not
    turbidity: qd.types.ndarray()  # vec4 [cells]: colour times turbidity, turbidity [1/m]; [1] where all is clear
    emission: qd.types.ndarray()  # vec3 [cells], likewise
    is_turbid: qd.i32  # 1 where some is not clear


def medium_of(shot: Shot, grid: Grid) -> Medium:
    """Return what the water of a picture does to light, cell by cell where there are several fluids, or dye."""
    glow = np.asarray(shot.look.glow * shot.tint, float)
    plain, particles = np.concatenate([np.asarray(shot.absorption, float), glow]), _particles(shot)
    cells = np.zeros((0, COLUMNS)) if particles is None else _in_cells(shot, grid, particles, plain)
    is_turbid = bool(np.any(cells[:, 9] > 0.0))
    cells[:, 10:] /= np.maximum(cells[:, 9:10], 1e-9)  # what shines does so as far as it is there
    parts = [(cells[:, :3], vec3), (cells[:, 3:6], vec3)]
    parts += [(part if is_turbid else part[:0], kind) for part, kind in ((cells[:, 6:10], vec4), (cells[:, 10:], vec3))]
    arrays = [qd.ndarray(kind, shape=(max(len(part), 1),)) for part, kind in parts]
    for array, (part, _) in zip(arrays, parts, strict=True):
        upload(array, part.astype(np.float32))
    cell_absorption, cell_glow, turbidity, emission = arrays
    return Medium(
        absorption=shot.absorption,
        scattering=shot.scattering,
        glow=vector(*glow),
        cell_absorption=cell_absorption,
        cell_glow=cell_glow,
        is_varied=int(particles is not None),
        turbidity=turbidity,
        emission=emission,
        is_turbid=int(is_turbid),
    )


def _particles(shot: Shot) -> np.ndarray | None:
    """Return absorption [1/m], glow, colour times turbidity, turbidity [1/m] and emission times turbidity of every
    particle, float64 [count, COLUMNS]; None where all particles are the same.
    """
    frame, usual = shot.frame, shot.usual
    table = matter_of(frame, shot.extent).astype(float)
    dye = download(frame.dye)[: frame.count].astype(np.int64)
    if not len(table) and not dye.any():
        return None
    glow = np.asarray(shot.look.glow, float)
    plain = np.concatenate([np.asarray(shot.absorption, float), glow * np.asarray(shot.tint, float)])
    found = np.zeros((frame.count, COLUMNS))
    found[:, :6] = plain
    kind = download(frame.material)[: frame.count] if len(table) else np.zeros(frame.count, np.int32)
    for number, (*color, turbidity, red, green, blue) in enumerate(table):
        mine, own, emission = kind == number, np.array(color), np.array([red, green, blue])
        if turbidity > 0.0:
            turbidity *= OFTEN
            # What shines of itself is dark in the light of others, as in `optics/mixture.py`.
            dark = own.clip(0.02, 0.98) / (1.0 + 2.0 * emission.max())
            found[mine] = np.concatenate([np.zeros(6), turbidity * dark, [turbidity], turbidity * emission])
        elif own[0] >= 0.0:
            found[mine, :6] = np.concatenate([-np.log(own) * STRONG / usual, glow * own**0.6])
    stained = np.flatnonzero(dye)
    own = dye[stained]
    color = (np.stack([own >> 16 & 255, own >> 8 & 255, own & 255], axis=1) / 255.0) ** 2.2
    color, share = color.clip(0.02, 0.98), ((own >> 24 & 127) / 127.0)[:, None]
    turbidity = found[stained, 9:10]
    clear = np.concatenate([-np.log(color) * STRONG / usual, glow * color**0.6], axis=1)
    target = np.concatenate([np.where(turbidity > 0.0, 0.0, clear), turbidity * color], axis=1)
    found[stained, :9] += share * (target - found[stained, :9])
    return found


def _in_cells(shot: Shot, grid: Grid, found: np.ndarray, plain: np.ndarray) -> np.ndarray:
    """Return the means of the particles in and next to every cell, float64 [cells, COLUMNS]."""
    counts = (grid.nz // 2, grid.ny // 2, grid.nx // 2)
    place = (download(shot.frame.x)[: shot.frame.count] - grid.lower) / (2.0 * np.asarray(grid.step))
    at = np.floor(place).astype(int).clip(0, np.array(counts[::-1]) - 1)
    number = at[:, 0] + counts[2] * (at[:, 1] + counts[1] * at[:, 2])
    total = int(np.prod(counts))
    weights = [None, *found.T]
    sums = np.stack([np.bincount(number, weight, total) for weight in weights], axis=1).reshape(*counts, COLUMNS + 1)
    near = sums.copy()
    for axis in range(3):
        padded = np.pad(near, [(1, 1) if k == axis else (0, 0) for k in range(4)])
        before, after = (np.take(padded, range(k, k + counts[axis]), axis) for k in (0, 2))
        near = near + 0.5 * (before + after)
    # A cell of its own particles and a little of those beside it; without any it is as those beside it.
    mixed = (sums + 0.15 * near).reshape(-1, COLUMNS + 1)
    there = mixed[:, 0] > 0.0
    result = np.zeros((total, COLUMNS))
    result[:, :6] = plain
    result[there] = mixed[there, 1:] / mixed[there, :1]
    return result


@qd.func
def cell_near(grid: Grid, x):
    """Number of the cell at a point, of the nearest one outside of the grid."""
    c = qd.cast(qd.floor((x - grid.lower) / (2.0 * grid.step)), qd.i32)
    mx, my, mz = grid.nx // 2, grid.ny // 2, grid.nz // 2
    i, j, k = qd.max(qd.min(c.x, mx - 1), 0), qd.max(qd.min(c.y, my - 1), 0), qd.max(qd.min(c.z, mz - 1), 0)
    return i + mx * (j + my * k)


@qd.func
def absorption_at(medium: Medium, grid: Grid, x):
    """Absorption [1/m] at a point."""
    result = medium.absorption
    if medium.is_varied == 1:
        result = medium.cell_absorption[cell_near(grid, x)]
    return result


@qd.func
def through_water(medium: Medium, grid: Grid, p, ahead, far, free_depth):
    """(transmittance of a straight way through the water, radiance that it adds), each a vec3, and its end [m]: `far`,
    or before it where the optical depth of turbidity reaches `free_depth`.
    """
    transmittance, end = qd.exp(-far * medium.absorption), far
    added = (1.0 - qd.exp(-far * medium.scattering)) * medium.glow
    if medium.is_varied == 1:
        transmittance, added = vec3(1.0, 1.0, 1.0), vec3(0.0, 0.0, 0.0)
        count = qd.min(qd.cast(far / (2.0 * grid.step.x), qd.i32) + 1, 256)
        pace, clear, rest, part = far / count, 1.0, free_depth, 0
        while part < count:
            x, length = p + (part + 0.5) * pace * ahead, pace
            if medium.is_turbid == 1:
                depth = pace * turbidity_at(medium.turbidity, grid, x)[3]
                if depth > rest:
                    length = pace * rest / depth
                    end, part = part * pace + length, count
                rest -= depth
            cell = cell_near(grid, x)
            per = qd.exp(-length * medium.scattering)
            added += clear * (1.0 - per) * medium.cell_glow[cell]
            clear *= per
            transmittance *= qd.exp(-length * medium.cell_absorption[cell])
            part += 1
    return transmittance, added, end
