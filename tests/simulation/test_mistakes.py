"""Mistakes in a script, by kind: each is one sentence that says what is allowed, none is raw, none is accepted."""

import copy
import dataclasses
import inspect
import pickle

import numpy as np
import pytest

import wavetank as wt
from wavetank.view.style import Style

MISTAKES = {
    "arrays that are copies": """
        S.velocities[:, 1] = 7
        S.positions[0] = (0.1, 0.1)
        S.positions[:, 1] += 0.1
        S.densities[:] = 3
        S.bodies["b"].velocity[1] = 3
        S.bodies["b"].position[0] = 0.5
        S.bodies["b"].rotation[0] = 0.5
        F.positions[0] = 1
        F.state().positions[0] = 1
        S.snapshot().positions[0] = 1
    """,
    "attributes": """
        S.densities = 3
        S.count = 3
        S.time = 0
        S.time += 1
        S.foo = 3
        S.viscos = 1
        S.viscosity = "thick"
        S.viscosity = -1
        S.viscosity = None
        S.viscosity = np.nan
        S.viscosity = True
        S.gravity = 9.81
        S.gravity = (0, 0, -9.81)
        S.gravity = "down"
        S.spacing = 0.1
        S.bodies["b"].velocty = (1, 0)
        S.bodies["b"].velocity = 3
        S.bodies["b"].velocity = (1,2,3)
        S.bodies["b"].velocity = "fast"
        S.bodies["b"].position = (0.5, 0.5)
        S.bodies["b"].mass = 3
        S.bodies["b"].angular_velocity = (1, 2, 3, 4)
        S.bodies = {}
        S.joints["h"].sped = 3
        S.joints["h"].speed = "fast"
        S.joints["h"].target = None
        S.solids["w"].positon = (1,1)
        S.solids["w"].position = (1,1)
        S.sources["tap"].rat = 3
        S.sources["tap"].rate = "x"
        S.sources["tap"].rate = -1
        S.parameters.foo = 3
        S.parameters.viscosity = "x"
        S.positions = 3
        S.positions = "x"
        S.positions = np.zeros((1, 2))
        S.positions = np.full((S.count, 2), 5.0)
        S.positions = np.full((S.count, 2), np.nan)
        S.velocities = None
    """,
    "arguments of a world": """
        S.bodies["c"]
        S.joints["x"]
        S.solids["nope"]
        S.sources["nope"]
        S.move("w", (0.1, 0.1, 0.1))
        S.move("w", "left")
        S.move("w", [1e300, 1e300])
        S.move("zz", (0.1, 0.1))
        S.move(3, (0.1, 0.1))
        S.move("w", rotation="quarter")
        S.move("w", rotation=(0,0,0,0))
        S.hold("w")
        S.hold("zz")
        S.release("zz")
        S.release("w")
        S.add([[5.0, 5.0]])
        S.add([[-0.5, 0.5]])
        S.add([0.5, 0.5])
        S.add([[0.5, 0.5, 0.5]])
        S.add("here")
        S.add([[0.5, 0.5]], velocities=[[1, 1], [1, 1]])
        S.add([[0.5, 0.5]], velocities="x")
        S.add([[0.5, np.nan]])
        S.add([[0.5, 0.5]], materials=[9])
        S.add([[0.5, 0.5]], materials=["oil"])
        S.add([[0.5, 0.5]], dyes="red")
        S.add([[0.5, 0.5]], dyes=[1, 2])
        S.add(None)
        S.add([[0.5, 0.5], [0.5]])
        S.remove("x")
        S.remove([1.5])
        S.remove(None)
        S.remove_inside((0, 0), (1, 1), "x")
        S.remove_inside((0, 0), (1, 1), -1)
        S.paint_inside((0, 0), (1, 1), 0.1, "red")
        S.freeze_inside((0, 0), (1, 1), None)
        S.free_places([[0, 0, 0]], 0.1, 0.1)
        S.free_places("x", 0.1, 0.1)
        S.advance("1")
        S.advance(None)
        S.advance(-1)
        S.advance(np.inf)
        S.advance([1])
        S.advance(True)
        list(S.frames("x"))
        list(S.frames(1, fps=0))
        list(S.frames(-1))
        list(S.frames(1, fps="x"))
        S.push(3)
        S.push("wind")
        S.forces.append(3); S.step()
        S.terms.append(3); S.step()
        S.add_solid(3)
        S.add_solid("box")
        S.add_solid(wt.Box(center=(0,0,0), size=(1,1,1)))
        S.remove_solid("zz")
        S.remove_solid(3)
        S.resume(3)
        S.resume(None)
        S.save("/nope/dir/x.npz")
        S.save(3)
        S.save("")
        S.save(None)
        pickle.dumps(S)
    """,
    "scenes": """
        scene(spacing=-1)
        scene(spacing="x")
        scene(spacing=None)
        scene(spacing=0)
        scene(foo=3)
        scene(tank=(1, 1, 1))
        scene(tank=3)
        scene(tank="big")
        scene(fluids=wt.Block(lower=(0,0,0),upper=(1,1,1)))
        scene(fluids=[3])
        scene(fluids=["block"])
        scene(fluids=None)
        scene(solids=[3])
        scene(solids=wt.Box(center=(0,0,0),size=(1,1,1)))
        scene(solids=[wt.Block(lower=(0,0,0),upper=(1,1,1))])
        scene(fluids=[wt.Box(center=(0,0,0),size=(1,1,1))])
        scene(gravity=(0,-1))
        scene(gravity="x")
        scene(gravity=[0, "a", 0])
        scene(solids=[wt.Box(center=(0,0),size=(1,1))])
        scene(emitters=[3])
        scene(joints=[3])
        scene(materials=[3])
        scene(materials=["oil"])
        scene(forces=[3])
        scene(goal=3)
        scene(light="sun")
        wt.Scene()
        wt.Scene(3)
        wt.Scene("dam-break")
        wt.Scene({"spacing": 0.1})
        wt.Simulation(3)
        wt.Simulation("dam-break-2d").nothing
        wt.Simulation(scene)
        wt.Simulation(scene(), arch="tpu")
        wt.Simulation(scene(), arch=3)
        wt.Simulation(scene(), arch=None)
        wt.Simulation(scene(), "cpu", 3)
        wt.Simulation(scene(), terms=[3])
        scene().save("/nope/x.toml")
        scene().save(3)
        scene().save(None)
    """,
    "scenes that are changed": """
        s = scene(); s.spacing = -1
        s = scene(); s.spacing = "x"
        s = scene(); s.foo = 1
        s = scene(); s.spacng = 1
        s = scene(); s.tank = 3
        s = scene(); s.tank = wt.Tank(size=(1,1))
        s = scene(); s.fluids = 3
        s = scene(); s.gravity = (0, 1)
        s = scene(); s.tank.size = (-1, 1, 1)
        s = scene(); s.tank.siz = 1
        s = scene(); s.fluids[0].lower = (2, 2, 2)
        s = scene(); s.fluids[0].lowr = 1
        s = scene(); s.fluids[0].upper = (2, 2, 2); wt.Simulation(s)
        s = scene(); s.solids.append(wt.Box(center=(0,0),size=(1,1))); wt.Simulation(s)
        s = scene(); s.solids.append(3); wt.Simulation(s)
        s = scene(); s.solids.append("box"); wt.Simulation(s)
        s = scene(); s.solids.append({"shape": "box"}); wt.Simulation(s)
        s = scene(); s.fluids.append(wt.Block(lower=(0,0,0),upper=(3,3,3))); wt.Simulation(s)
        s = scene(); s.fluids.append(wt.Block(lower=(0,0),upper=(0.3,0.3))); wt.Simulation(s)
        s = scene(); s.solids.append(3); s.text()
        s = scene(); s.solids.append(3); s.changed(foam=1)
        s = scene(); s.solids.append(3); s.scaled(2)
        s = scene(); s.solids.append(3); wt.Session(s)
        s = scene(); s.tank = wt.Tank(size=(1,1)); wt.Simulation(s)
        s = scene(); s.changed(spacing=-1)
        s = scene(); s.changed(foo=-1)
        s = scene(); s.scaled("x")
        s = scene(); s.scaled(0)
        s = scene(); s.scaled(None)
    """,
    "models": """
        wt.Block((0,0),(1,1))
        wt.Block()
        wt.Block(lower=(0,0), upper=(1,1,1))
        wt.Block(lower=0, upper=1)
        wt.Block(lower=(0,0,0), uper=(1,1,1))
        wt.Block(lower=(1,1), upper=(0,0))
        wt.Tank((1,1,1))
        wt.Tank(size=1)
        wt.Tank(size=(1,))
        wt.Tank(size=(1,1,1,1))
        wt.Tank(size=(1,-1))
        wt.Tank(size=(1,1), open=["up"])
        wt.Tank(size=(1,1), open="top").nothing
        wt.Tank(size="big")
        wt.Box((0,0),(1,1))
        wt.Box(center=(0,0))
        wt.Box(center=(0,0),size=(0,1))
        wt.Box(center=(0,0),size=(1,1),density="heavy")
        wt.Box(center=(0,0),size=(1,1),color="reddish")
        wt.Sphere(1)
        wt.Sphere(center=(0,0),radius=-1)
        wt.Sphere(center=(0,0),radius=[1])
        wt.Mesh(path="nope.stl")
        wt.Mesh(path=3)
        wt.Mesh()
        wt.Points([[0,0]])
        wt.Points(positions=3)
        wt.Points(positions="x")
        wt.Points(positions=[[0,0],[0]])
        wt.Emitter(3)
        wt.Emitter(position=(0,0),direction=(0,0),radius=0.1,speed=1)
        wt.Drain(3)
        wt.Hinge(3)
        wt.Hinge(solid="x")
        wt.Motion(3)
        wt.Motion(velocity="x")
        wt.Keyframe(3)
        wt.Material(3)
        wt.Material(name="x", density=-1)
        wt.HeightField(3)
        wt.HeightField(heights=[[1,2],[3]])
        wt.Polygon(points=[(0,0),(1,1)])
        wt.Union(3)
        wt.Union(parts=[3])
        wt.Difference(parts=[])
        wt.Gauge(3)
        wt.Wind(3)
        wt.Wind(velocty=(1,0))
        wt.Vortex(center=3)
        wt.Attract()
        wt.Sway(3)
        wt.Session(3)
        wt.Session(S)
        wt.Filled(3)
        wt.Filled(solid="x")
    """,
    "pictures": """
        wt.render(3)
        wt.render("x")
        wt.render(None)
        wt.render(S, width=-1)
        wt.render(S, width="x")
        wt.render(S, 64, 48.5)
        wt.render(S, 64, 48, camera=(1,2,3))
        wt.render(S, 64, 48, camera="front")
        wt.render(S, 64, 48, view="x")
        wt.render(S, 64, 48, view=3)
        wt.render(S, 64, 48, foo=3)
        wt.render(S, 64, 48, quality="ultra")
        wt.render(S, 64, 48, quality=3)
        wt.render(S, 64, 48, color_by="x")
        wt.render(S, 64, 48, color_by=3)
        wt.render(S, 64, 48, colormap="x")
        wt.render(S, 64, 48, limits=3)
        wt.render(S, 64, 48, limits=(3, 1))
        wt.render(S, 64, 48, limits=("a", 1))
        wt.render(S, 64, 48, cut="x")
        wt.render(S, 64, 48, cut=3)
        wt.render(S, 64, 48, environment="x")
        wt.render(S, 64, 48, environment=3)
        wt.render(S, 64, 48, sun="x")
        wt.render(S, 64, 48, sun=3)
        wt.render(S, 64, 48, supersample="x")
        wt.render(S, 64, 48, floor="x")
        wt.render(S, 64, 48, eye=(0,0,0), target=(0,0,0))
        wt.render(S, 64, 48, eye=(1,2))
        wt.render(S, 64, 48, eye="x")
        wt.Camera(1, 2)
        wt.Camera(eye=(0,0,0), target=(0,0,0))
        wt.Camera(eye=(0,0), target=(1,1))
        wt.Camera(eye="x", target=(0,0,0))
    """,
    "files": """
        wt.Simulation.restore("nope.npz")
        wt.Simulation.restore(3)
        wt.Simulation.restore(None)
        wt.Scene.load("dam-brek")
        wt.Scene.load(3)
        wt.Scene.load(None)
        wt.Scene.load("")
        wt.Scene.load("/")
        wt.Scene.load(["a"])
        wt.replay(3)
        wt.replay("nope")
        wt.Recording.load("nope")
        wt.Recording(3)
        wt.load_urdf("nope.urdf")
        wt.load_mjcf(3)
        wt.load_robot(3)
        wt.load_dualsphysics(3)
        wt.load_splishsplash("nope")
    """,
}


