"""How near each kernel comes to what the machine can do: a roofline (Williams, Waterman and Patterson 2009,
10.1145/1498765.1498785).

Three ceilings are measured with small kernels of the same compiler on the same threads, fastest of several tries:

- copy: bytes per second of a copy, read and written counted, of arrays as large as the run's own, and of large ones;
- arithmetic: multiplications and additions per second of independent chains that stay in registers, on a processor in
  vectors, as many as hide how long each takes;
- walk: neighbours per second of a loop over the run's own lists that does nothing but add up the ways to them, which
  every pass over lists has to pay.

`COSTS` says what a kernel has to move and to compute: every array element once, neighbours' positions not at all
(they come from the cache), divisions and roots as one operation. The shortest possible time is the larger of bytes /
copy and operations / arithmetic; the share reached is that over the measured time.
"""

import dataclasses
import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

from rich.table import Table

from wavetank.device import compiler
from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, Grid, Particles, scalars
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.counts import water_bytes
from wavetank.lab.bench.machine import load, machine
from wavetank.lab.bench.scenes import check, measured, sized, timed
from wavetank.physics.clusters import chunks, end_cluster, end_of, first_cluster
from wavetank.physics.coefficients import coefficients
from wavetank.physics.pairs import add_neighbors, count_neighbors
from wavetank.scene.scene import Scene
from wavetank.simulation.simulation import Simulation

LARGE = 1 << 26  # numbers in each of two arrays that no cache holds
SPINS, TURNS, CHAINS = 1 << 15, 256, 8  # the kernel `spin` spells the last out
WIDE = 32  # lanes of a chain on a processor, so that the compiler takes the longest vectors it has
TRIES = 9


@dataclasses.dataclass(frozen=True)
class Cost:
    """What one launch takes in a 3-D world: for each particle, each listed pair, each distance test."""

    vectors: int = 0  # read or written for each particle
    words: int = 0
    pair_words: float = 0.0  # an entry of a list serves eight particles, and is a neighbour of three
    operations: int = 0  # for each particle
    pair_operations: int = 0
    test_operations: int = 0


#: By the name of the kernel. Vectors are three words of four bytes.
COSTS: dict[str, Cost] = {
    "predict": Cost(vectors=4, words=2, operations=266),  # x, v twice, p
    "reorder": Cost(vectors=6, words=13),
    "list_neighbors": Cost(vectors=1, words=4, pair_words=0.4, test_operations=9),
    "start_multipliers": Cost(vectors=1, words=6, pair_words=0.4, operations=25, pair_operations=26),
    "solve_multipliers": Cost(vectors=1, words=6, pair_words=0.4, operations=12, pair_operations=14),
    "correct_positions": Cost(vectors=2, words=3, pair_words=0.4, operations=12, pair_operations=24),
    "update_velocities": Cost(vectors=5, operations=24),
    "apply_xsph": Cost(vectors=3, words=1, pair_words=0.4, operations=7, pair_operations=22),
    "confine_vorticity": Cost(vectors=4, words=1, pair_words=0.4, operations=25, pair_operations=36),
}


@qd.kernel(fastcache=True)
def copy(target: qd.types.ndarray(), source: qd.types.ndarray(), count: qd.i32):
    """Copy the first `count` numbers."""
    for i in range(count):
        target[i] = source[i]


@qd.kernel(fastcache=True)
def spin(values: qd.types.ndarray(), count: qd.i32, a: qd.f32, b: qd.f32, turns: qd.i32, wide: qd.template()):
    """Multiply and add in eight independent chains of `wide` lanes for each number."""
    for i in range(count):
        x = qd.Matrix.zero(qd.f32, 8, wide)
        for lane in range(wide):
            for k in qd.static(range(8)):
                x[k, lane] = values[i] + k + lane
        for _ in range(turns):
            for lane in range(wide):
                for k in qd.static(range(8)):
                    x[k, lane] = x[k, lane] * a + b
        # Not the sum: of that the compiler would compute the chains of all at once.
        largest = 0.0
        for lane in range(wide):
            for k in qd.static(range(8)):
                largest = qd.max(largest, x[k, lane])
        values[i] = largest


@qd.func
def add_way(sums: qd.template(), r, square, a, b, c: Coefficients, method: qd.template()):
    """Add up the ways to the neighbours: the least that a pass over the lists can do."""
    sums[0] += r.sum()


@qd.kernel(fastcache=True)
def walk(total: qd.types.ndarray(), particles: Particles, grid: Grid, c: Coefficients, count: qd.i32):
    """Go once over all neighbour lists."""
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            ways = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_neighbors(ways, add_way, cluster, particles, particles.v, grid, c, 0)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                total[i] = ways[0, i - cluster * grid.lanes]


