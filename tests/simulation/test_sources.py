"""Emitters and drains in a running world. Flows, ranges and levels: `wavetank validate emitter`."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.inlets import MOST_IN_A_ROW, inlet_of
from wavetank.simulation.inflow import closing_speed, jet_force, outlines

FLAT = wt.Tank(size=(1.0, 0.8))


def jet(**fields):
    return wt.Emitter(**{"position": (0.0, 0.6), "direction": (1, 0), "width": 0.1, "speed": 1.5} | fields)


def world(*emitters, **fields) -> wt.Simulation:
    scene = {"spacing": 0.025, "tank": FLAT, "foam": 0.0, "emitters": [*emitters]}
    return wt.Simulation(wt.Scene(**scene | fields))


@pytest.mark.parametrize(
    ("shape", "area"),
    [
        ({"shape": "disc", "radius": 0.05}, math.pi * 0.05**2),
        ({"shape": "disc", "radius": 0.013}, math.pi * 0.013**2),
        ({"shape": "ring", "radius": 0.09, "inner_radius": 0.05}, math.pi * (0.09**2 - 0.05**2)),
        ({"shape": "ring", "radius": 0.09, "inner_radius": 0.08}, math.pi * (0.09**2 - 0.08**2)),
        ({"shape": "rectangle", "size": (0.13, 0.07)}, 0.13 * 0.07),
    ],
)
def test_a_row_has_the_volume_of_its_particles_and_no_clumps(shape, area):
    d = 0.02
    inlet = inlet_of(shape, d, 0.0, 3)
    assert len(inlet) * d**3 == pytest.approx(area * inlet.pitch)
    assert inlet.area == pytest.approx(area)
    if area > 3 * d**2:
        assert inlet.pitch == pytest.approx(d, rel=0.25)
        gaps = np.linalg.norm(inlet.places[:, None] - inlet.places[None], axis=2) + 9 * np.eye(len(inlet))
        assert gaps.min() > 0.8 * d


def test_a_row_of_too_many_particles_is_refused():
    with pytest.raises(wt.WavetankError, match=f"at most {MOST_IN_A_ROW:,} are allowed"):
        inlet_of({"shape": "disc", "radius": 1.0}, 0.005, 0.0, 3)


@pytest.mark.parametrize(
    "emitter",
    [
        wt.Emitter(position=(0.3, 0.5, 0.3), direction=(1, 1, 0), radius=0.05, flow=12.0),
        wt.Emitter(position=(0.3, 0.5, 0.3), direction=(0, 0, 1), size=(0.1, 0.06), speed=1.0),
        wt.Emitter(position=(0.3, 0.5, 0.3), direction=(0, -1, 0), radius=0.08, inner_radius=0.05, speed=1, spread=0.2),
        wt.Emitter(position=(0.3, 0.5, 0.3), direction=(0, 1, 0), radius=0.1, speed=2.0, flow=8.0),  # a shower
        wt.Emitter(mesh=wt.Mesh(path="wavetank/knot.obj", center=(0.3, 0.4, 0.3), size=0.3), speed=0.05),
    ],
    ids=["flow", "rectangle", "ring", "shower", "mesh"],
)
def test_flow_is_right_within_a_row(emitter):
    d = 0.02
    sim = wt.Simulation(wt.Scene(spacing=d, tank=wt.Tank(size=(0.6, 0.8, 0.6)), emitters=[emitter], foam=0.0))
    mouth = emitter.inlet(d)
    for frames in (13, 17):
        for _ in range(frames):
            sim.step()
        asked = emitter.rate(mouth) * sim.time / d**3
        assert abs(sim.count - asked) <= 0.5 * len(mouth) + 1
    assert sim.stats()["withheld"] == 0
    assert sim.stats()["density_error_mean"] < 0.01


def test_what_an_emitter_lets_out_flies_as_it_should():
    """In free flight: v = u + g t, and the mouth's own motion comes on top."""
    sim = world(jet(width=0.025, speed=1.0, motion={"position": [0.1, "0.3 + 0.8*t"]}, duration=0.1))
    sim.advance(0.25)
    left = 0.1 + (sim.positions[:, 0] - 0.1) * 0  # x of the mouth
    flight = (sim.positions[:, 0] - left) / 1.0
    assert sim.velocities[:, 0] == pytest.approx(1.0, abs=0.02)
    assert sim.velocities[:, 1] == pytest.approx(0.8 - 9.81 * flight, abs=0.15)
    assert sim.count == pytest.approx(0.1 * 0.025 / 0.025**2, abs=1)


