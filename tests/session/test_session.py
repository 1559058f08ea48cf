"""A session under any commands: nothing crashes, no particle is lost, every run can be done again."""

import os
import random

import numpy as np
import pytest

import wavetank as wt
from wavetank.device import compiler
from wavetank.session import commands as c
from wavetank.session.commands import command_of
from wavetank.session.session import Session
from wavetank.session.tools import TOOLS
from wavetank.session.warm_up import launches

COUNT = int(os.environ.get("WAVETANK_RANDOM_COMMANDS", "10000"))


def pool(dim: int = 2, **keys) -> wt.Scene:
    """A small basin with a ball in it."""
    size = (1.0, 0.6, 0.4)[:dim]
    return wt.Scene(
        **{
            "spacing": 0.05,
            "tank": wt.Tank(size=size),
            "substeps": 2,
            "iterations": 2,
            "largest_substeps": 4,
            "wave_courant": 2.0,
            "fluids": [wt.Block(lower=(0.0,) * dim, upper=(0.6, 0.4, 0.4)[:dim])],
            "solids": [wt.Sphere(name="ball", center=(0.8, 0.1, 0.2)[:dim], radius=0.08)],
            **keys,
        }
    )


def down(x: float, y: float) -> dict:
    """A ray straight at a place of a 2-D world."""
    return {"origin": (x, y, 5.0), "direction": (0.0, 0.0, -1.0)}


