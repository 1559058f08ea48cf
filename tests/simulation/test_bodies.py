"""Bodies: what water does to them is the opposite of what they do to it (Newton's third law), and they float as deep as
Archimedes says."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.rotations import turned
from wavetank.simulation import coupling, state_file

pytest.importorskip("rapier3d")

WIDE, DEEP, D = 0.96, 0.4, 0.04


def pool(*solids, spacing=D, **more) -> wt.Simulation:
    block = wt.Block(lower=(0, 0, 0), upper=(WIDE, DEEP, WIDE))
    tank = wt.Tank(size=(WIDE, 0.9, WIDE))
    return wt.Simulation(wt.Scene(spacing=spacing, tank=tank, fluids=[block], solids=[*solids], **more))


def level(sim: wt.Simulation, displaced: float) -> float:
    """Height of the surface [m] from volumes."""
    area = np.prod(sim.scene.tank.size) / sim.scene.tank.size[1]
    return (sim.count * sim.scene.spacing**sim.scene.dim + displaced) / area


@pytest.mark.parametrize("ratio", [0.3, 0.7, 0.8])
def test_a_box_floats_as_deep_as_archimedes_says(ratio):
    """Draft = density ratio times height; at rest it does not jitter."""
    tall = 0.2
    sim = pool(
        wt.Box(
            name="box",
            center=(0.48, DEEP + tall * (0.5 - ratio), 0.48),
            size=(0.32, tall, 0.32),
            density=1000.0 * ratio,
        )
    )
    box, heights, speeds, forces = sim.bodies["box"], [], [], []
    for frame in range(240):
        sim.step()
        if frame >= 180:
            heights.append(box.position[1])
            speeds.append(np.linalg.norm(box.velocity))
            forces.append(box.force[1])
    draft = level(sim, ratio * 0.32 * tall * 0.32) - (np.mean(heights) - 0.5 * tall)
    assert draft == pytest.approx(ratio * tall, abs=0.3 * D)
    assert np.mean(forces) == pytest.approx(9.81 * box.mass, rel=0.02)
    assert np.sqrt(np.mean(np.square(speeds))) < 0.01


@pytest.mark.parametrize(("ratio", "calm"), [(0.05, 0.6), (0.1, 0.02)])
def test_a_light_box_that_falls_in_comes_to_rest(ratio, calm):
    """The water that it hits weighs many times what it does (Causin et al. 2005): it must not bounce for ever."""
    sim = pool(wt.Box(name="box", center=(0.48, DEEP + 0.18, 0.48), size=(0.32, 0.2, 0.32), density=1000.0 * ratio))
    box, highest, speeds = sim.bodies["box"], 0.0, []
    for frame in range(240):
        sim.step()
        if frame > 30:
            highest = max(highest, box.position[1])
        if frame >= 180:
            speeds.append(np.linalg.norm(box.velocity))
    assert highest < DEEP + 0.18
    assert np.sqrt(np.mean(np.square(speeds))) < calm


def test_what_is_heavier_than_water_sinks_at_a_pace():
    """By its weight less Archimedes' force against drag: v = sqrt(2 (rho_b - rho) g V / (rho C A)), C about 1."""
    sim = pool(wt.Box(name="box", center=(0.48, 0.25, 0.48), size=(0.16, 0.1, 0.16), density=1300.0))
    fastest, box = 0.0, sim.bodies["box"]
    for _ in range(60):
        sim.step()
        fastest = max(fastest, -box.velocity[1])
    ideal = np.sqrt(2.0 * 0.3 * 9.81 * 0.1)
    assert 0.25 * ideal < fastest < 1.2 * ideal
    assert box.position[1] < 0.11