def test_start_duration_material_and_dye():
    oil = (
        wt.scene_material(name="oil", density=900) if hasattr(wt, "scene_material") else {"name": "oil", "density": 900}
    )
    sim = world(jet(start=0.1, duration=0.2, material="oil", dye="#ff0000"), materials=[oil])
    sim.advance(0.1)
    assert sim.count == 0
    sim.advance(0.4)
    assert sim.count == pytest.approx(0.2 * 0.15 / 0.025**2, abs=4)
    arrays = sim.snapshot().arrays
    assert set(arrays["material"].tolist()) == {1}
    assert set(arrays["dye"].tolist()) == {127 << 24 | 0xFF0000}


def test_sources_repeat_to_the_last_bit_and_from_a_file(tmp_path):
    drain = wt.Drain(name="sump", lower=(0.5, 0.0), upper=(1.0, 0.1), flow=0.1)
    parts = {"fluids": [wt.Block(lower=(0, 0), upper=(1, 0.2))], "drains": [drain]}
    emitters = [jet(speed="1 + sin(5*t)"), jet(position=(0.3, 0.7), direction=(0, -1), speed=0.7, feed="sump")]
    sim = world(*emitters, **parts)
    sim.advance(0.31)
    sim.save(tmp_path / "state.npz")
    snapshot = sim.snapshot()
    sim.advance(0.3)
    whole = sim.digest()
    again = wt.Simulation.restore(tmp_path / "state.npz")
    again.advance(0.3)
    assert again.digest() == whole
    assert again.stats()["emitted"] == sim.stats()["emitted"]
    there, clone = sim.positions, sim.clone()
    assert clone.digest() == whole
    sim.resume(snapshot)  # ids are for life: who comes now is someone else, at the same place
    sim.advance(0.3)
    assert np.array_equal(sim.positions, there)
    clone.advance(0.1)
    sim.advance(0.1)
    assert np.array_equal(sim.positions, clone.positions)


def test_water_that_goes_round_stays():
    drain = wt.Drain(name="sump", lower=(0.5, 0.0), upper=(1.0, 0.1), flow=0.15)
    sim = world(jet(feed="sump"), fluids=[wt.Block(lower=(0, 0), upper=(1, 0.2))], drains=[drain])
    count = sim.count
    for _ in range(90):
        sim.step()
        store = sim.sources.drains[0].store
        assert sim.count + store == count
        assert 0 <= store < 16
    assert sim.stats()["emitted"] > 200


def test_a_full_world_stops_or_recycles_and_says_so():
    stopped = world(jet(), most_particles=100)
    stopped.advance(1.0)
    assert stopped.count == 100
    assert stopped.stats()["withheld"] > 50
    assert len(stopped.notes) == 1
    assert "most_particles = 100" in stopped.notes[0]
    recycled = world(jet(), most_particles=100, when_full="recycle")
    recycled.advance(1.0)
    assert recycled.count == 100
    ids = recycled.snapshot().arrays["id"]
    assert recycled.stats()["emitted"] == pytest.approx(0.15 / 0.025**2, abs=4)
    assert recycled.stats()["withheld"] == 0
    assert ids.min() == recycled.stats()["emitted"] - 100


def test_an_emitter_under_water_brings_all_that_it_should():
    """The mouth is at the bottom of a pool whose pressure fills it whenever it can."""
    mouth = wt.Emitter(position=(0.5, 0.0), direction=(0, 1), width=0.1, speed=1.0)
    sim = world(mouth, fluids=[wt.Block(lower=(0, 0), upper=(1, 0.3))], spacing=0.02)
    sim.advance(1.0)
    assert sim.stats()["emitted"] == pytest.approx(0.1 / 0.02**2, abs=15)
    assert sim.stats()["density_error_mean"] < 0.01