def scene(**changes) -> wt.Scene:
    block = wt.Block(lower=(0, 0, 0), upper=(0.5, 0.4, 1))
    return wt.Scene(**{"spacing": 0.05, "tank": wt.Tank(size=(1, 1, 1)), "fluids": [block], "foam": 0, **changes})


@pytest.fixture(scope="module")
def names() -> dict:
    """What the lines above know: `S` is a running world with one of each, `F` its frame."""
    small = wt.Scene(
        spacing=0.05,
        foam=0,
        tank=wt.Tank(size=(1, 1)),
        fluids=[wt.Block(lower=(0, 0), upper=(0.5, 0.4))],
        solids=[
            wt.Box(name="b", center=(0.7, 0.7), size=(0.1, 0.1), density=500),
            wt.Box(name="w", center=(0.7, 0.2), size=(0.1, 0.1)),
        ],
        emitters=[wt.Emitter(name="tap", position=(0.3, 0.8), direction=(0, -1), shape="line", width=0.12, speed=1)],
        joints=[wt.Hinge(name="h", first="b", at=(0.7, 0.9))],
    )
    sim = wt.Simulation(small)
    sim.step()
    return {"wt": wt, "np": np, "copy": copy, "pickle": pickle, "scene": scene, "S": sim, "F": sim.frame()}


