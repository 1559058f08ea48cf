"""Our solver and SPlisHSPlasH's on the same dam break, taking turns; ratios are ours over theirs.

Two questions. Its PBF at equal spacing, support, iterations and time step: how much work a second. Its DFSPH, which
its users would pick, at equal mean density error: how much water a second, each at the fastest setting found that
keeps the error. Both are looked for in the same way: the time step is what the error is met with (`wave_courant` here,
the Courant factor there), for several amounts of work in a step (iterations here, the solver's error bound there).
"""

import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.table import Table

from benchmarks.peers.environment import PACKAGE, splishsplash_python
from benchmarks.peers.runs import Dam, Run, ours, pace, rate, theirs
from wavetank.device import compiler
from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.machine import cores, load, machine
from wavetank.lab.bench.scenes import check

ITERATIONS, TIME_STEP = 5, 0.0025  # of the comparison with PBF
SUPPORT = 2.0  # d, theirs
TARGETS = {"1pct": 0.01, "0.1pct": 0.001}
OUR_ITERATIONS = (2, 3, 4, 6)
THEIR_BOUNDS = (1.0, 0.3, 3.0)  # of the error that is allowed
WELL_MET = 0.85  # of the error that is allowed: a setting that leaves more unused is loosened
TRIES = 5  # for a time step that meets the error
PATIENCE = 1.1  # of the time that its fastest setting takes: a run of theirs that takes longer is given up

Say = Callable[[str], None]
Setting = dict[str, Any]


def compare_peers(
    pbf_count: int = 60_000,
    dfsph_count: int = 8_000,
    *,
    seconds: float = 0.5,
    repeats: int = 3,
    threads: int | None = None,
    say: Say = lambda s: None,
) -> dict[str, Any]:
    """Measure and return all ratios with what they come from; raises `WavetankError` where their solver is not here.

    Each comparison has its number of particles. At 60,000 their DFSPH takes minutes for half a second of water, some
    thirty times over in the search for its best setting.
    """
    for count in (pbf_count, dfsph_count):
        if not 1000 <= count <= 10_000_000:
            raise WavetankError(f"{count} particles are not allowed; it must be a number from 1,000 to 10,000,000.")
    check(seconds, repeats)
    python, workers = splishsplash_python(say), threads or cores()
    compiler.start("cpu", threads=threads)
    busy = load()
    with tempfile.TemporaryDirectory(prefix="wavetank-peers-") as name:
        folder = Path(name)

        def of(dam: Dam) -> Callable[..., Run]:
            return lambda **order: theirs(python, folder, dam, workers, **order)

        dam = Dam.of(pbf_count)
        pbf = against_pbf(dam, of(dam), min(seconds, 0.3), repeats, say)
        dam = Dam.of(dfsph_count)
        dfsph: dict[str, Any] = {}
        for label, target in TARGETS.items():
            found = against_dfsph(dam, of(dam), target, seconds, repeats, say)
            dfsph[f"ratio_at_{label}"] = found["ratio"]
            dfsph[f"at_{label}"] = found
    return {
        "machine": machine("cpu", threads),
        "settings": {
            "peer": PACKAGE,
            "particles": [pbf_count, dfsph_count],
            "seconds": seconds,
            "repeats": repeats,
            "load_before": busy,
        },
        "peers": {"splishsplash_pbf": pbf, "splishsplash_dfsph": dfsph},
    }


def peers_table(result: dict[str, Any]) -> Table:
    """Return the ratios as a table."""
    found, (pbf, dfsph) = result["peers"], result["settings"]["particles"]
    table = Table(
        "against SPlisHSPlasH", "ours / theirs", "(low, high)", "ours", "theirs", "density error, ours; theirs"
    )
    for title, one, name in (
        (f"PBF, {pbf:,}: M particle-iterations/s", found["splishsplash_pbf"], "particle_iterations_per_second"),
        (f"DFSPH at 1 %, {dfsph:,}: s of water per s", found["splishsplash_dfsph"]["at_1pct"], "water_per_second"),
        (f"DFSPH at 0.1 %, {dfsph:,}: s of water per s", found["splishsplash_dfsph"]["at_0.1pct"], "water_per_second"),
    ):
        factor = 1e-6 if name.startswith("particle") else 1.0
        table.add_row(
            title,
            f"{one['ratio']:.2f}",
            f"[{one['low']:.2f}, {one['high']:.2f}]",
            *(f"{factor * one[side][name]:.4g}" for side in ("ours", "theirs")),
            "; ".join(f"{100 * one[side]['density_error_mean']:.3f} %" for side in ("ours", "theirs")),
        )
    return table


def against_pbf(dam: Dam, their: Callable[..., Run], seconds: float, repeats: int, say: Say) -> dict[str, Any]:
    """Compare particle-iterations per second, whole steps, ours with viscosity and vorticity, theirs without."""
    scene = dam.scene(
        support=SUPPORT,
        iterations=ITERATIONS,
        frame_time=4.0 * TIME_STEP,
        substeps=4,
        courant=100.0,
        wave_courant=100.0,
        vorticity=0.01,
    )
    pairs = []
    for turn in range(repeats):
        say(f"PBF, equal iterations: turn {turn + 1} of {repeats}")
        a = ours(scene, seconds, measure=turn == 0)
        b = their(method="pbf", seconds=seconds, dt=TIME_STEP, iterations=ITERATIONS)
        pairs.append((a, b))
    return _verdict(pairs, rate, "particle_iterations_per_second")