def test_a_disc_floats_in_a_plane():
    """The same in 2-D, where a body has the mass of a metre of it."""
    scene = wt.Scene(
        spacing=0.02,
        tank=wt.Tank(size=(1.0, 0.8)),
        fluids=[wt.Block(lower=(0, 0), upper=(1.0, 0.4))],
        solids=[wt.Sphere(name="disc", center=(0.5, 0.42), radius=0.12, density=500)],
    )
    sim = wt.Simulation(scene)
    disc = sim.bodies["disc"]
    assert disc.mass == pytest.approx(500 * np.pi * 0.12**2, rel=2e-3)
    heights = []
    for frame in range(300):
        sim.step()
        if frame > 200:
            heights.append(disc.position[1])
    surface = level(sim, 0.5 * np.pi * 0.12**2)
    assert np.mean(heights) == pytest.approx(surface, abs=0.02)


@pytest.mark.parametrize("spacing", [0.05, 0.02])
def test_half_of_a_body_is_under_water(spacing):
    """Whatever the unit of the sums, which depends on the spacing."""
    scene = wt.Scene(
        spacing=spacing,
        tank=wt.Tank(size=(1.0, 0.8)),
        fluids=[wt.Block(lower=(0, 0), upper=(1.0, 0.4))],
        solids=[wt.Box(name="box", center=(0.5, 0.4), size=(0.3, 0.2), density=500, held=True)],
    )
    sim = wt.Simulation(scene)
    sim.advance(0.5)
    assert sim.bodies["box"].immersed == pytest.approx(0.5, abs=0.1)


def test_momentum_goes_from_water_to_body():
    """Without gravity the sum of momenta and of their moments stays, and energy does not rise."""
    scene = wt.Scene(
        spacing=0.03,
        gravity=(0, 0, 0),
        calming=0,
        fluids=[wt.Block(lower=(-0.2, -0.2, -0.2), upper=(0.2, 0.2, 0.2), velocity=(1, 0, 0))],
        solids=[
            wt.Box(name="box", center=(0.4, 0.05, 0), size=(0.2, 0.2, 0.2), density=600, rotation=(0.9, 0.1, 0.3, 0.2))
        ],
    )
    sim, mass = wt.Simulation(scene), 1000 * 0.03**3
    body = sim.bodies["box"]

    def sums():
        x, v = sim.positions.astype(float), sim.velocities.astype(float)
        owed = body.pending_impulse  # which the body has got, and shows in the next step
        turn = np.array([turned(body.rotation, axis) for axis in np.eye(3)]).T
        momentum = body.mass * body.velocity + owed[:3]
        angular = np.cross(body.center, momentum) + turn @ body.dry.tensor @ turn.T @ body.angular_velocity + owed[3:]
        energy = 0.5 * mass * (v**2).sum() + 0.5 * body.mass * (body.velocity**2).sum()
        return mass * v.sum(axis=0) + momentum, mass * np.cross(x, v).sum(axis=0) + angular, energy

    momentum, angular, energy = sums()
    for _ in range(60):
        sim.step()
    assert body.velocity[0] > 0.3, "the water has hit it"
    after, turned_after, energy_after = sums()
    whole = np.linalg.norm(momentum)
    assert np.linalg.norm(after - momentum) < 1e-3 * whole
    assert np.linalg.norm(turned_after - angular) < 1e-3 * whole * 0.4
    assert energy_after < energy


def test_a_heavy_body_sinks_and_a_fast_light_one_does_not_fly_off():
    """8 times as heavy as water: to the floor. A tenth: added mass must not make it explode (Causin et al. 2005)."""
    sim = pool(
        wt.Box(name="iron", center=(0.25, 0.5, 0.25), size=(0.16, 0.16, 0.16), density=8000),
        wt.Sphere(name="cork", center=(0.65, 0.62, 0.65), radius=0.12, density=100, velocity=(0, -2, 0)),
    )
    highest = 0.0
    for _ in range(150):
        sim.step()
        highest = max(highest, sim.bodies["cork"].position[1])
    assert sim.bodies["iron"].position[1] == pytest.approx(0.08, abs=0.01)
    assert np.linalg.norm(sim.bodies["iron"].velocity) < 0.02
    assert highest < 0.8
    assert 0.35 < sim.bodies["cork"].position[1] < 0.65


