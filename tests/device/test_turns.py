"""Threads: launches come one at a time, what is read waits for a frame, and a forked process is told so."""

import concurrent.futures
import os
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.turns import Turn


def world(k: int = 0) -> wt.Simulation:
    block = wt.Block(lower=(0, 0), upper=(0.3 + 0.02 * k, 0.2))
    return wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(0.6, 0.4)), fluids=[block], foam=0))


def moved(sim: wt.Simulation) -> str:
    sim.advance(0.25)
    return sim.digest()


def at_once(*calls):
    with concurrent.futures.ThreadPoolExecutor(len(calls)) as pool:
        return [future.result(timeout=120) for future in [pool.submit(call) for call in calls]]


@pytest.fixture(scope="module")
def alone() -> list[str]:
    return [moved(world(k)) for k in range(2)]


def test_worlds_are_made_and_moved_in_any_thread(alone):
    assert at_once(*(lambda k=k: moved(world(k)) for k in range(2))) == alone


def test_a_world_is_read_and_drawn_while_another_thread_moves_it(alone):
    sim = world()
    wt.render(sim, 32, 24)
    seen = []

    def read():
        while sim.time < 0.2:
            x, v, picture = sim.positions, sim.velocities, wt.render(sim, 32, 24)
            assert np.isfinite(x).all() and x.shape == v.shape == (sim.count, 2) and picture.any()
            seen.append(sim.frame_number)

    assert at_once(lambda: moved(sim), read)[0] == alone[0]
    assert len(set(seen)) > 2, "who waits comes before who computes the next frame"


def test_what_another_thread_sets_holds_from_a_frame_on():
    sim = world()

    def lift():
        while sim.time < 0.1:
            pass
        sim.gravity = (0, 0)
        sim.velocities = np.zeros((sim.count, 2))

    at_once(lambda: moved(sim), lift)
    assert sim.gravity == (0, 0)


def test_a_turn_can_be_taken_again_by_who_has_it():
    turn = Turn()
    with turn, turn:
        assert at_once(lambda: turn.owner)[0] != 0
    assert turn.owner == 0
    with pytest.raises(KeyError), turn:
        raise KeyError
    at_once(lambda: turn.__enter__())


FORK = """
import multiprocessing
import wavetank as wt
def work(k):
    sim = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.05))
    sim.step()
    return sim.count
if __name__ == "__main__":
    if {used}:
        world = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.05))
        work = [work, lambda k: world.step(), lambda k: world.positions][{used} - 1]
    child = multiprocessing.get_context("fork")
    ends, end = child.Pipe()
    def run():
        try:
            end.send(work(0))
        except Exception as error:
            end.send(f"{{type(error).__name__}}: {{error}}")
    one = child.Process(target=run)
    one.start()
    print(ends.recv() if ends.poll(50) else "hangs")
    one.join(20)
    print("code", one.exitcode)
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system does not fork")
@pytest.mark.parametrize("used", [0, 1, 2, 3])
def test_a_forked_process_is_told_at_once_that_it_cannot_compute(used):
    """1: a new world, 2: a frame of one from before, 3: its positions. A fork before use computes."""
    run = subprocess.run([sys.executable, "-c", FORK.format(used=used)], capture_output=True, text=True, timeout=150)
    said, code = run.stdout.splitlines()[-2:]
    assert code == "code 0", run.stderr
    if used:
        assert said.startswith("WavetankError: this process was forked") and "spawn" in said
    else:
        assert int(said) > 10
