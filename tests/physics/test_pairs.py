"""Passes over pairs: what they sum is held by test_equations.py; here, what the compiler makes of them."""

import dataclasses
import os
import platform
import re
import subprocess
import sys

import pytest

from wavetank.device import compiler
from wavetank.device.compiler import qd
from wavetank.device.state import Grid, integers
from wavetank.physics.clusters import chunks, end_cluster, first_cluster
from wavetank.physics.neighbors import new_grid

PROGRAM = """
import sys
import wavetank as wt

scene = wt.Scene.load(sys.argv[1]).changed(
    spacing=0.06, vorticity=0.01, vorticity_coherence=0.0, dynamic_viscosity=0.01
)
sim = wt.Simulation(scene)
sim.step()
"""
#: Kernels of a step that go over pairs, and how many variants of them a step has.
PASSES = {
    "start_multipliers": 1,
    "solve_multipliers": 1,
    "correct_positions": 2,  # with artificial pressure and without
    "measure_density": 1,
    "apply_xsph": 1,
    "confine_vorticity": 1,
    "find_dampers": 1,
}


@qd.kernel
def count_visits(visits: qd.types.ndarray(), grid: Grid, count: qd.i32):
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            qd.atomic_add(visits[cluster], 1)


@pytest.mark.parametrize("lanes", [8, 1])
@pytest.mark.parametrize("count", [0, 1, 9, 128, 1000, 4097, 70001])
def test_every_team_has_its_turn_once(count, lanes):
    compiler.start("cpu")
    grid = dataclasses.replace(new_grid(2, count, (1.0, 1.0), 0.5, 32), lanes=lanes)
    visits = integers(count + 1)
    count_visits(visits, grid, count)
    clusters = -(-count // lanes)
    assert compiler.download(visits).tolist() == [1] * clusters + [0] * (count + 1 - clusters)


@pytest.mark.skipif(platform.machine() not in ("x86_64", "AMD64"), reason="the names of instructions are those of x86")
@pytest.mark.parametrize(("scene", "most"), [("obstacle-tank", 16), ("obstacle-tank-2d", 50)])
def test_eight_particles_are_computed_at_once(scene, most, tmp_path):
    """Every pass takes roots of vectors, and so few of them that the loop over lanes has not been unrolled before.

    Where there are two dimensions the first pass of an iteration is; it is computed as vectors nevertheless.
    """
    told = {
        "QD_OFFLINE_CACHE_FILE_PATH": str(tmp_path / "cache"),
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "QD_PRINT_KERNEL_ASM": "1",
    }
    program = tmp_path / "one.py"
    program.write_text(PROGRAM)
    command, env = [sys.executable, str(program), scene], {**os.environ, **told}
    subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, check=True)
    roots: dict[str, list[int]] = {name: [] for name in PASSES}
    for path in tmp_path.glob("*.s"):
        text = path.read_text()
        for name in PASSES:
            if re.search(rf"\b{name}_c\d+_\d+_kernel", text):
                roots[name].append(len(re.findall(r"\bv?sqrtps\b", text)))
    assert {name: len(found) for name, found in roots.items()} == PASSES
    assert all(0 < number <= most for found in roots.values() for number in found), roots