def test_an_emitter_that_is_blocked_says_so():
    keys = [{"time": 0, "position": [0.5, 0.1]}, {"time": 0.2, "position": [0.1, 0.6]}]
    lid = wt.Box(name="lid", center=(0.15, 0.6), size=(0.2, 0.2), motion=keys)
    sim = world(jet(name="hose"), solids=[lid])
    sim.advance(1.5)
    assert sim.stats()["withheld"] > 50
    assert sim.notes == ["The emitter 'hose' is blocked by water or a solid: less comes out than it should."]


def test_levels_are_kept():
    gauge = wt.Gauge(lower=(0.0, 0.0), upper=(1.0, 0.8))
    fill = wt.Emitter(position=(0.2, 0.7), direction=(0, -1), width=0.1, speed=1.0, level=0.25, gauge=gauge)
    sim = world(fill, fluids=[wt.Block(lower=(0, 0), upper=(1, 0.2))])
    sim.advance(1.5)
    assert sim.count == pytest.approx(0.25 / 0.025**2, abs=4)
    empty = wt.Drain(lower=(0.8, 0.0), upper=(1.0, 0.1), level=0.15)
    sim = world(fluids=[wt.Block(lower=(0, 0), upper=(1, 0.2))], drains=[empty])
    sim.advance(1.5)
    assert sim.count == pytest.approx(0.15 / 0.025**2, abs=1)


def test_drains_take_what_they_say():
    block = wt.Block(lower=(0, 0), upper=(1, 0.3))
    slow = world(fluids=[block], drains=[wt.Drain(center=(0.5, 0), radius=0.2, flow=0.1, start=0.1, duration=0.5)])
    count = slow.count
    slow.advance(1.0)
    assert count - slow.count == pytest.approx(0.1 * 0.5 / 0.025**2, abs=1)
    mouth = world(fluids=[block], drains=[wt.Drain(center=(0.5, 0), radius=0.05, direction=(0, 1))])
    mouth.advance(0.5)
    gone = count - mouth.count
    assert 20 < gone < 0.1 * 0.5 * math.sqrt(2 * 9.81 * 0.3) / 0.025**2  # less than Torricelli's jet of that width
    kill = wt.Drain(shape="outside", lower=(0, 0), upper=(0.6, 0.8))
    sim = world(fluids=[wt.Block(lower=(0, 0), upper=(0.4, 0.4))], drains=[kill])
    for _ in range(40):
        sim.step()
        assert sim.positions[:, 0].max() <= 0.6
    assert 0 < sim.stats()["drained"] == 256 - sim.count


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: jet(speed=None), "give speed .* or flow"),
        (lambda: jet(flow=1.0), "the mouth passes 0.15 m.2/s at most, and flow is 1"),
        (lambda: jet(direction=(0, 0)), "has no direction"),
        (lambda: wt.Emitter(position=(0, 0, 0), direction=(1, 0, 0), width=0.1, speed=1), "shape is line"),
        (lambda: wt.Emitter(direction=(1, 0), width=0.1, speed=1), "a line needs position"),
        (lambda: wt.Emitter(position=(0, 0, 0), direction=(1, 0, 0), radius=1, inner_radius=2, speed=1), "less than"),
        (lambda: jet(dye="red"), "write it as '#rrggbb'"),
        (lambda: jet(speed=-1), "speed = -1 is not allowed; it must be a number greater than 0"),
        (lambda: jet(speed="sin(t)"), "greater than 0"),
        (lambda: jet(sped=1), "did you mean 'speed'"),
        (lambda: wt.Drain(center=(0, 0)), "a sphere needs radius"),
        (lambda: wt.Drain(lower=(0, 0), upper=(0, 1)), "must be greater than that of lower"),
        (lambda: wt.Drain(lower=(0, 0), upper=(1, 1), suction=3), "suction needs a center"),
        (lambda: world(jet(feed="sump")), "feed = 'sump' is not the name of a drain"),
        (lambda: world(jet(position=(1.5, 0.5))), r"emitters\[0\] is inside of a solid or outside of the tank"),
        (lambda: world(jet(), solids=[wt.Box(center=(0.0, 0.6), size=(0.3, 0.3))]), "is inside of a solid"),
        (lambda: world(jet(position=(0, 0.6, 0))), "in a 2-D world its shape is line"),
        (lambda: world(jet(material="oil")), r"emitters\[0\].material = 'oil' is not one"),
        (lambda: world(jet(name="a"), jet(name="a")), "the name 'a' is used twice"),
    ],
)
def test_what_is_no_source_is_told_in_one_sentence(make, complaint):
    with pytest.raises(wt.WavetankError, match=complaint) as told:
        make()
    assert "\n" not in str(told.value)