def test_a_world_with_bodies_goes_on_to_the_same_bits(tmp_path):
    """From a file, as a copy, and after going back."""
    sim = pool(
        wt.Box(name="box", center=(0.4, 0.55, 0.4), size=(0.2, 0.2, 0.2), density=400, rotation=(0.9, 0.2, 0.1, 0.3)),
        wt.Sphere(name="ball", center=(0.7, 0.6, 0.7), radius=0.1, density=700),
        spacing=0.05,
    )
    for _ in range(25):
        sim.step()
    sim.save(tmp_path / "state.npz")
    others = [wt.Simulation.restore(tmp_path / "state.npz"), sim.clone()]
    instant = sim.snapshot()
    for world in (sim, *others):
        for _ in range(20):
            world.step()
    assert {world.digest() for world in others} == {sim.digest()}
    end = sim.digest()
    sim.resume(instant)
    for _ in range(20):
        sim.step()
    assert sim.digest() == end


def test_a_state_without_what_came_later_is_read(tmp_path):
    """States that were saved before bodies yielded within a step have a row less of each."""
    sim = pool(wt.Box(name="box", center=(0.4, 0.55, 0.4), size=(0.2, 0.2, 0.2), density=400), spacing=0.08)
    sim.step()
    sim.save(tmp_path / "state.npz")
    with np.load(tmp_path / "state.npz") as file:
        parts = dict(file)
    parts["bodies_memory"] = np.delete(parts["bodies_memory"], len(coupling.ROWS) - 1, axis=1)
    np.savez(tmp_path / "older.npz", **state_file.sealed(parts))
    older = wt.Simulation.restore(tmp_path / "older.npz")
    older.step()
    assert older.bodies["box"].position[1] == pytest.approx(sim.bodies["box"].position[1], abs=0.01)


def test_bodies_are_held_moved_and_let_go():
    """A body that is moved is as unyielding as any solid; let go, it falls."""
    sim = pool(wt.Box(name="box", center=(0.48, 0.7, 0.48), size=(0.2, 0.2, 0.2), density=500, held=True))
    for _ in range(10):
        sim.step()
    assert sim.bodies["box"].position.tolist() == pytest.approx([0.48, 0.7, 0.48], abs=1e-6)
    sim.move("box", position=(0.48, 0.72, 0.48))
    sim.step()
    assert sim.bodies["box"].position[1] == pytest.approx(0.72, abs=1e-6)
    sim.hold("box", False)
    for _ in range(10):
        sim.step()
    assert sim.bodies["box"].velocity[1] < 0.0
    sim.bodies["box"].velocity = (0.0, 3.0, 0.0)
    sim.step()
    assert sim.bodies["box"].velocity[1] > 2.0
    with pytest.raises(WavetankError, match="velocity = .* of body 'box' must be 3 finite numbers"):
        sim.bodies["box"].velocity = (0.0, np.nan, 0.0)
    assert "box" in sim.bodies
    assert "bow" not in sim.bodies
    with pytest.raises(WavetankError, match="no body named 'bow'; bodies: box"):
        _ = sim.bodies["bow"]


def test_a_body_that_was_held_owes_nothing_when_it_is_let_go():
    """What held it took its momentum: the first step gives what water and gravity give in that step (Newton)."""
    box = wt.Box(name="box", center=(1.0, 0.44), size=(0.4, 0.2), density=500, held=True)
    block = wt.Block(lower=(0, 0), upper=(2.0, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=0.02, tank=wt.Tank(size=(2.0, 0.8)), fluids=[block], solids=[box]))
    sim.advance(0.5)
    sim.hold("box", False)
    sim.step()
    assert sim.time_steps == 1
    body = sim.bodies["box"]
    got = body.mass * body.velocity + body.pending_impulse[:2]
    given = (body.force + body.mass * np.array(sim.gravity)) * sim.scene.frame_time
    assert got == pytest.approx(given, abs=1e-6)


