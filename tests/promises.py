"""Runs repeat to the last bit, and what is killed goes on to it: every bundled scene, and a hundred kills.

    python tests/promises.py scenes --frames 200 --particles 1500 [NAME ...]
    python tests/promises.py kills --count 100

`scenes` computes each scene in processes of their own: with one thread; with two; from a state that was saved in the
middle; and from one whose process was killed later on. The digests after every frame must be the same. `kills` ends
runs that write a video, HDF5, USD and checkpoints with SIGKILL, at any moment, and lets them go on: after each kill
everything that is there opens, the checkpoint is the exact instant, and nothing of the dead is
left after the next start.
Exit code 1 where any of this fails.
"""

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import wavetank as wt
from wavetank.run.checkpoints import load_run
from wavetank.scene.scene import bundled_levels, bundled_scenes, with_particles

Digests = dict[int, str]  # by the number of the frame


def compute(name: str, frames: int, particles: int, state: str, save: str, save_at: int, end_at: int) -> None:
    """Print the digest after each frame; save a state after one of them, and end without a word after another."""
    if state:
        sim = wt.Simulation.restore(state)
    else:
        scene = wt.Scene.load(name)
        sim = wt.Simulation(with_particles(scene, particles) if particles else scene)
    while sim.frame_number < frames:
        sim.step()
        print(sim.frame_number, sim.digest(), flush=True)
        if sim.frame_number == save_at:
            sim.save(save)
        if sim.frame_number == end_at:
            os.kill(os.getpid(), signal.SIGKILL)


def digests(name: str, frames: int, particles: int, threads: int, **more: str | int) -> Digests:
    """Return what such a process printed."""
    options = [f"--{key.replace('_', '-')}={value}" for key, value in more.items()]
    env = {**os.environ, "QD_CPU_MAX_NUM_THREADS": str(threads), "OPENBLAS_NUM_THREADS": str(threads)}
    done = subprocess.run(
        [sys.executable, __file__, "compute", name, f"--frames={frames}", f"--particles={particles}", *options],
        env=env,
        capture_output=True,
        text=True,
        timeout=7200,
    )
    if done.returncode not in (0, -signal.SIGKILL):
        raise RuntimeError(f"{name}: {done.stderr.strip()[-400:]}")
    return {int(number): digest for number, digest in (line.split() for line in done.stdout.splitlines())}


def differing(name: str, frames: int, particles: int, folder: Path) -> str:
    """Return how a scene breaks the promise, or nothing."""
    saved, second = folder / "saved.npz", folder / "second.npz"
    middle, later = frames // 3, (2 * frames) // 3
    whole = digests(name, frames, particles, 1, save=str(saved), save_at=middle)
    if len(whole) != frames:
        return f"{len(whole)} of {frames} frames"
    runs = {"two threads": digests(name, frames, particles, 2)}
    runs["restored"] = digests(
        name, frames, particles, 1, state=str(saved), save=str(second), save_at=later - 5, end_at=later
    )
    runs["killed, and gone on"] = digests(name, frames, particles, 2, state=str(second))
    needed = {"two threads": (1, frames), "restored": (middle + 1, later), "killed, and gone on": (later - 4, frames)}
    for title, run in runs.items():
        first, last = needed[title]
        bad = [number for number in range(first, last + 1) if run.get(number) != whole[number]]
        if bad:
            return f"{title}: frame {bad[0]} differs, as do {len(bad) - 1} others of {last + 1 - first}"
    return ""


def check_scenes(names: list[str], frames: int, particles: int) -> int:
    """Check these scenes, print a line each, and return how many failed."""
    failed = 0
    for name in names or [*bundled_scenes(), *bundled_levels()]:
        began = time.monotonic()
        with tempfile.TemporaryDirectory() as folder:
            try:
                problem = differing(name, frames, particles, Path(folder))
            except (RuntimeError, subprocess.TimeoutExpired) as error:
                problem = str(error)
        failed += bool(problem)
        print(f"{name:24s} {frames} frames  {problem or 'the same'}  {time.monotonic() - began:.0f} s", flush=True)
    return failed


# --- kills ---

RUN = (
    "drop-2d",
    "--set",
    "spacing=0.03",
    "--seconds",
    "4",
    "--fps",
    "30",
    "--size",
    "96x64",
    "--video",
    "--export",
    "h5,usd,npz",
    "--checkpoint-every",
    "0.15",
    "--name",
    "a",
)


