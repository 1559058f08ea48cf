"""Lattices of blocks that fit between walls, so that still water is at rest from its first frame on.

Rows that are a whole spacing apart leave up to one free next to the last, and the block falls into it: a tank of
a metre at d = 2.4 cm began at 0.45 m/s. Rows therefore fill the distance between two walls, or to a gate or another
block, or around a periodic world. Along the other axes their distance is changed such that particles keep their volume.
"""

import itertools

import numpy as np

UNLIKE = 0.1  # of a spacing: by how much rows may lie closer or farther apart than that
BEYOND = 0.25  # of a row: how far the last one may reach out of its block
NEAR = 1e-6  # spacings: boxes that are nearer touch


def lattice(lower: np.ndarray, counts: np.ndarray, ways: np.ndarray, more: int = 0) -> np.ndarray:
    """Return positions [m], float64 [n, dim]: `counts` rows along each axis, `ways` [m] apart, from half of one on.

    `more` rows are added on each side.
    """
    axes = [low + (np.arange(-more, n + more) + 0.5) * way for low, n, way in zip(lower, counts, ways, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(axes))


def plain_rows(lower: np.ndarray, upper: np.ndarray, spacing: float) -> np.ndarray:
    """Return how many rows a `spacing` [m] apart lie between two corners [m], int [dim]."""
    return np.floor((upper - lower) / spacing + NEAR).astype(int)


def plain_lattice(lower: np.ndarray, upper: np.ndarray, spacing: float, more: int = 0) -> np.ndarray:
    """Return the positions [m], float64 [n, dim], of those rows, and of `more` around."""
    return lattice(lower, plain_rows(lower, upper, spacing), np.full(len(lower), spacing), more)


def touching(lower: np.ndarray, upper: np.ndarray, low: np.ndarray, high: np.ndarray, spacing: float) -> np.ndarray:
    """Say where other boxes [n, dim] lie next to the first, at its lower and its upper side of each axis, [2, dim]."""
    overlaps = np.minimum(upper, high) - np.maximum(lower, low) > NEAR * spacing
    beside = np.stack([np.delete(overlaps, axis, axis=1).all(axis=1) for axis in range(len(lower))], axis=1)
    return np.any(beside & (np.abs([lower - high, upper - low]) < NEAR * spacing), axis=1)


def covered(x: np.ndarray, places: np.ndarray, spacing: float) -> np.ndarray:
    """Say which of the points `x` [n, dim] [m] lie in a cube of edge `spacing` around one of `places` [m, dim]."""
    result = np.zeros(len(x), bool)
    if not len(x) or not len(places):
        return result
    cells, own = (np.floor(points / spacing).astype(np.int64) for points in (places, x))
    low = np.minimum(cells.min(axis=0), own.min(axis=0)) - 1
    span = np.maximum(cells.max(axis=0), own.max(axis=0)) - low + 2
    strides = np.cumprod([1, *span[:-1]])
    keys = (cells - low) @ strides
    order = np.argsort(keys, kind="stable")
    for shift in itertools.product((-1, 0, 1), repeat=x.shape[1]):
        wanted = (own + shift - low) @ strides
        begin, end = (np.searchsorted(keys[order], wanted, side) for side in ("left", "right"))
        while (some := begin < end).any():  # one place of each cell after the other
            way = np.abs(places[order[begin[some]]] - x[some]).max(axis=1)
            result[some] |= way < 0.5 * spacing * (1.0 - 1e-6)
            begin = begin + 1
    return result


def fitted(lower: np.ndarray, upper: np.ndarray, spacing: float, held: np.ndarray, rings: list[int]) -> np.ndarray:
    """Return the positions [m], float64 [n, dim], of a block that is `held` on both sides along some axes, bool [dim].

    The world repeats along the axes that are `rings`. Where all axes are held, one that is not a ring is left free,
    y if possible; where all are rings, particles have a little more than their volume.
    """
    size, dim = upper - lower, len(lower)
    counts, ways = plain_rows(lower, upper, spacing), np.full(dim, spacing)
    rows = np.maximum(counts if len(rings) == dim else np.rint(size / spacing), 1)
    yielding = [axis for axis in (1, 0, 2)[:dim] if axis not in rings] if held.all() else []
    is_fitted = held & (np.abs(size / rows - spacing) < UNLIKE * spacing)
    is_fitted[yielding[:1]] = False
    if (np.abs(size / rows - spacing) > NEAR * spacing)[is_fitted].any():
        counts[is_fitted], ways[is_fitted] = rows[is_fitted], (size / rows)[is_fitted]
        others = ~is_fitted
        ways[others] *= (spacing ** is_fitted.sum() / ways[is_fitted].prod()) ** (1.0 / max(others.sum(), 1))
        counts[others] = np.floor(size[others] / ways[others] + BEYOND)
    return lattice(lower, counts, ways)