def test_a_tank_without_gravity_has_bodies():
    """Where nothing is deep."""
    sim = pool(wt.Sphere(name="ball", center=(0.48, 0.4, 0.48), radius=0.1, density=500), gravity=(0, 0, 0))
    sim.advance(0.1)
    assert np.linalg.norm(sim.bodies["ball"].velocity) < 0.1
    assert sim.bodies["ball"].immersed == 0.0


def test_a_fast_body_begins_as_fast_as_it_is_said_to():
    """The water's speed limit, that of a fall through the tank, is not a body's: 4.2 m/s here."""
    sim = pool(wt.Sphere(name="shot", center=(0.48, 0.8, 0.48), radius=0.06, density=8000, velocity=(0, -12, 0)))
    sim.step()
    assert sim.bodies["shot"].velocity[1] == pytest.approx(-12.0 - 9.81 / 60, rel=1e-3)


def test_bodies_come_and_go():
    """Another one is added while the first floats, and the first is taken away."""
    sim = pool(wt.Box(name="box", center=(0.3, 0.45, 0.3), size=(0.16, 0.16, 0.16), density=500))
    sim.step()
    sim.add_solid(wt.Sphere(name="ball", center=(0.7, 0.7, 0.7), radius=0.1, density=700))
    for _ in range(6):
        sim.step()
    assert list(sim.bodies) == ["box", "ball"]
    assert sim.bodies["ball"].velocity[1] == pytest.approx(-9.81 * 6 / 60, rel=0.05)
    sim.remove_solid("box")
    sim.step()
    assert list(sim.bodies) == ["ball"]


def test_joints_hold():
    """A pendulum's rope keeps its length, a hinge its place, a motor its speed, a slider its line."""
    tank = wt.Tank(size=(2.0, 2.0, 2.0))
    sim = wt.Simulation(
        wt.Scene(
            spacing=0.1,
            tank=tank,
            fluids=[wt.Block(lower=(0, 0, 0), upper=(2, 0.2, 2))],
            solids=[
                wt.Sphere(name="bob", center=(1.5, 1.5, 1.0), radius=0.1, density=3000),
                wt.Box(name="wheel", center=(0.5, 1.2, 0.5), size=(0.6, 0.1, 0.2), density=500),
                wt.Box(name="gate", center=(1.0, 1.4, 0.3), size=(0.2, 0.2, 0.1), density=500),
            ],
            joints=[
                wt.Rope(first="bob", at=(1.5, 1.5, 1.0), to=(1.0, 1.5, 1.0)),
                wt.Hinge(first="wheel", at=(0.5, 1.2, 0.5), axis=(0, 0, 1), speed=2.0),
                wt.Slider(first="gate", at=(1.0, 1.4, 0.3), axis=(0, 1, 0), limits=(-0.3, 0.0)),
            ],
        )
    )
    lengths, lowest = [], 2.0
    for _ in range(60):
        sim.step()
        lengths.append(float(np.linalg.norm(sim.bodies["bob"].position - (1.0, 1.5, 1.0))))
        lowest = min(lowest, sim.bodies["bob"].position[1])
    assert max(lengths) < 0.51
    assert lowest < 1.05
    assert sim.bodies["wheel"].position.tolist() == pytest.approx([0.5, 1.2, 0.5], abs=2e-3)
    assert sim.bodies["wheel"].angular_velocity[2] == pytest.approx(2.0, rel=0.02)
    assert sim.bodies["gate"].position.tolist() == pytest.approx([1.0, 1.1, 0.3], abs=0.01)


