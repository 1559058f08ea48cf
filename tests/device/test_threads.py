"""Water, foam and pictures are the same to the last bit on any number of threads, and looking changes nothing."""

import json
import os
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib, json, sys
import wavetank as wt
from wavetank.device import compiler

threads = int(sys.argv[1])
compiler.start("cpu", threads=threads)
sim = wt.Simulation(wt.Scene.load("dam-break").changed(spacing=0.04, foam=6.0))
for k in range(45):
    sim.step()
    if k % 7 == threads:
        sim.stats()
frame = sim.frame()
digest = lambda *arrays: hashlib.sha256(b"".join(a.tobytes() for a in arrays)).hexdigest()
foam = (
    frame.foam_positions, frame.foam_velocities, frame.foam_kinds, frame.foam_ages, frame.foam_lives, frame.foam_ids
)
views = {f"{view} view": digest(wt.render(sim, 96, 64, view=view)) for view in ("water", "particles", "slice")}
size = [len(frame.ids), len(frame.foam_ids)]
honey = wt.Simulation(wt.Scene.load("honey").changed(spacing=0.003))
honey.advance(0.2)
told = {"water": (frame.positions, frame.velocities), "foam": foam, "honey": (honey.positions, honey.velocities)}
print(json.dumps({"size": size, **{what: digest(*arrays) for what, arrays in told.items()}, **views}))
"""


@pytest.fixture(scope="module")
def runs() -> list[dict]:
    told = [
        subprocess.run([sys.executable, "-c", PROGRAM, n], capture_output=True, text=True, check=True).stdout
        for n in ("1", "3")
    ]
    return [json.loads(text.splitlines()[-1]) for text in told]


@pytest.mark.parametrize("what", ["size", "water", "foam", "honey", "water view", "particles view", "slice view"])
def test_the_number_of_threads_and_looking_do_not_matter(runs, what):
    assert runs[0]["size"][0] > 2000
    assert runs[0]["size"][1] > 1000
    assert len({str(run[what]) for run in runs}) == 1


BOUND = """
import os
from wavetank.device import compiler
from wavetank.device.compiler import qd

@qd.kernel
def fill(x: qd.types.ndarray()):
    for i in range(4096):
        x[i] = 1

compiler.start("cpu")
x = qd.ndarray(qd.i32, 4096)

def switches():
    lines = {t: open(f"/proc/self/task/{t}/status").read() for t in os.listdir("/proc/self/task")}
    return {t: int(text.split("nonvoluntary")[0].split("voluntary_ctxt_switches:")[1]) for t, text in lines.items()}

before = switches()
for _ in range(1000):
    fill(x)
after = switches()
busy = [int(t) for t in after if int(t) != os.getpid() and after[t] - before.get(t, 0) > 50]
print([[sorted(os.sched_getaffinity(t)) for t in chosen] for chosen in (busy, map(int, after))])
"""


@pytest.mark.skipif(not hasattr(os, "sched_getaffinity"), reason="only Linux lets a process choose its cores")
@pytest.mark.parametrize("bound", ["1", "0"])
def test_every_thread_that_computes_has_a_core_of_its_own(bound, tmp_path):
    program = tmp_path / "bound.py"  # the compiler reads the source of a kernel from its file
    program.write_text(BOUND)
    cores = sorted(os.sched_getaffinity(0))
    told = subprocess.run(
        [sys.executable, str(program)],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "WAVETANK_BIND_THREADS": bound, "QD_CPU_MAX_NUM_THREADS": str(len(cores))},
    ).stdout
    # Where a busy machine leaves the work to fewer threads, that is its choice.
    busy, every = json.loads(told.splitlines()[-1])
    if bound == "1":
        assert {tuple(each) for each in every if len(each) == 1} == {(core,) for core in cores}
        assert busy and all(len(each) == 1 for each in busy)
    else:
        assert busy and all(each == cores for each in busy)