def test_sources_go_to_a_file_and_back_and_scale():
    gauge = wt.Gauge(lower=(0, 0), upper=(1, 1))
    scene = wt.Scene(
        spacing=0.05,
        tank=wt.Tank(size=(1, 1)),
        most_particles=5000,
        when_full="recycle",
        emitters=[jet(speed="1 + t", level=0.3, gauge=gauge, feed="d")],
        drains=[wt.Drain(name="d", center=(0.5, 0.5), radius=0.1, flow="0.1*t")],
    )
    assert wt.Scene.from_text(scene.text()) == scene
    big = scene.scaled(2.0)
    assert (big.emitters[0].width, big.emitters[0].level, big.emitters[0].at(1.0).speed) == (0.2, 0.6, 2.0)
    assert big.drains[0].at(1.0).flow == pytest.approx(0.2)  # a slit twice as wide at the same speed


def test_mouths_are_outlined_where_they_are():
    """What page and window draw over the picture: closed lines, at the pose of the moment."""
    moved = wt.Emitter(
        position=(0.3, 0.5, 0.3),
        direction=(0, 0, 2),
        size=(0.2, 0.1),
        speed=1,
        motion={"position": ["0.3 + t", 0.5, 0.3]},
    )
    drain = wt.Drain(center=(0.5, 0, 0.3), radius=0.1, direction=(0, 1, 0))
    scene = wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1, 1)), emitters=[moved], drains=[drain])
    (first, mouth), (second, hole) = outlines(scene, 0.2)
    assert (first, second) == ("emitter", "drain")
    assert mouth.min(axis=0) == pytest.approx([0.4, 0.45, 0.3])
    assert mouth.max(axis=0) == pytest.approx([0.6, 0.55, 0.3])
    assert np.array_equal(mouth[0], mouth[-1])
    assert np.linalg.norm(hole - [0.5, 0, 0.3], axis=1) == pytest.approx(0.1)
    assert hole[:, 1] == pytest.approx(0.0)


def against_each_other(turn: float) -> wt.Scene:
    """Two jets of 5 m/s that meet: head on, or at 2 x `turn` [rad] to the line between them."""
    across, down = math.cos(turn), -math.sin(turn)
    jets = [
        wt.Emitter(position=(side * 0.4, 0.0, 0.0), direction=(-side * across, down, 0.0), radius=0.16, speed=5.0)
        for side in (-1.0, 1.0)
    ]
    return wt.Scene(spacing=0.04, gravity=(0.0, 0.0, 0.0), emitters=jets, foam=0.0)


@pytest.mark.parametrize("turn", [0.0, math.pi / 4])
def test_jets_that_meet_gain_no_energy(turn):
    """Nothing but the mouths does work on them (Bernoulli): what comes together has no more energy than what came in.

    Fronts that close at an angle throw a jet ahead of them, at most u (1 + cos b) / sin b fast with the half angle b
    between the fronts: Birkhoff, MacDougall, Pugh, Taylor, "Explosives with Lined Cavities", J. Appl. Phys. 19, 1948.
    """
    sim, shares = wt.Simulation(against_each_other(turn)), []
    while sim.time < 0.2:
        sim.step()
        squares = np.sum(sim.velocities.astype(float) ** 2, axis=1)
        shares.append(squares.mean() / 25.0)
    assert max(shares) < 1.02, "1.25 head on where steps follow the speed of either jet"
    assert shares[-1] < 0.99, "they have met"
    if turn:
        assert np.percentile(np.sqrt(squares), 99.5) < 1.1 * 5.0 * (1.0 + math.cos(turn)) / math.sin(turn)


