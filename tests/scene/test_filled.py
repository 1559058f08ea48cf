"""Data about a filled fluid, asked for before it is known where the water will be computed."""

import os
import subprocess
import sys

CODE = """
import wavetank as wt
from wavetank.device import compiler
ball = wt.Sphere(center=(0.5, 0.5), radius=0.3)
scene = wt.Scene(spacing=0.05, tank=wt.Tank(size=(1.0, 1.0)), fluids=[wt.Filled(inside=ball)])
first, second = scene.particles()[0], scene.particles()[0]
assert len(first) > 50 and (first == second).all()
assert compiler.current_backend() is None, "the choice of a back end is still open"
sim = wt.Simulation(scene)
sim.step()
assert (scene.particles()[0] == first).all() and compiler.current_backend() == "cpu"
"""


def test_the_particles_of_a_filled_fluid_choose_no_back_end():
    done = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, env=dict(os.environ))
    assert done.returncode == 0, done.stderr
