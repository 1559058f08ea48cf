"""Many thousand mutations of everything that comes from outside, in a process of its own with limits.

    python tests/fuzz/long.py --count 20000            all inputs, by turns
    python tests/fuzz/long.py --inputs state,mesh --count 500 --seed 7

What fails is written to tests/fuzz/found/, with its door in front of the name; what is worth keeping goes to
`attacks.py` in its smallest form. Exit code 1 where anything failed. Limits of one input: 1 GB more than before, and
5 s of a processor (a process that is killed by either is one more failure).
"""

import argparse
import contextlib
import faulthandler
import hashlib
import json
import os
import pickle
import re
import subprocess
import sys
import time
import traceback
from pathlib import Path

HERE = Path(__file__).parent
FOUND = HERE / "found"
SHARES = {
    "repetition": 0.02,
    "watcher": 0.05,
    "inclusion": 0.02,
    "scene": 0.25,
    "state": 0.15,
    "message": 0.25,
    "recording": 0.08,
    "mesh": 0.07,
    "checkpoint": 0.04,
    "run": 0.06,
    "robot": 0.03,
    "other": 0.04,
    "case": 0.03,
    "particles": 0.03,
}
LONGEST, MORE_MEMORY, BATCH = 5.0, 1_000_000_000, 250
HANGS = 60.0  # s of a clock, after which the process is ended


def resident() -> int:
    return 1024 * int(re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text())[1])


def peak() -> int:
    return 1024 * int(re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[1])


def keep(name: str, given: object, why: str) -> None:
    FOUND.mkdir(exist_ok=True)
    key = hashlib.sha256(pickle.dumps(given)).hexdigest()[:12]
    (FOUND / f"{name}-{key}.txt").write_text(f"{why}\n\n{given!r}\n", encoding="utf-8", errors="replace")


def batch(name: str, count: int, seed: int) -> int:
    """Try so many inputs in this process; return how many failed."""
    os.environ["WAVETANK_STRICT_INPUT"] = "1"
    import hypothesis
    from attacks import TooSlowError
    from files import good_scenes
    from hypothesis import HealthCheck, Phase, given, settings
    from inputs import FOLDER, INPUTS, try_scene

    try_scene("spacing = 0.1\ntank.size = [1, 1]\nfluids = [{lower = [0, 0], upper = [0.5, 0.5]}]")  # kernels
    inputs, attempt = INPUTS[name]
    if name == "other":  # kernels, of bodies and in space
        for plain, files in good_scenes():
            with contextlib.suppress(AssertionError):
                attempt({**files, "scene.json": json.dumps(plain).encode()})
    failures, last = [0], FOLDER / "last-input"
    FOLDER.mkdir(exist_ok=True)

    @hypothesis.seed(seed)
    @settings(
        max_examples=count,
        deadline=None,
        database=None,
        suppress_health_check=list(HealthCheck),
        phases=[Phase.generate],
    )
    @given(inputs)
    def attack(given_input: object) -> None:
        last.write_bytes(pickle.dumps((name, given_input)))
        faulthandler.dump_traceback_later(HANGS, exit=True)
        why = ""
        for trial in range(2):  # the first that needs a kernel compiles it, which costs seconds once
            Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
            before, began = resident(), time.process_time()
            try:
                attempt(given_input)
            except TooSlowError:
                if trial == 0:
                    continue
                why = traceback.format_exc()
            except BaseException:
                why = traceback.format_exc()
            break
        faulthandler.cancel_dump_traceback_later()
        if time.process_time() - began > LONGEST:
            why += f"\n{time.process_time() - began:.1f} s"
        if peak() - before > MORE_MEMORY:
            why += f"\n{(peak() - before) / 1e6:.0f} MB"
        if why:
            failures[0] += 1
            keep(name, given_input, why)

    with contextlib.suppress(hypothesis.errors.FlakyStrategyDefinition):  # archives hold the time of day
        attack()
    return failures[0]


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--inputs", default=",".join(SHARES))
    parser.add_argument("--seed", type=int, default=int(time.time()))
    parser.add_argument("--batch", nargs=3, default=None)
    options = parser.parse_args()
    if options.batch:
        name, count, seed = options.batch
        return min(batch(name, int(count), int(seed)), 100)
    names = options.inputs.split(",")
    total = sum(SHARES[name] for name in names)
    failures = tried = 0
    began, seed = time.monotonic(), options.seed
    left = {name: max(1, round(options.count * SHARES[name] / total)) for name in names}
    while any(left.values()):
        for name in names:
            count = min(BATCH, left[name])
            if not count:
                continue
            left[name] -= count
            seed += 1
            run = subprocess.run(
                [sys.executable, __file__, "--batch", name, str(count), str(seed)], capture_output=True, text=True
            )
            tried += count
            if run.returncode:
                failures += run.returncode if 0 < run.returncode <= 100 else 1
                if not 0 < run.returncode <= 100 or "Timeout" in run.stderr or "Traceback" in run.stderr:
                    FOUND.mkdir(exist_ok=True)
                    (FOUND / f"{name}-{seed}-died.txt").write_text(f"exit {run.returncode}\n{run.stderr[-6000:]}")
            print(
                f"{tried:7,} inputs, {failures} failures, {time.monotonic() - began:6.0f} s ({name}, seed {seed})",
                flush=True,
            )
    return int(failures > 0)


if __name__ == "__main__":
    sys.exit(main())