def test_jets_that_pass_or_part_take_no_shorter_steps():
    def closing(*places) -> float:
        jets = [wt.Emitter(position=at, direction=ahead, radius=0.1, speed=2.0) for at, ahead in places]
        scene = wt.Scene(spacing=0.05, emitters=jets)
        return closing_speed(jet_force(scene, jet, 0.0) for jet in jets)

    assert closing(((-1, 0, 0), (1, 0, 0)), ((1, 0, 0), (-1, 0, 0))) == pytest.approx(4.0)
    assert closing(((-1, 0, 0), (1, -1, 0)), ((1, 0, 0), (-1, -1, 0))) == pytest.approx(2.0 * math.sqrt(2.0))
    assert closing(((-1, 0, 0), (1, 0, 0)), ((1, 0.5, 0), (-1, 0, 0))) == 0.0, "they pass each other"
    assert closing(((-1, 0, 0), (-1, 0, 0)), ((1, 0, 0), (1, 0, 0))) == 0.0, "they part"
    assert closing(((-1, 0, 0), (0, 1, 0)), ((1, 0, 0), (0, 1, 0))) == 0.0, "they go side by side"
    assert closing(((-1, 0, 0), (1, 0, 0))) == 0.0


@pytest.mark.parametrize("place", [0.5, 0.999])
def test_a_mouth_at_a_seam_brings_what_one_in_the_middle_does(place):
    """What comes out beyond an end of a tank that repeats is within at the other side, and held in the jet there."""
    tank = wt.Tank(size=(1.0, 0.8), periodic=["x"])
    sim = world(wt.Emitter(position=(place, 0.7), direction=(0, -1), width=0.15, speed=2.0), tank=tank)
    sim.advance(0.25)
    way = sim.positions[:, 0].astype(float) - place
    way -= np.round(way)
    assert sim.count * 0.025**2 == pytest.approx(0.15 * 2.0 * 0.25, rel=0.05)
    assert abs(way).max() < 0.15
    assert abs(way.mean()) < 0.01
    assert ((sim.positions[:, 0] >= 0.0) & (sim.positions[:, 0] < 1.0)).all()
    assert not sim.notes


@pytest.mark.parametrize(
    "drain",
    [
        {"center": (0.99, 0.1), "radius": 0.1},
        {"center": (0.99, 0.1), "radius": 0.1, "flow": 1e4},
        {"lower": (0.9, 0.0), "upper": (1.1, 0.2)},
        {"center": (0.99, 0.0), "radius": 0.1, "direction": (0, 1), "flow": 1e4},
    ],
    ids=["sphere", "with a flow", "box", "mouth"],
)
def test_a_drain_at_a_seam_takes_from_both_sides(drain):
    tank = wt.Tank(size=(1.0, 0.8), periodic=["x"])
    block = wt.Block(lower=(0, 0), upper=(1.0, 0.3))
    sim = world(tank=tank, fluids=[block], drains=[wt.Drain(**drain)])
    before = sim.positions
    sim.step()
    x, number = sim.positions, sim.count
    assert number < len(before) - 20
    sides = [(np.count_nonzero(p[:, 0] < 0.08), np.count_nonzero(p[:, 0] > 0.92)) for p in (before, x)]
    assert sides[1][0] < sides[0][0] - 8
    assert sides[1][1] < sides[0][1] - 8


def test_a_source_is_turned_off_and_stays_off_in_a_state(tmp_path):
    sim = world(jet(name="tap", speed=1.0))
    sim.advance(0.2)
    tap = sim.sources["tap"]
    assert tap.rate == pytest.approx(1.0 * 0.15, rel=0.5) and tap.total == sim.count > 0
    before = sim.digest()
    tap.on = False
    assert sim.digest() != before, "it decides how the world continues"
    sim.save(tmp_path / "off.npz")
    again = wt.Simulation.restore(tmp_path / "off.npz")
    for world_ in (sim, again):
        count = world_.count
        world_.advance(0.1)
        assert world_.count == count and world_.sources["tap"].rate == 0.0
    again.sources["tap"].on = True
    again.advance(0.1)
    assert again.count > count
    with pytest.raises(wt.WavetankError, match="no emitter or drain named 'sink'; there are: tap"):
        sim.sources["sink"]
