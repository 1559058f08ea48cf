"""Lone drops, spray and foam as small balls, sorted on the host into the cells of the grid that they touch."""

import dataclasses

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.view.film.grid import Grid
from wavetank.view.lens import vec4
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import WaterBuffers

CALM, TORN = 0.7, 2.5  # m/s: as in `passes/drops.py`
BALL = 0.5  # d: radius of a drop of one particle, a little less than that of its volume
#: kind of diffuse particle -> balls that it is drawn as, their mean radius [d], their distance from it [d]
FROTH = {1: (6, 0.05, 0.5), 2: (24, 0.055, 0.62), 3: (8, 0.05, 0.5)}
MOST = 3_000_000


@dataclasses.dataclass(frozen=True, eq=False)
class Balls:
    """Balls by the cells of the grid that they touch, on the device."""

    start: qd.types.ndarray()  # i32 [cells + 1]: first entry of each cell in `list`
    list: qd.types.ndarray()  # i32: numbers of balls
    ball: qd.types.ndarray()  # vec4 [balls], m: middle and radius
    kind: qd.types.ndarray()  # i32 [balls]: 0 water, 1 white froth


def balls_of(shot: Shot, water: WaterBuffers, grid: Grid, moved: float) -> tuple[Balls, np.ndarray]:
    """Return the balls `moved` [s] after the frame, and 1 for each cell that one touches, int32 [cells]."""
    balls, kinds = [_drops(shot, water)], []
    kinds.append(np.zeros(len(balls[0]), np.int32))
    froth = _froth(shot, moved)
    balls.append(froth)
    kinds.append(np.ones(len(froth), np.int32))
    ball, kind = np.concatenate(balls).astype(np.float32), np.concatenate(kinds)
    inside = np.all((ball[:, :3] >= grid.lower) & (ball[:, :3] <= grid.upper), axis=1)
    ball, kind = ball[inside], kind[inside]
    cell = 2.0 * np.asarray(grid.step, np.float32)
    counts = np.array([grid.nx // 2, grid.ny // 2, grid.nz // 2])
    cells = int(np.prod(counts))
    first = np.floor((ball[:, :3] - ball[:, 3:] - grid.lower) / cell).astype(np.int64).clip(0, counts - 1)
    last = np.floor((ball[:, :3] + ball[:, 3:] - grid.lower) / cell).astype(np.int64).clip(0, counts - 1)
    keys, owners = [], []
    for offset in np.ndindex(3, 3, 3):
        there = first + offset
        fits = np.all(there <= last, axis=1)
        keys.append(there[fits] @ [1, counts[0], counts[0] * counts[1]])
        owners.append(np.flatnonzero(fits))
    key, owner = np.concatenate(keys), np.concatenate(owners)
    order = np.argsort(key, kind="stable")
    start = np.zeros(cells + 1, np.int32)
    start[1:] = np.cumsum(np.bincount(key, minlength=cells))
    sorted_balls = Balls(
        start=_array(start, qd.i32),
        list=_array(owner[order].astype(np.int32), qd.i32),
        ball=_array(ball, vec4),
        kind=_array(kind, qd.i32),
    )
    return sorted_balls, (np.diff(start) > 0).astype(np.int32)


def _array(values: np.ndarray, kind: object) -> object:
    array = qd.ndarray(kind, shape=(max(len(values), 1),))
    upload(array, values)
    return array


def _drops(shot: Shot, water: WaterBuffers) -> np.ndarray:
    """Return middles and radii [m] of lone particles, float32 [n, 4]; fast ones break up into several."""
    frame, d = shot.frame, shot.extent.spacing
    lone = np.flatnonzero(download(water.ellipsoids.lone)[: frame.count])
    if not len(lone):
        return np.zeros((0, 4), np.float32)
    place = download(water.cells.x)[lone]
    which = download(water.cells.order)[lone]
    speed = np.linalg.norm(download(frame.v)[which], axis=1)
    number = download(frame.id)[which].astype(np.uint64)
    torn = ((speed - CALM) / (TORN - CALM)).clip(0.0, 1.0)
    torn = torn * torn * (3.0 - 2.0 * torn)
    volume, balls = np.ones(len(lone)), []
    for part in range(5):
        share = 0.16 * torn * _random(number, part)
        volume -= share
        away = np.stack([2.0 * _random(number, 8 + 3 * part + axis) - 1.0 for axis in range(3)], axis=1)
        ball = np.column_stack([place + (0.9 * d * torn)[:, None] * away, BALL * d * np.cbrt(share)])
        balls.append(ball[share > 1e-3])
    balls.append(np.column_stack([place, BALL * d * np.cbrt(volume)]))
    return np.concatenate(balls)


def _froth(shot: Shot, moved: float) -> np.ndarray:
    """Return middles and radii [m] of the balls of spray, foam and bubbles, float32 [n, 4]."""
    frame, d = shot.frame, shot.extent.spacing
    if not frame.foam_count:
        return np.zeros((0, 4), np.float32)
    place = frame.foam_positions + np.float32(moved) * frame.foam_velocities
    number, kinds = frame.foam_ids.astype(np.uint64), frame.foam_kinds
    age = (frame.foam_ages / np.maximum(frame.foam_lives, 1e-6)).clip(0.0, 1.0)
    share = MOST / max(1, sum(FROTH[kind][0] * int((kinds == kind).sum()) for kind in FROTH))
    balls = []
    for kind, (parts, radius, spread) in FROTH.items():
        mine = kinds == kind
        for part in range(max(1, int(parts * min(1.0, share)))):
            own = number[mine]
            # A cloud is thinner at its rim, and loses its balls one by one with age.
            alive = _random(own, 4 * part) > age[mine] ** 2
            turn, up = 2.0 * np.pi * _random(own, 4 * part + 1), 2.0 * _random(own, 4 * part + 2) - 1.0
            far = spread * np.cbrt(_random(own, 4 * part + 3)) * np.where(kind == 2, 1.0, 1.0)
            flat = np.sqrt(1.0 - up * up)
            tall = 0.45 if kind == 2 else 1.0
            away = np.stack([flat * np.cos(turn), tall * up, flat * np.sin(turn)], axis=1)
            size = radius * (0.5 + _random(own, 900 + part))
            ball = np.column_stack([place[mine] + (far * d)[:, None] * away, size * d])
            balls.append(ball[alive])
    return np.concatenate(balls).astype(np.float32)


def _random(owner: np.ndarray, purpose: int) -> np.ndarray:
    """Return pseudo-random numbers from 0 to 1 of owner and purpose (the hash of `optics/hash_noise.py`)."""
    x = (owner * np.uint64(1024) + np.uint64(purpose) + np.uint64(0x9E3779B9)) & np.uint64(0xFFFFFFFF)
    for factor, shift in ((0x7FEB352D, 16), (0x846CA68B, 15)):
        x ^= x >> np.uint64(shift)
        x = (x * np.uint64(factor)) & np.uint64(0xFFFFFFFF)
    x ^= x >> np.uint64(16)
    return x.astype(np.float64) / 2.0**32
