"""Water and meshes: nothing gets through, everything is kept and comes back."""

import numpy as np
import pytest
from surfaces import CUBE, ball, cup

import wavetank as wt
from wavetank.session.commands import AddSolid, MoveSolid
from wavetank.session.recording import Recording, replay
from wavetank.session.session import Session
from wavetank.simulation.simulation import Simulation


def outside_of_cup(local, radius, height):
    return (np.hypot(local[:, 0], local[:, 2]) > radius) | (np.abs(local[:, 1]) > 0.5 * height)


@pytest.mark.parametrize("wall, carried", [(0.02, True), (0.002, False)])
def test_a_cup_holds_its_water(wall, carried):
    """Walls of one spacing, carried in circles at 0.4 m/s, and walls of a tenth of it: all water stays inside."""
    d, radius, height = 0.02, 0.12, 0.24
    solid = wt.Mesh.of(*cup(radius, height, wall), name="cup", center=(0.3, 0.3, 0.3), size=(0.24, 0.24, 0.24))
    water = wt.Block(lower=(0.22, 0.2, 0.22), upper=(0.38, 0.3, 0.38))
    sim = Simulation(wt.Scene(spacing=d, tank=wt.Tank(size=(0.6, 0.6, 0.6)), solids=[solid], fluids=[water]))
    center, filled = np.array([0.3, 0.3, 0.3]), sim.count
    for k in range(150):
        if carried:
            turn = 0.08 * k * min(k, 60) / 60
            center = np.array([0.3 + 0.08 * np.sin(turn), 0.3, 0.22 + 0.08 * np.cos(turn)])
            sim.move("cup", position=center)
        sim.step()
    out = outside_of_cup(sim.positions - center, radius + 0.5 * d, height)
    # Corners of the block lie in the thick wall: 2.8 % of it, by the area of a square without a circle.
    assert sim.count == filled == (311 if wall == d else 320)
    assert not out.any()


@pytest.mark.parametrize("speed", [5.0, 50.0, 500.0])
def test_nothing_is_shot_through_a_thin_wall(speed):
    """Particles at up to two thousand spacings a second against a hollow ball with a wall of a fifth of a spacing."""
    d = 0.05
    vertices, faces = ball()
    shell = [*vertices, *(0.96 * vertices)], [*faces, *(faces[:, ::-1] + len(vertices))]
    rng = np.random.default_rng(0)
    x = rng.uniform(0.05, 0.95, (2000, 3))
    r = np.linalg.norm(x - 0.5, axis=1)
    x = x[(r < 0.2) | (r > 0.32)][:400]
    v = rng.normal(size=x.shape)
    v *= speed / np.linalg.norm(v, axis=1, keepdims=True)
    solid = wt.Mesh.of(*shell, center=(0.5, 0.5, 0.5), size=0.5)
    scene = wt.Scene(
        spacing=d, tank=wt.Tank(size=(1, 1, 1)), solids=[solid], fluids=[wt.Points(positions=x, velocities=v)]
    )
    sim = Simulation(scene)
    within = np.linalg.norm(sim.positions - 0.5, axis=1) < 0.25
    assert 20 < within.sum() < len(x) - 20
    for _ in range(30):
        sim.step()
        np.testing.assert_array_equal(np.linalg.norm(sim.positions - 0.5, axis=1) < 0.25, within)


def test_a_mesh_is_a_wall_like_any_other():
    """The density that a box adds, as a mesh and as a shape."""
    d, center, size = 0.05, (0.2, 0.05, 0.2), (0.5, 0.3, 0.5)
    scenes = [
        wt.Scene(
            spacing=d,
            tank=wt.Tank(size=(0.4, 0.8, 0.4)),
            solids=[solid],
            fluids=[wt.Block(lower=(0, 0.2, 0), upper=(0.4, 0.5, 0.4))],
        )
        for solid in (wt.Box(center=center, size=size), wt.Mesh.of(*CUBE, center=center, size=size))
    ]
    boxed, meshed = (Simulation(scene).densities for scene in scenes)
    np.testing.assert_allclose(meshed, boxed, rtol=1e-3)