@pytest.mark.parametrize(
    ("kind", "line"), [(kind, line.strip()) for kind, lines in MISTAKES.items() for line in lines.strip().splitlines()]
)
def test_a_mistake_is_one_sentence(names, kind, line):
    sim = names["S"]
    before = sim.digest()
    with pytest.raises(wt.WavetankError) as mistake:
        exec(line, dict(names))
    said = str(mistake.value)
    assert "\n" not in said and len(said) < 700
    sim.forces[:], sim.terms[:] = [], []
    assert sim.digest() == before, "nothing has changed"


def test_the_copies_say_which_call_sets_them(names):
    sim = names["S"]
    for array, call in (
        (sim.velocities, "sim.velocities = x"),
        (sim.positions, "sim.positions = x"),
        (sim.bodies["b"].velocity, "sim.bodies['b'].velocity = ..."),
        (sim.bodies["b"].position, "sim.move('b', position=...)"),
        (sim.solids["w"].position, "sim.move('w', position=...)"),
        (sim.densities, "nothing sets it"),
    ):
        with pytest.raises(wt.WavetankError, match="copy") as mistake:
            array[...] = 0
        assert call in str(mistake.value)


def test_copies_compute_like_other_arrays(names):
    """What follows from one is a plain array; operators on the attribute reach the water."""
    sim = names["S"].clone()
    x = sim.positions
    for plain in (
        x + 1,
        x.copy(),
        np.array(x),
        x.mean(axis=0),
        np.sqrt(x),
        x @ np.eye(2),
        pickle.loads(pickle.dumps(x)),
    ):
        assert type(plain) is np.ndarray and plain.flags.writeable
    kept = x.copy()
    x -= 1.0
    assert np.array_equal(x, kept - 1.0) and np.array_equal(sim.positions, kept)
    chosen = sim.positions[sim.positions[:, 0] < 0.2]
    chosen[:] = 0.0
    sim.velocities *= 0.0
    assert not sim.velocities.any()
    with pytest.raises(wt.WavetankError, match="copy"):
        np.add(sim.velocities, 1.0, out=sim.velocities)