def against_dfsph(
    dam: Dam, their: Callable[..., Run], target: float, seconds: float, repeats: int, say: Say
) -> dict[str, Any]:
    """Compare seconds of water per second where both keep the mean density error below `target`."""
    say(f"DFSPH, {100 * target:g} % error: looking for our fastest setting")
    mine = fastest_of_ours(dam, target, seconds, say)
    say(f"DFSPH, {100 * target:g} % error: looking for its fastest setting")
    order = fastest_of_theirs(their, target, seconds, say)
    pairs = []
    for turn in range(repeats):
        say(f"DFSPH, {100 * target:g} % error: turn {turn + 1} of {repeats}")
        a = ours(dam.scene(**mine), seconds, measure=turn == 0)
        pairs.append((a, their(**order)))
    return {**_verdict(pairs, pace, "water_per_second"), "our_setting": mine, "their_setting": order}


def fastest_of_ours(dam: Dam, target: float, seconds: float, say: Say) -> Setting:
    """Return the parameters of our fastest run whose mean density error stays below `target`."""
    found: list[tuple[float, Setting]] = []
    for grid in (1.0, 0.0):
        wave = 0.5 * (target / 0.003) ** 0.5
        for iterations in OUR_ITERATIONS:

            def setting(wave: float, iterations: int = iterations, grid: float = grid) -> Setting:
                # A fast particle is followed as a fast wave is; waves do not matter where a grid carries the pressure.
                return {
                    "iterations": iterations,
                    "substeps": 1,
                    "wave_courant": wave,
                    "grid_pressure": grid,
                    "courant": min(3.0 if grid else 2.25, max(0.3, 0.9 / 0.35 * wave)),
                    "largest_substeps": 1000,
                }

            wave = _meet(target, wave, (0.02, 3.0), setting, lambda s: ours(dam.scene(**s), seconds), found, say)
    return _fastest(found, target, "ours")


def fastest_of_theirs(their: Callable[..., Run], target: float, seconds: float, say: Say) -> Setting:
    """Return the order of their fastest run whose mean density error stays below `target`."""
    found: list[tuple[float, Setting]] = []
    courant = (target / 0.01) ** 0.5
    for share in THEIR_BOUNDS:

        def setting(courant: float, bound: float = 100.0 * share * target) -> Setting:
            return {
                "method": "dfsph",
                "seconds": seconds,
                "dt": 0.001,
                "cfl_factor": courant,
                "largest_dt": 0.02,
                "max_error": bound,
                "max_error_v": max(0.1, 10.0 * bound),
            }

        def run(order: Setting) -> Run:
            if not found:
                return their(**order)
            return their(**order, patience=PATIENCE * seconds / max(speed for speed, _ in found))

        courant = _meet(target, courant, (0.02, 4.0), setting, run, found, say)
    return _fastest(found, target, "DFSPH's")


def _meet(
    target: float,
    step: float,
    limits: tuple[float, float],
    setting: Callable[[float], Setting],
    run: Callable[[Setting], Run],
    found: list[tuple[float, Setting]],
    say: Say,
) -> float:
    """Look for the time step, in its own unit, whose error is just below `target`; add what keeps it to `found`."""
    before = 0
    for _ in range(TRIES):
        chosen = setting(step)
        taken = run(chosen)
        error, given_up = taken["density_error_mean"], taken.get("given_up", False)
        kept = error <= target
        if kept and not given_up:
            found.append((pace(taken), chosen))
        end = ", given up" if given_up else ""
        say(f"  {_short(chosen)}: {taken['steps']} steps, {100 * error:.3f} %, {pace(taken):.4f} s/s{end}")
        if error >= WELL_MET * target and (kept or given_up):  # a shorter step would only be slower
            break
        if taken["steps"] == before or (kept and step >= limits[1]):
            break
        before = taken["steps"]
        # Compression goes about with the square of the time step.
        step *= min(2.0, max(0.3, (0.93 * target / max(error, 1e-9)) ** 0.5))
        step = min(limits[1], max(limits[0], step))
    return step


def _fastest(found: list[tuple[float, Setting]], target: float, whose: str) -> Setting:
    if not found:
        raise WavetankError(f"no setting of {whose} kept the mean density error below {100 * target:g} %.")
    return max(found, key=lambda pair: pair[0])[1]


def _short(setting: Setting) -> str:
    shown = ("grid_pressure", "iterations", "wave_courant", "cfl_factor", "max_error")
    return ", ".join(f"{name} {setting[name]:.3g}" for name in shown if name in setting)


def _verdict(pairs: list[tuple[Run, Run]], figure: Callable[[Run], float], name: str) -> dict[str, Any]:
    ratios = [figure(a) / figure(b) for a, b in pairs]
    return {
        "ratio": statistics.median(ratios),
        "low": min(ratios),
        "high": max(ratios),
        "ours": {name: statistics.median(figure(a) for a, _ in pairs), **pairs[0][0]},
        "theirs": {name: statistics.median(figure(b) for _, b in pairs), **pairs[0][1]},
    }