def wavetank(*arguments: str) -> subprocess.Popen:
    return subprocess.Popen(
        [sys.executable, "-m", "wavetank", *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def reference() -> Digests:
    """Return the digest after each frame of that run."""
    sim = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.03))
    return {number: sim.digest() for number, _ in sim.numbered_frames(4.0, 30.0, 0.0)}


def problems_in(out: Path, exact: Digests) -> list[str]:
    """Return what is wrong with what a killed run left."""
    from wavetank.formats import hdf5, npz

    found = []
    if (out / "states" / "run.json").exists():
        kept = load_run(out)
        if kept.note:
            found.append(kept.note)
        if kept.sim.digest() != exact[kept.checkpoint.frame]:
            found.append(f"the checkpoint of frame {kept.checkpoint.frame} is not that instant")
    try:
        if (out / "a.h5").exists():
            for _ in hdf5.read(out / "a.h5"):
                pass
        for path in out.glob("a-[0-9]*.npz"):
            npz.read_npz(path)
        if (out / "a.usda").exists():
            from pxr import Usd

            Usd.Stage.Open(str(out / "a.usda"))
    except Exception as error:
        found.append(f"{type(error).__name__}: {error}")
    return found


def check_kills(count: int, seed: int) -> int:
    """Kill so many times; return how often something was wrong."""
    import av

    chance, exact, failed, kills, runs = random.Random(seed), reference(), 0, 0, 0
    final = exact[max(exact)]
    with tempfile.TemporaryDirectory() as folder:  # how long a whole run takes here, its start included
        began = time.monotonic()
        wavetank("run", *RUN, "--out", folder).communicate()
        whole = time.monotonic() - began
    while kills < count:
        runs += 1
        with tempfile.TemporaryDirectory() as folder:
            out, done = Path(folder) / "out", False
            process = wavetank("run", *RUN, "--out", str(out))
            while not done:
                wait = whole * chance.uniform(0.05, 1.2) if kills < count else 600.0
                try:
                    _, said = process.communicate(timeout=wait)
                    done = True
                    if process.returncode:
                        failed += 1
                        print(f"run {runs}: {said.strip()[-300:]}", flush=True)
                    continue
                except subprocess.TimeoutExpired:
                    process.kill()
                    process.communicate()
                kills += 1
                for problem in problems_in(out, exact):
                    failed += 1
                    print(f"kill {kills}: {problem}", flush=True)
                goes_on = (out / "states" / "run.json").exists()
                process = wavetank(*(("resume", str(out)) if goes_on else ("run", *RUN, "--out", str(out))))
            told = json.loads((out / "stats.json").read_text()) if (out / "stats.json").exists() else {}
            left = [path.name for path in out.rglob(".*")] + [path.name for path in [*out.glob("states/*.npz")][1:]]
            pictures = 0
            if (out / "a.mp4").exists():
                with av.open(str(out / "a.mp4")) as film:
                    pictures = len([*film.decode(video=0)])
            if told.get("digest") != final or left or pictures != 121:
                failed += 1
                print(f"run {runs}: digest same {told.get('digest') == final}, left {left}, {pictures} pictures")
        print(f"{kills} kills, {runs} runs, {failed} failures", flush=True)
    return failed


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_subparsers(dest="what", required=True)
    scenes, kills, one = (what.add_parser(name) for name in ("scenes", "kills", "compute"))
    for place in (scenes, one):
        place.add_argument("--frames", type=int, default=200)
        place.add_argument("--particles", type=int, default=1500, help="about so many; 0: as the scene is")
    scenes.add_argument("names", nargs="*")
    kills.add_argument("--count", type=int, default=100)
    kills.add_argument("--seed", type=int, default=1)
    one.add_argument("name")
    for name in ("--state", "--save"):
        one.add_argument(name, default="")
    for name in ("--save-at", "--end-at"):
        one.add_argument(name, type=int, default=-1)
    given = parser.parse_args()
    if given.what == "compute":
        compute(given.name, given.frames, given.particles, given.state, given.save, given.save_at, given.end_at)
        return 0
    if given.what == "kills":
        return int(check_kills(given.count, given.seed) > 0)
    return int(check_scenes(given.names, given.frames, given.particles) > 0)


if __name__ == "__main__":
    sys.exit(main())
