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
    scene = wt.Scene(
        spacing=0.1, tank=wt.Tank(size=(1, 1)), fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.5))], quality=quality
    )
    sim = wt.Simulation(scene)
    sim.step()
    sim.save(tmp_path / "a.npz")
    before = sim.digest()
    assert wt.Simulation.restore(tmp_path / "a.npz").digest() == before
    sim.scene.solids = sim.scene.solids
    assert sim.digest() == before


def foaming(**changes):
    """Two dams that meet in a plane, with much foam."""
    return wt.Simulation(sized(wt.Scene.load("double-dam-2d"), 800).changed(foam=4.0, foam_lifetime=5.0, **changes))


def test_foam_beside_water_that_leaves_goes_on_to_the_same_bits(tmp_path):
    """Foam looks for water in the cells of the last step, so nothing may leave before it has."""
    tank = wt.Scene.load("double-dam-2d").tank.model_copy(update={"open": ["+x"]})
    sim, states, digests, most = foaming(tank=tank), [], [], 0
    start = sim.count
    for number in range(1, 81):
        sim.step()
        digests.append(sim.digest())
        most = max(most, len(sim.frame().foam_positions))
        if number % 10 == 0:
            states.append(tmp_path / f"{number}.npz")
            sim.save(states[-1])
    assert most > 100
    assert 0 < sim.count < 0.9 * start
    for path in states[:-1]:
        again = wt.Simulation.restore(path)
        for number in range(again.frame_number, again.frame_number + 10):
            again.step()
            assert again.digest() == digests[number], f"frame {number + 1} from {path.stem}"


def test_foam_without_water_goes_on_to_the_same_bits(tmp_path):
    sim = foaming()
    sim.advance(0.8)
    sim.remove(sim.frame().ids)
    assert len(sim.frame().foam_positions) > 100
    sim.save(tmp_path / "foam.npz")
    again = wt.Simulation.restore(tmp_path / "foam.npz")
    for _ in range(6):
        sim.step()
        again.step()
        assert again.digest() == sim.digest()


def paint() -> wt.Scene:
    """Heavy paint in front of light oil, in a flat tank."""
    return wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1, 1)),
        materials=[wt.Material(name="paint", density=2000, viscosity=1.0), wt.Material(name="oil", density=800)],
        fluids=[
            wt.Block(lower=(0, 0), upper=(0.3, 0.3), material="paint"),
            wt.Block(lower=(0.6, 0), upper=(1.0, 0.3), material="oil"),
        ],
    )


BALL = {"shape": "sphere", "name": "ball", "center": (0.5, 0.7), "radius": 0.12, "density": 500}
EDITS = {
    "new particles": lambda sim: sim.add([(0.4, 0.8), (0.5, 0.8)]),
    "no particle of the first fluid": lambda sim: sim.remove_inside((0.15, 0.15), (0.16, 0.15), 0.5),
    "no particle": lambda sim: sim.remove(range(10**4)),
    "a body": lambda sim: sim.add_solid(wt.Sphere(**BALL)),
    "a body that is taken away": lambda sim: (sim.add_solid(wt.Sphere(**BALL)), sim.remove_solid("ball")),
}


@pytest.mark.parametrize(
    ("first", "then"), [(a, b) for a in EDITS for b in EDITS if not (a == "a body" and "body" in b)]
)
def test_edits_after_a_restore_have_the_same_effect(first, then, tmp_path):
    """What a digest says is all that goes on from it: fluids of new particles, and around bodies."""
    sim = wt.Simulation(paint())
    sim.step()
    EDITS[first](sim)
    sim.step()
    sim.save(tmp_path / "state.npz")
    other = wt.Simulation.restore(tmp_path / "state.npz")
    assert other.digest() == sim.digest()
    for one in (sim, other):
        EDITS[then](one)
        one.add([(0.7, 0.8)])
        one.step()
    assert (other.frame().materials == sim.frame().materials).all()
    assert other.digest() == sim.digest()