@pytest.mark.parametrize(
    ("solids", "joints", "what"),
    [
        ([{"center": (0.5, 0.5, 0.5), "size": (0.1,) * 3, "density": 1, "mass": 1}], [], "density or a mass, not both"),
        ([{"center": (0.5, 0.5, 0.5), "size": (0.1,) * 3, "held": True}], [], "held is for bodies"),
        ([{"center": (0.5, 0.5, 0.5), "size": (0.1,) * 3, "mass": 0}], [], "mass = 0"),
        ([], [{"kind": "hinge", "first": "door", "at": (0, 0, 0)}], "joints\\[0\\].first = 'door' is not a solid"),
        (
            [{"name": "a", "center": (0.5, 0.5, 0.5), "size": (0.1,) * 3}],
            [{"kind": "weld", "first": "a", "at": (0, 0, 0)}],
            "neither of them a body",
        ),
        (
            [{"name": "a", "center": (0.5, 0.5, 0.5), "size": (0.1,) * 3, "mass": 1}],
            [{"kind": "slider", "first": "a", "at": (0, 0, 0), "axis": (0, 0, 0)}],
            "has no direction",
        ),
    ],
)
def test_what_is_no_body_and_no_joint_is_said(solids, joints, what):
    """One sentence: what, where, what is allowed."""
    with pytest.raises(WavetankError, match=what) as said:
        wt.Scene.parse({"spacing": 0.05, "tank": {"size": (1, 1, 1)}, "solids": solids, "joints": joints})
    assert "\n" not in str(said.value)


def test_a_body_falls_as_gravity_does_that_changes():
    """Of its own motion, in the air, v = the integral of g."""
    scene = wt.Scene(
        spacing=0.05,
        gravity=("4*sin(pi*t)", 0, 0),
        tank=wt.Tank(size=(4, 4, 4)),
        fluids=[wt.Block(lower=(0, 0, 0), upper=(0.2, 0.1, 0.2))],
        solids=[wt.Sphere(name="ball", center=(1, 2, 2), radius=0.1, density=500)],
    )
    sim = wt.Simulation(scene)
    sim.advance(1.0)
    assert sim.bodies["ball"].velocity == pytest.approx([8 / np.pi, 0, 0], rel=0.01)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_cup_rests_on_the_walls_of_the_tank(dim):
    """A cup, which is a difference, slides down a wall to the floor, in a tilted gravity, or to what it caught."""
    outer, inner = (0.3, 0.3, 0.3)[:dim], (0.2, 0.3, 0.2)[:dim]
    cup = wt.Difference(
        name="cup",
        center=(0.4, 0.5, 0.5)[:dim],
        density=3000.0,
        friction=0.0,
        parts=[wt.Box(center=(0, 0, 0)[:dim], size=outer), wt.Box(center=(0, 0.1, 0)[:dim], size=inner)],
    )
    sim = wt.Simulation(
        wt.Scene(
            spacing=0.05,
            tank=wt.Tank(size=(1.0, 1.0, 1.0)[:dim]),
            solids=[cup],
            gravity=(-3.0, -9.0, 0.0)[:dim],
            fluids=[wt.Block(lower=(0.7, 0, 0)[:dim], upper=(1.0, 0.1, 1.0)[:dim])],
        )
    )
    sim.advance(2.0)
    assert sim.bodies["cup"].position[:2].tolist() == pytest.approx([0.15, 0.15], abs=0.05)
    assert np.linalg.norm(sim.bodies["cup"].velocity) < 0.15