class Monkey:
    """Makes commands at random, sensible and foolish ones."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)

    def ray(self) -> dict:
        spot = self.random.uniform
        if self.random.random() < 0.1:
            return {"origin": [spot(-9, 9) for _ in range(3)], "direction": [spot(-1, 1), spot(-1, 1), spot(0.01, 1)]}
        return down(spot(-0.2, 1.2), spot(-0.2, 0.9))

    def tool(self) -> dict:
        tool = self.random.choice(TOOLS)
        options = {}
        for name, field in tool.model_fields.items():
            if self.random.random() < 0.4:
                low = next((m.ge for m in field.metadata if hasattr(m, "ge")), None)
                high = next((m.le for m in field.metadata if hasattr(m, "le")), None)
                if low is not None:
                    options[name] = self.random.choice((low, high, self.random.uniform(low, high)))
                elif isinstance(field.default, bool):
                    options[name] = self.random.random() < 0.5
                elif name == "color":
                    options[name] = self.random.choice(("", "#ff8000"))
                else:
                    options[name] = self.random.choice(field.annotation.__args__)
        return {"tool": tool.name, "options": options}

    def command(self) -> dict:
        r = self.random
        number = r.choice((0.0, -1.0, 0.3, 1.0, 5.0, 1e9, float("nan"), float("inf")))
        return r.choice(
            (
                lambda: {"do": "tool-begin", "pointer": r.randrange(3), **self.tool(), **self.ray()},
                lambda: {"do": "tool-begin", "pointer": r.randrange(3), **self.tool(), **self.ray()},
                lambda: {"do": "tool-move", "pointer": r.randrange(3), **self.ray()},
                lambda: {"do": "tool-move", "pointer": r.randrange(3), **self.ray()},
                lambda: {"do": "tool-end", "pointer": r.randrange(3)},
                lambda: {"do": "tool-stop"},
                lambda: {
                    "do": "set",
                    "name": r.choice(("viscosity", "vorticity", "tensile_strength")),
                    "value": number,
                },
                lambda: {"do": "set", "name": "gravity", "value": (r.uniform(-20, 20), r.uniform(-20, 20))},
                lambda: {"do": "set", "name": "iterations", "value": r.choice((1, 2, 3, 0, -5, "many"))},
                lambda: {"do": "set", "name": r.choice(("spacing", "taste")), "value": number},
                lambda: {"do": "move-solid", "name": "ball", "position": (r.uniform(-1, 2), r.uniform(-1, 2))},
                lambda: {"do": "move-solid", "name": "ball", "rotation": number},
                lambda: {
                    "do": "add-solid",
                    "solid": {
                        "shape": "box",
                        "center": [r.random(), r.random() * 0.6],
                        "size": [0.1, r.choice((0.1, -1.0))],
                    },
                },
                lambda: {
                    "do": "remove-solid",
                    "name": r.choice(("ball", "solid 1", "solid 2", "solid 3", "tank x lower")),
                },
                lambda: {"do": "pause", "on": r.random() < 0.3},
                lambda: {"do": "step", "frames": r.choice((1, 2, 0))},
                lambda: {"do": "speed", "factor": r.choice((0.1, 0.5, 1.0, 2.0, 0.0, number))},
                lambda: {"do": "rewind", "time": number},
                lambda: {
                    "do": "bookmark",
                    "name": r.choice("abc"),
                    "action": r.choice(("set", "go", "forget", "burn")),
                },
                lambda: {"do": "camera", "eye": [1, 1, number], "target": [0, 0, 0]},
                lambda: {"do": "orbit", "azimuth": number},
                lambda: {"do": "pan", "right": number},
                lambda: {"do": "zoom", "factor": number},
                lambda: {"do": "home"},
                lambda: {"do": "view", "color_by": r.choice(("speed", "density", "#123456", "taste"))},
                lambda: {"do": "light", "environment": r.choice(("", "evening", "disco")), "rise": number},
                lambda: {"do": "fly"},
                lambda: {"do": ["set"]},
                lambda: {"don't": 1},
            )
        )()


def ids(session: Session) -> np.ndarray:
    return session.sim.world.particles.id.to_numpy()[: session.sim.count]


def may_lose(session: Session) -> bool:
    """Whether a drain or a cutter is at work."""
    tools = [tool.name for tool, _ in [*session.hands.values(), *session.running.values()]]
    return "drain" in tools or "cut" in tools


def test_ten_thousand_random_commands():
    """No crash, no number that is none, no particle lost but by drain and cutter, none twice."""
    session, monkey = Session(pool(largest_substeps=2, wave_courant=4.0), most_particles=400), Monkey(7)
    refused = 0
    for number in range(COUNT):
        table = monkey.command()
        if number % 400 == 399:
            table = {"do": "reset"}
        before = ids(session)
        try:
            command = command_of(table)
            loses = isinstance(command, c.Reset | c.Rewind | c.Bookmark) or may_lose(session)
            session.apply(command)
        except wt.WavetankError as error:
            refused += 1
            assert "\n" not in str(error)
            assert len(str(error)) < 1000
            continue
        loses = loses or may_lose(session)
        if number % 16 == 0:
            session.tick()
        now = ids(session)
        assert loses or np.isin(before, now).all(), table
        assert len(np.unique(now)) == len(now)
        if number % 32 == 0:
            frame = session.sim.frame(measured=False)
            assert np.isfinite(frame.positions).all()
            assert np.isfinite(frame.velocities).all()
            assert (frame.positions > -1e-3).all()
            assert (frame.positions < np.array([1.0, 0.6]) + 1e-3).all()
    assert 0.05 * COUNT < refused < 0.6 * COUNT
    assert session.sim.count > 0


def test_what_is_there_is_a_scene():
    session = Session(pool())
    session.apply(c.AddSolid(solid=wt.Capsule(start=(0.2, 0.45), end=(0.3, 0.45), radius=0.03)))
    session.apply(c.ToolBegin(tool="waves", **down(0.1, 0.2)))
    for k in range(30):
        session.apply(c.MoveSolid(name="ball", position=(0.7, 0.3), rotation=0.01 * k))
        session.tick()
    scene = wt.Scene.from_text(session.current_scene().text())
    assert [solid.name for solid in scene.solids] == ["ball", "solid 1"]
    again = Session(scene)
    np.testing.assert_array_equal(again.sim.positions, session.sim.positions)
    np.testing.assert_array_equal(again.sim.velocities, session.sim.velocities)
    for name in ("ball", "solid 1"):
        (x, q), (y, p) = (world.sim.solids.poses[world.sim.solids.find(name)] for world in (again, session))
        np.testing.assert_allclose(x, y, atol=1e-12)
        np.testing.assert_allclose(q, p, atol=1e-12)


def test_rewind_brings_the_same_foam_back():
    scene = wt.Scene.load("dam-break-2d").changed(spacing=0.04, foam=2.0, foam_capacity=20_000)
    session = Session(scene)
    while len(session.sim.foam_kinds) < 20:
        session.tick()
    session.apply(c.Bookmark(name="then"))

    def future() -> list[np.ndarray]:
        session.apply(c.ToolBegin(tool="stir", **down(1.0, 0.2)))
        for _ in range(20):
            session.tick()
        frame = session.sim.frame()
        return [frame.positions, frame.foam_ids, frame.foam_positions]

    first = future()
    session.apply(c.Bookmark(name="then", action="go"))
    for a, b in zip(first, future(), strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("scene", ["dam-break", "dam-break-2d"])
def test_a_splash_waits_for_no_kernels(scene):
    """A session has loaded all that makes and moves spray before the water does, and nothing has changed by it."""
    launched: list[str] = []

    def around(module: str, name: str, launch):
        launched.append(f"{module}.{name}")
        return launch()

    with compiler.watched(around):
        session = Session(wt.Scene.load(scene).changed(spacing=0.06))
        for compile_some in launches(session.sim):  # as the loop of page and window does after the first picture
            compile_some()
    loaded = {name for name in launched if "foam" in name}
    launched.clear()
    with compiler.watched(around):
        while not len(session.sim.frame(measured=False).foam_positions) or session.sim.frame_number % 4:
            session.tick()
            assert session.sim.time < 2.0, "it foams"
    assert {name for name in launched if "foam" in name} == loaded
    plain = wt.Simulation(session.scene)
    for _ in range(session.sim.frame_number):
        plain.step()
    np.testing.assert_array_equal(plain.positions, session.sim.positions)
    np.testing.assert_array_equal(plain.foam_positions, session.sim.foam_positions)