def roofline(
    name: str,
    size: int,
    *,
    arch: str = "cpu",
    seconds: float = 0.2,
    repeats: int = 3,
    threads: int | None = None,
    say: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Measure the ceilings and every kernel of a run, and return times, rates and shares as plain data.

    Raises `WavetankError` for a 2-D scene, whose operations `COSTS` does not count.
    """
    check(seconds, repeats)
    started = compiler.start(arch, threads=threads)
    scene = sized(Scene.load(name), size)
    if scene.dim != 3:
        raise WavetankError(
            f"--roofline: {name} is a 2-D world; operations are counted for 3-D ones, give one of them."
        )
    say(f"{name}, {size:,} particles: measuring")
    busy, run = load(), measured(scene, arch, seconds)
    ceilings = measure_ceilings(scene, arch)
    passes = []
    for turn in range(repeats):
        say(f"pass {turn + 1} of {repeats}")
        passes.append(timed(scene, arch, run["frames"], turn))
    kernels = {}
    for key in sorted({key for taken in passes for key in taken["kernels"]}):
        stage, kernel = key.split(": ")
        taken = [one["kernels"][key] for one in passes if key in one["kernels"]]
        if kernel in COSTS and stage not in ("foam", "render"):
            seconds_each, launches = (statistics.median(pair[k] for pair in taken) for k in (0, 1))
            kernels[kernel] = {"stage": stage, **share(COSTS[kernel], run, launches, seconds_each, ceilings)}
    return {
        "machine": machine(started, threads),
        "settings": {"scene": name, "size": size, "seconds": seconds, "load_before": busy},
        "particles": run["particles"],
        "ceilings": ceilings,
        "kernels": kernels,
        "stages": by_stage(kernels),
    }


def measure_ceilings(scene: Scene, arch: str) -> dict[str, float]:
    """Return copy [bytes/s] at the run's own size and at a large one, arithmetic [1/s], walk [pairs/s]."""
    sim = Simulation(scene, arch)
    sim.step()
    sim.frame()
    world, count = sim.world, sim.count
    own = min(LARGE, max(1024, water_bytes(sim) // 8))
    target, source, c = scalars(LARGE), scalars(LARGE), coefficients(scene, scene.frame_time)
    source.fill(1.0)
    wide = WIDE if compiler.lanes() > 1 else 1
    operations = 2.0 * SPINS * TURNS * CHAINS * wide
    lists = int(count_neighbors(world.particles, world.grid, c, count).sum())
    return {
        "copy": 8.0 * own / _fastest(lambda: copy(target, source, own)),
        "copy_large": 8.0 * LARGE / _fastest(lambda: copy(target, source, LARGE)),
        "arithmetic": operations / _fastest(lambda: spin(target, SPINS, 0.999, 0.001, TURNS, wide)),
        "walk": lists / _fastest(lambda: walk(target, world.particles, world.grid, c, count)),
    }


def share(
    cost: Cost, run: dict[str, Any], launches: float, seconds: float, ceilings: dict[str, float]
) -> dict[str, Any]:
    """Return what a kernel reaches, given its launches and seconds per frame."""
    n = run["particles"] * launches
    listed = n * run["pairs_per_particle"]
    moved = 4.0 * (n * (3 * cost.vectors + cost.words) + listed * cost.pair_words)
    computed = n * (cost.operations + run["tests_per_particle"] * cost.test_operations) + listed * cost.pair_operations
    limits = {"memory": moved / ceilings["copy"], "arithmetic": computed / ceilings["arithmetic"]}
    bound = max(limits, key=lambda key: limits[key])
    return {
        "ms": 1e3 * seconds,
        "least_ms": 1e3 * limits[bound],
        "bytes_per_second": moved / seconds,
        "operations_per_second": computed / seconds,
        "bound": bound,
        "share": limits[bound] / seconds,
        "walk_ms": 1e3 * listed / ceilings["walk"] if cost.pair_operations else None,
    }


def by_stage(kernels: dict[str, dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Return milliseconds, least milliseconds and the share of each stage."""
    stages: dict[str, dict[str, float]] = {}
    for figures in kernels.values():
        stage = stages.setdefault(figures["stage"], {"ms": 0.0, "least_ms": 0.0})
        stage["ms"] += figures["ms"]
        stage["least_ms"] += figures["least_ms"]
    return {name: {**stage, "share": stage["least_ms"] / stage["ms"]} for name, stage in stages.items()}


def roofline_table(result: dict[str, Any]) -> list[Table]:
    """Return the ceilings, and a line for each kernel."""
    top = result["ceilings"]
    ceilings = Table("ceiling", "measured")
    ceilings.add_row("copy, arrays as large as the run's", f"{top['copy'] / 1e9:.1f} GB/s")
    ceilings.add_row("copy, large arrays", f"{top['copy_large'] / 1e9:.1f} GB/s")
    ceilings.add_row("multiply and add", f"{top['arithmetic'] / 1e9:.1f} G operations/s")
    ceilings.add_row("walk over the neighbour lists", f"{top['walk'] / 1e6:.0f} M pairs/s")
    table = Table("stage", "kernel", "ms per frame", "GB/s", "G operations/s", "of its ceiling", "bare walk / time")
    stage = ""
    for name, row in sorted(result["kernels"].items(), key=lambda item: (item[1]["stage"], -item[1]["ms"])):
        total = result["stages"][row["stage"]]
        if row["stage"] != stage:
            stage = row["stage"]
            table.add_row(stage, "", f"{total['ms']:.2f}", "", "", f"{100 * total['share']:.0f} %", "")
        table.add_row(
            "",
            name,
            f"{row['ms']:.2f}",
            f"{row['bytes_per_second'] / 1e9:.1f}",
            f"{row['operations_per_second'] / 1e9:.1f}",
            f"{100 * row['share']:.0f} % {row['bound']}",
            "" if row["walk_ms"] is None else f"{100 * row['walk_ms'] / row['ms']:.0f} %",
        )
    return [ceilings, table]


def _fastest(work: Callable[[], Any]) -> float:
    """Return the seconds of the fastest of several tries after a first one."""
    work()
    times: Sequence[float] = []
    for _ in range(TRIES):
        compiler.synchronize()
        began = time.perf_counter()
        work()
        compiler.synchronize()
        times = [*times, time.perf_counter() - began]
    return min(times)
