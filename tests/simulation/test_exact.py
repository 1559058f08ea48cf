"""A state on disk goes on to the same bits: every bundled scene, foam, bodies, emitters and motions included."""

import os

import pytest

import wavetank as wt
from wavetank.lab.bench.scenes import sized
from wavetank.scene.scene import bundled_scenes

LONG = os.environ.get("WAVETANK_FUZZ") == "long"  # make fuzz
BEFORE, AFTER, EACH = (100, 100, 1) if LONG else (12, 6, 3)
SHORT = ("double-dam-2d", "fountain-2d", "honey-2d", "crates", "water-wheel", "wave-machine-2d")


@pytest.mark.parametrize("name", [name for name in bundled_scenes() if LONG or name in SHORT])
def test_restored_worlds_have_the_same_digest_at_every_later_step(name, tmp_path):
    sim = wt.Simulation(sized(wt.Scene.load(name), 1500))
    for _ in range(BEFORE):
        sim.step()
    sim.save(tmp_path / "state.npz")
    other = wt.Simulation.restore(tmp_path / "state.npz")
    assert other.digest() == sim.digest()
    for frame in range(AFTER):
        sim.step()
        other.step()
        assert other.digest() == sim.digest(), f"frame {frame} after the restore"
        if frame % EACH == 0:  # and from where it is now, again
            sim.save(tmp_path / "state.npz")
            other = wt.Simulation.restore(tmp_path / "state.npz")


@pytest.mark.parametrize("quality", ["draft", "standard", "high"])
def test_a_digest_knows_no_order_of_keys(quality, tmp_path):
    """Scenes of any quality, before and after they were assigned to: levels are of another one."""
    scene = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1)), fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.5))],
                     quality=quality)  # fmt: skip
    sim = wt.Simulation(scene)
    sim.step()
    sim.save(tmp_path / "a.npz")
    before = sim.digest()
    assert wt.Simulation.restore(tmp_path / "a.npz").digest() == before
    sim.scene.assign("solids", sim.scene.solids)
    assert sim.digest() == before
