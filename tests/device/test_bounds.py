"""No kernel reads or writes outside of an array: on a processor it goes unnoticed, on a graphics card it ends the run.

The compiler can check each access. It does so here, in processes of their own, for particles in teams as on a
processor and one by one as on a card.
"""

import os
import subprocess
import sys

import pytest

#: As many particles as their arrays have room for, two fluids and foam.
WORLDS = {"oil-and-water-2d": 3}


@pytest.mark.parametrize("lanes", [8, 1])
def test_no_access_is_out_of_bounds(lanes):
    done = subprocess.run([sys.executable, __file__, str(lanes)], capture_output=True, text=True, env=os.environ)
    assert done.returncode == 0, done.stderr[-2000:]


def move_worlds(lanes: int) -> None:
    import wavetank as wt
    from wavetank.device import compiler
    from wavetank.device.compiler import qd

    begin = qd.init
    qd.init = lambda **options: begin(**options, debug=True, check_out_of_bound=True)
    compiler.LANES, compiler.FEW = lanes, 50_000 if lanes > 1 else 0
    for name, frames in WORLDS.items():
        sim = wt.Simulation(wt.Scene.load(name))
        for _ in range(frames):
            sim.step()


if __name__ == "__main__":
    move_worlds(int(sys.argv[1]))
