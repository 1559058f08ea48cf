"""Compile what most tests share into the kernel cache: two processes, which take the bundled scenes from both ends.

It runs before tests that run in parallel: without it every worker, and every process that a test starts, would compile
the same kernels once more. One begins with the scenes in a plane, the other with those in space, so that they have next
to nothing in common until they meet.
"""

import pathlib
import subprocess
import sys
import tempfile
import time


def use(name: str) -> None:
    """Compute and show a bundled scene, coarse, and as many kinds of pictures as there are of one of them."""
    import wavetank as wt

    scene = wt.Scene.load(name)
    sim = wt.Simulation(scene.changed(spacing=2.5 * scene.spacing))
    for _ in range(3):
        sim.step()
    wt.render(sim, 64, 36)
    if name.startswith("obstacle-tank"):
        for view in ("water", "particles", "slice", "foam"):
            wt.render(sim, 64, 36, view=view, supersample=2)


def use_bodies_in_a_plane() -> None:
    """Compute what no bundled scene has."""
    import wavetank as wt

    ball = wt.Sphere(center=(0.7, 0.2), radius=0.1, density=400.0)
    block = wt.Block(lower=(0.0, 0.0), upper=(0.5, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 0.6)), fluids=[block], solids=[ball]))
    for _ in range(3):
        sim.step()


def scenes(last_first: bool) -> list[str]:
    """Return the names of the bundled scenes, those in space before those in a plane, or all the other way around."""
    import wavetank as wt

    names = sorted(wt.bundled_scenes(), key=lambda name: name.endswith("-2d"))
    return names[::-1] if last_first else names


def take(taken: pathlib.Path, last_first: bool) -> None:
    """Use scenes from one end of the list on until the other process has had the next one."""
    if last_first:
        use_bodies_in_a_plane()
    for name in scenes(last_first):
        try:
            (taken / name).mkdir()
        except FileExistsError:
            break
        use(name)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        take(pathlib.Path(sys.argv[1]), sys.argv[2] == "last")
        sys.exit()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as taken:
        both = [subprocess.Popen([sys.executable, __file__, taken, end]) for end in ("first", "last")]
        failed = [process.wait() for process in both]
    print(f"kernels compiled in {time.monotonic() - began:.0f} s")
    sys.exit(any(failed))
