"""Neighbour search against a k-d tree, from ten thousand to ten million particles.

The report that wavetank starts from names its grid as the limit of size and asks for k-d trees. Here both find all
pairs within h of the same shaken lattice, in a block and in a sheet that is spread thin over a hundred times as much
room: the first is what a tank looks like, the second what a splash over an open plane does to a grid.
"""

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rich.table import Table

from wavetank.device import compiler
from wavetank.device.compiler import upload
from wavetank.device.state import new_particles
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.counts import device_bytes
from wavetank.lab.bench.machine import cores, load, machine
from wavetank.physics.coefficients import coefficients
from wavetank.physics.integrate import reset_predictions
from wavetank.physics.neighbors import find_neighbors, new_grid
from wavetank.physics.pairs import count_neighbors
from wavetank.physics.sorting import sort_particles
from wavetank.scene.scene import Scene

SIZES = (10_000, 100_000, 1_000_000)
SPACING = 0.01  # m
ROOM = 48  # places of a list at the start; it grows where that is too few


def places(count: int, layout: str) -> np.ndarray:
    """Return a shaken lattice of about `count` points [m], float32 [n, 3]: a "block", or a "sheet" with gaps.

    The sheet is three layers thick, in patches of four by four columns that stand ten times their width apart.
    """
    if layout == "block":
        edge = round(count ** (1.0 / 3.0))
        steps = [np.arange(edge), np.arange(edge), np.arange(edge)]
    else:
        side = np.arange(round((count / 3) ** 0.5))
        steps = [side + 36 * (side // 4), np.arange(3), side + 36 * (side // 4)]
    x = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
    x += np.random.default_rng(0).uniform(-0.2, 0.2, x.shape).astype(np.float32)
    return x * np.float32(SPACING)


def search(
    sizes: Sequence[int] = SIZES,
    *,
    arch: str = "cpu",
    repeats: int = 3,
    threads: int | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Measure both for each size and layout and return the figures; needs SciPy.

    Raises `WavetankError` without SciPy, or for a size below 1,000 or above 30 million.
    """
    try:
        from scipy.spatial import cKDTree
    except ImportError:
        raise WavetankError(
            "--search compares with SciPy's k-d tree, which is not installed; pip install scipy."
        ) from None
    for count in sizes:
        if not 1000 <= count <= 30_000_000:
            raise WavetankError(f"--sizes = {count} is not allowed with --search; it must be from 1,000 to 30,000,000.")
    compiler.start(arch, threads=threads)
    scene = Scene(spacing=SPACING)
    c, workers = coefficients(scene, scene.frame_time), threads or cores()
    rows = []
    for layout in ("block", "sheet"):
        for count in sizes:
            x = places(count, layout)
            say(f"{len(x):,} particles in a {layout}")
            grid_seconds, pairs, held = _grid(x, c, repeats)
            build, query = [], []
            for _ in range(repeats):
                began = time.perf_counter()
                tree = cKDTree(x, balanced_tree=False, compact_nodes=False)
                build.append(time.perf_counter() - began)
                began = time.perf_counter()
                counted = int(tree.query_ball_point(x, c.h, return_length=True, workers=workers).sum()) - len(x)
                query.append(time.perf_counter() - began)
            rows.append(
                {
                    "layout": layout,
                    "particles": len(x),
                    "pairs": pairs,
                    "tree_pairs": counted,
                    "grid_seconds": statistics.median(grid_seconds),
                    "tree_seconds": statistics.median(build) + statistics.median(query),
                    "tree_build_seconds": statistics.median(build),
                    "grid_bytes_per_particle": held / len(x),
                }
            )
    return {"machine": machine(arch, threads), "load": load(), "search": rows}


def _grid(x: np.ndarray, c: Any, repeats: int) -> tuple[list[float], int, int]:
    """Return seconds of each repeat, the number of pairs and the bytes of grid and lists."""
    count = len(x)
    particles, spare = new_particles(3, count), new_particles(3, count)
    upload(particles.x, x)
    upload(particles.id, np.arange(count))
    grid = new_grid(3, count, None, float(c.h), ROOM)
    seconds = []
    for repeat in range(repeats + 1):  # the first one compiles
        compiler.synchronize()
        began = time.perf_counter()
        reset_predictions(particles, grid, c, count)
        sort_particles(particles, spare, grid, count)
        grid = find_neighbors(spare, grid, c, count)
        compiler.synchronize()
        if repeat:
            seconds.append(time.perf_counter() - began)
    return seconds, int(count_neighbors(spare, grid, c, count).sum(dtype=np.int64)), device_bytes(grid)


def search_table(result: dict[str, Any]) -> Table:
    """Return one row for each size and layout."""
    table = Table("particles", "layout", "grid and lists, ns a particle", "k-d tree, ns a particle", "tree / grid")
    for row in result["search"]:
        count = row["particles"]
        table.add_row(
            f"{count:,}",
            row["layout"],
            f"{1e9 * row['grid_seconds'] / count:.0f}",
            f"{1e9 * row['tree_seconds'] / count:.0f}",
            f"{row['tree_seconds'] / row['grid_seconds']:.1f}",
        )
    table.caption = "The tree counts pairs only, on all cores; the grid also lists them."
    return table