def test_a_copy_of_a_world_goes_on_as_the_world_does(names):
    for twin in (copy.copy(names["S"]), copy.deepcopy(names["S"])):
        assert twin is not names["S"] and twin.digest() == names["S"].digest()


def test_the_bundled_scenes_are_checked_to_the_same_data():
    for name in wt.bundled_scenes():
        one = wt.Scene.load(name)
        assert wt.Scene.checked(one).model_dump_json() == one.model_dump_json()


def test_render_and_dir_show_what_there_is(names):
    shown = inspect.signature(wt.render).parameters
    assert {"eye", "target", "quality", *(field.name for field in dataclasses.fields(Style))} <= set(shown)
    assert {"viscosity", "gravity", "substeps"} <= set(dir(names["S"]))
    far, near = (wt.render(names["S"], 64, 48, eye=(0.5, 0.4, z), target=(0.5, 0.4, 0)) for z in (2.0, 4.0))
    assert far.shape == near.shape == (48, 64, 3)


@pytest.mark.parametrize(
    ("key", "value", "read"),
    [
        ("tank.size", [2, 1, 1], lambda s: s.tank.size),
        ("solids[0].size", [0.1, 0.1, 0.1], lambda s: s.solids[0].size),
        ("solids[pillar].size", [0.1, 0.1, 0.1], lambda s: s.solids[0].size),
        ("fluids[0].upper[1]", 0.3, lambda s: s.fluids[0].upper[1]),
        ("light.azimuth", 30, lambda s: s.light.azimuth),
    ],
)
def test_keys_lead_into_tables_and_lists(key, value, read):
    changed = read(wt.Scene.load("obstacle-tank").changed(**{key: value}))
    assert changed == (tuple(value) if isinstance(value, list) else value)


@pytest.mark.parametrize("key", ["tank.sise", "solids[9].size", "solids[pilar].size", "spacing.x", "tank..size", "[0]"])
def test_keys_that_lead_nowhere_are_refused(key):
    with pytest.raises(wt.WavetankError):
        wt.Scene.load("obstacle-tank").changed(**{key: 1})
