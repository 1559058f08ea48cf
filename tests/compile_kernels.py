"""Compile what most tests share into the kernel cache, the two dimensions beside each other.

It runs before tests that run in parallel: without it every worker, and every process that a test starts, would compile
the same kernels once more.
"""

import os
import subprocess
import sys
import time


def use(dim: int) -> None:
    import wavetank as wt

    twin = "-2d" if dim == 2 else ""
    for name in (name for name in wt.bundled_scenes() if name.endswith("-2d") == (dim == 2)):
        scene = wt.Scene.load(name)
        sim = wt.Simulation(scene.changed(spacing=2.5 * scene.spacing))
        for _ in range(3):
            sim.step()
        wt.render(sim, 64, 36)
        if name == f"obstacle-tank{twin}":
            for view in ("water", "particles", "slice", "foam"):
                wt.render(sim, 64, 36, view=view, supersample=2)
    if dim == 2:  # no bundled scene has bodies in a plane
        ball = wt.Sphere(center=(0.7, 0.2), radius=0.1, density=400.0)
        block = wt.Block(lower=(0.0, 0.0), upper=(0.5, 0.4))
        sim = wt.Simulation(wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 0.6)), fluids=[block], solids=[ball]))
        for _ in range(3):
            sim.step()


if __name__ == "__main__":
    if len(sys.argv) > 1:
        use(int(sys.argv[1]))
        sys.exit()
    began = time.monotonic()
    both = [subprocess.Popen([sys.executable, __file__, dim], env=dict(os.environ)) for dim in "32"]
    failed = [process.wait() for process in both]
    print(f"kernels compiled in {time.monotonic() - began:.0f} s")
    sys.exit(any(failed))