SCENE = wt.Scene(
    spacing=0.04,
    tank=wt.Tank(size=(0.8, 0.6, 0.5)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(0.3, 0.4, 0.5))],
    solids=[wt.Mesh.of(*ball(16), name="ball", center=(0.5, 0.2, 0.25), size=0.3)],
)


def test_a_saved_state_goes_on_the_same(tmp_path):
    sim = Simulation(SCENE)
    sim.advance(0.1)
    sim.save(tmp_path / "state.npz")
    again = Simulation.restore(tmp_path / "state.npz")
    for world in (sim, again):
        world.move("ball", position=(0.45, 0.2, 0.25))
        world.advance(0.1)
    np.testing.assert_array_equal(again.positions, sim.positions)


def test_a_recorded_session_comes_back(tmp_path):
    """With a mesh of its scene, one that was added, and one that was carried."""
    session = Session(SCENE)
    added = wt.Mesh.of(*CUBE, name="crate", center=(0.7, 0.5, 0.25), size=0.1)
    for tick in range(12):
        if tick == 3:
            session.apply(AddSolid(solid=added))
            session.apply(AddSolid(solid=wt.Mesh(path="wavetank/knot.obj", center=(0.1, 0.5, 0.3), size=0.15)))
        if tick == 5:
            session.apply(MoveSolid(name="ball", position=(0.4, 0.25, 0.25)))
        session.tick()
    Recording.of(session, SCENE).save(tmp_path / "session.toml")
    for again in replay(Recording.load(tmp_path / "session.toml")):
        pass
    assert again.sim.digest() == session.sim.digest()
    assert [solid.path for solid in again.sim.scene.solids] == ["", "", "wavetank/knot.obj"]


def test_a_session_goes_back_in_time():
    session = Session(SCENE)
    for _ in range(4):
        session.tick()
    before, kept = session.sim.snapshot(), session.sim.positions
    session.sim.add_solid(wt.Mesh.of(*CUBE, center=(0.7, 0.5, 0.25), size=0.1))
    session.tick()
    session.restore(before)
    np.testing.assert_array_equal(session.sim.positions, kept)
    assert len(session.sim.scene.solids) == 1
    assert wt.Scene.from_text(session.current_scene().text()).solids[0].data == SCENE.solids[0].data


def test_a_cup_of_faces_is_shaken_and_keeps_its_water():
    """Walls a spacing thick, four seconds at up to half of gravity: every particle is in the cup, none in its wall."""
    from wavetank.solids.sampling import nearest_distances

    d, place = 0.012, np.array([0.0, 0.2, 0.0])
    mesh = wt.Mesh.of(*cup(0.08, 0.2, d), center=tuple(place), size=0.2, name="cup")
    scene = wt.Scene(
        spacing=d,
        tank=wt.Tank(size=(0.5, 0.5, 0.4), lower=(-0.25, 0, -0.2)),
        solids=[mesh],
        fluids=[wt.Filled(inside=wt.Cylinder(start=(0, 0.113, 0), end=(0, 0.19, 0), radius=0.067))],
    )
    sim = Simulation(scene)
    for frame in range(240):
        t = frame / 60.0
        way = min(t, 1.0) * np.array([0.03 * np.sin(9.4 * t), 0.01 * np.sin(4.4 * t), 0.02 * np.sin(5.7 * t)])
        sim.move("cup", position=tuple(place + way))
        sim.step()
    x = sim.positions - (place + way)
    assert np.all((np.hypot(x[:, 0], x[:, 2]) < 0.068) & (x[:, 1] > -0.1 + d))
    moved = mesh.model_copy(update={"center": tuple(place + way)})
    assert nearest_distances([moved], sim.positions, d).min() > 0.0