def test_friction_does_not_turn_small_bodies_back_and_forth():
    """A body and the water at it slide together at one speed at most: the water within reach is the heavier.

    From step to step torques change by 0.01 of weight times reach, mean of fourteen starts and four boxes; in every
    third start one of these is at 0.06 to 0.14. It was 0.27 where all slip is taken.
    """
    changes = []
    for aside in (0.0, 0.001, 0.002):  # places away from each other and walls
        places = [(0.2 + 0.4 * (k % 2) + aside, 0.32, 0.2 + 0.4 * (k // 2)) for k in range(4)]
        boxes = [
            wt.Box(center=place, size=(0.14, 0.11, 0.15), density=density, rotation=(1.0, 0.1 * k, 0.0, 0.2))
            for k, (place, density) in enumerate(zip(places, (300.0, 500.0, 700.0, 500.0), strict=True))
        ]
        block = wt.Block(lower=(0, 0, 0), upper=(0.8, 0.32, 0.8))
        sim = wt.Simulation(wt.Scene(spacing=0.04, tank=wt.Tank(size=(0.8, 0.8, 0.8)), fluids=[block], solids=boxes))
        torques = []
        for frame in range(180):
            sim.step()
            if frame >= 150:
                bodies = sim.bodies.values()
                torques.append([body.torque / (9.81 * body.mass * body.solid.reach()) for body in bodies])
        changes.append(np.linalg.norm(np.diff(torques, axis=0), axis=-1))
    found = np.sqrt(np.mean(np.square(changes), axis=1))
    assert found.mean() < 0.03 and found.max() < 0.2


def test_a_heavy_box_comes_down_on_the_floor_of_a_plane_and_is_not_thrown_up_again():
    """It weighs a fifth of the water's push more than that: what is caught below it must not throw it."""
    box = wt.Box(name="box", center=(0.4, 0.25), size=(0.3, 0.2), density=1200)
    block = wt.Block(lower=(0, 0), upper=(0.8, 0.4))
    scene = wt.Scene(spacing=0.02, tank=wt.Tank(size=(0.8, 0.8)), fluids=[block], solids=[box], foam=0.0)
    sim, fastest = wt.Simulation(scene), 0.0
    for _ in range(300):
        sim.step()
        fastest = max(fastest, float(np.linalg.norm(sim.bodies["box"].velocity)))
    assert fastest < 1.0
    assert sim.bodies["box"].position[1] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("ratio", [1.1, 1.3, 2.0])
@pytest.mark.parametrize("on", ["floor", "block"])
def test_what_sinks_lies_on_the_ground_and_rests(ratio, on):
    """It squeezes out the layer of water that it comes down on, 0.6 d thick, which held it up and shook it.

    The layer takes up to 6 s to give way, with a box a tenth heavier than water.
    """
    ground, solids = (0.0, []) if on == "floor" else (0.1, [wt.Box(center=(0.48, 0.05, 0.48), size=(0.6, 0.1, 0.6))])
    sim = pool(
        wt.Box(name="box", center=(0.48, ground + 0.16, 0.48), size=(0.32, 0.2, 0.32), density=1000.0 * ratio), *solids
    )
    box, speeds = sim.bodies["box"], []
    for frame in range(480):
        sim.step()
        if frame >= 420:
            speeds.append(np.linalg.norm(box.velocity))
    assert abs(box.position[1] - 0.1 - ground) < 0.1 * D
    assert np.sqrt(np.mean(np.square(speeds))) < 0.005


def kept_in_a_gap(center, fixed, is_in_gap):
    """Share of a slow stream, 0.02 m/s along a gap a spacing wide between a held and a fixed box, that is left."""
    sim = pool(wt.Box(name="box", center=center, size=(0.24, 0.24, 0.4), density=500.0, held=True), fixed)
    sim.advance(1.0)
    x = sim.positions
    inside = is_in_gap(x) & (abs(x[:, 2] - 0.5 * WIDE) < 0.16)
    assert np.count_nonzero(inside) > 10
    velocities = np.zeros_like(x)
    velocities[inside, 2] = 0.02
    sim.velocities = velocities
    sim.step()
    sim.step()
    return sim.velocities[inside, 2].mean() / 0.02


def test_slow_water_rests_between_upright_sides():
    """Static friction beside a body and a wall; that what lies below a body leaves is asked where one sinks.

    The wall is three cells thick. Beside one of a cell and a half water is thrown, and what is left of it is chance.
    """
    wall = wt.Box(name="wall", center=(0.12, 0.2, 0.5 * WIDE), size=(0.24, 0.4, WIDE))
    beside = kept_in_a_gap((0.40, 0.2, 0.5 * WIDE), wall, lambda x: (x[:, 0] < 0.28) & (abs(x[:, 1] - 0.2) < 0.1))
    assert beside < 0.5


def test_slow_water_rests_between_two_bodies_that_rest():
    """A gap between two hulls has a mode of its own, in which water goes up and down; their edges damp it."""
    other = wt.Box(name="other", center=(0.12, 0.2, 0.5 * WIDE), size=(0.24, 0.24, 0.4), density=500.0, held=True)
    beside = kept_in_a_gap((0.40, 0.2, 0.5 * WIDE), other, lambda x: (x[:, 0] < 0.28) & (abs(x[:, 1] - 0.2) < 0.1))
    assert beside < 0.5


@pytest.mark.parametrize("gap", [0.8, 1.0])
def test_water_between_a_wall_and_the_side_of_a_body_rests(gap):
    """Less than half a cell that stands upright is no slit: without room there, water was thrown at 1.5 m/s."""
    side = wt.Box(
        name="box", center=(0.12 + gap * D, 0.2, 0.5 * WIDE), size=(0.24, 0.24, 0.4), density=500.0, held=True
    )
    sim = pool(side)
    sim.advance(1.0)
    fastest = 0.0
    for _ in range(60):
        sim.step()
        fastest = max(fastest, float(np.linalg.norm(sim.velocities, axis=1).max()))
    assert fastest < 0.05


@pytest.mark.parametrize("dim", [2, 3])
def test_dry_bodies_slide_no_farther_than_coulomb_says(dim):
    """v^2 / (2 mu g) at mu = 0.5, which is that of solids that name none; in 2-D they went on for ever."""
    box = wt.Box(name="box", center=(0.3, 0.1, 0.5)[:dim], size=(0.2,) * dim, density=2000.0, velocity=(1, 0, 0)[:dim])
    block = wt.Block(lower=(2.8, 0.0, 0.0)[:dim], upper=(3.0, 0.1, 1.0)[:dim])
    tank = wt.Tank(size=(3.0, 1.0, 1.0)[:dim])
    sim = wt.Simulation(wt.Scene(spacing=0.05, tank=tank, fluids=[block], solids=[box], foam=0.0))
    sim.advance(0.4)
    assert sim.bodies["box"].position[0] - 0.3 == pytest.approx(1.0 / 9.81, abs=0.015)
    assert np.linalg.norm(sim.bodies["box"].velocity) < 0.02


def test_bodies_of_a_plane_stay_in_it():
    """Contacts between capsules turned them out of it: one went 8 m away in as many seconds."""
    places = [(0.2 + 0.15 * (k % 5), 0.3 + 0.2 * (k // 5)) for k in range(10)]
    solids = [
        wt.Capsule(start=(x - 0.05, y), end=(x + 0.05, y + 0.02), radius=0.03, density=300.0 + 150.0 * k)
        if k % 2
        else wt.Box(center=(x, y), size=(0.1, 0.08), density=1500.0 - 150.0 * k, rotation=0.1 * k)
        for k, (x, y) in enumerate(places)
    ]
    block = wt.Block(lower=(0, 0), upper=(1.0, 0.2))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=wt.Tank(size=(1.0, 1.2)), fluids=[block], solids=solids))
    sim.advance(1.5)
    for body in sim.bodies.values():
        assert body.rigid().translation.z == 0.0
        assert body.rotation[1:3].tolist() == [0.0, 0.0]
        assert body.angular_velocity[:2].tolist() == [0.0, 0.0]


def in_a_plane(draft, spacing, ratio=0.5, held=True):
    """A box 0.2 m wide in a plane pool 0.4 m deep."""
    tall = draft / ratio if draft else 0.1
    box = wt.Box(name="box", center=(0.4, 0.4 - draft + 0.5 * tall), size=(0.2, tall), density=1000 * ratio, held=held)
    block = wt.Block(lower=(0, 0), upper=(0.8, 0.4))
    scene = wt.Scene(spacing=spacing, tank=wt.Tank(size=(0.8, 0.8)), fluids=[block], solids=[box])
    return wt.Simulation(scene)


@pytest.mark.parametrize("substeps", [1, 4])
def test_water_at_rest_bears_what_a_held_body_displaces(substeps):
    """Archimedes, whatever the time step: the grid has the water lower by what it falls in a step, 1.4 mm at 1/60 s."""
    sim = in_a_plane(0.1, 0.01)
    sim.substeps = substeps
    sim.advance(1.0)
    forces = []
    for _ in range(30):
        sim.step()
        forces.append(sim.bodies["box"].force[1])
    displaced = 1000 * 9.81 * 0.2 * (level(sim, 0.2 * 0.1) - 0.3)
    assert np.mean(forces) == pytest.approx(displaced, rel=0.005)


def test_a_bottom_that_touches_the_surface_is_hardly_pressed():
    """A quarter of a cell deep it was, half a spacing, because no pressure is continued above the surface."""
    sim = in_a_plane(0.0, 0.02)
    sim.advance(1.0)
    depth = sim.bodies["box"].force[1] / (1000 * 9.81 * 0.2)
    assert 0.0 <= depth < 0.3 * 0.02


def test_a_body_of_waters_density_stays_where_gaps_surround_it():
    """The lattice is cut by the box: gaps closed in a jolt that it glided on from, by 1.9 d."""
    spacing = 0.2 / 7.3
    box = wt.Box(name="box", center=(0.4, 0.2), size=(0.3, 0.2), density=1000)
    block = wt.Block(lower=(0, 0), upper=(0.8, 0.4))
    sim = wt.Simulation(wt.Scene(spacing=spacing, tank=wt.Tank(size=(0.8, 0.8)), fluids=[block], solids=[box]))
    for _ in range(300):
        sim.step()
        assert np.abs(sim.bodies["box"].position - (0.4, 0.2)).max() < 0.6 * spacing


def test_the_start_moves_no_water_that_does_not_stand():
    """What falls freely is where the scene put it, and a dam's front, two rows of which once stuck out by 0.8 d."""
    drop = wt.Block(lower=(0.6, 0.5), upper=(0.7, 0.6), velocity=(0.3, -0.4))
    dam = wt.Block(lower=(0, 0), upper=(0.3, 0.3))
    ball = wt.Sphere(name="ball", center=(0.8, 0.1), radius=0.08, density=700, velocity=(0.5, 0.0))
    scene = wt.Scene(spacing=0.02, tank=wt.Tank(size=(1.0, 0.8)), fluids=[dam, drop], solids=[ball])
    x, v = scene.particles()
    sim = wt.Simulation(scene)
    falls = x[:, 0] > 0.5
    assert sim.time == 0.0
    assert np.array_equal(sim.velocities, v.astype(np.float32))
    assert np.abs(sim.positions - x)[falls].max() < 1e-6
    way = np.linalg.norm(sim.positions - x, axis=1)[~falls] / 0.02
    assert way[x[~falls, 0] > 0.25].max() < 0.05 and way.max() < 0.5
    assert sim.bodies["ball"].velocity == pytest.approx([0.5, 0.0])


@pytest.mark.parametrize(
    "solid",
    [
        wt.Sphere(name="body", center=(0.4, 0.2, 0.4), radius=0.12, density=1000),
        wt.Capsule(name="body", start=(0.3, 0.2, 0.4), end=(0.5, 0.2, 0.4), radius=0.09, density=1000),
    ],
    ids=["sphere", "capsule"],
)
def test_what_is_round_and_as_dense_as_water_weighs_what_it_displaces(solid):
    """Archimedes: pieces that a coarse lattice cuts from a ball were 1.4 % larger together, and it rose by 1.5 d."""
    block = wt.Block(lower=(0, 0, 0), upper=(0.8, 0.4, 0.8))
    scene = wt.Scene(spacing=0.04, tank=wt.Tank(size=(0.8, 0.8, 0.8)), fluids=[block], solids=[solid])
    sim, way = wt.Simulation(scene), 0.0
    start = sim.bodies["body"].position
    for _ in range(180):
        sim.step()
        way = max(way, float(np.abs(sim.bodies["body"].position - start).max()))
    assert way < 0.2 * 0.04
