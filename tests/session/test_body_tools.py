"""Tools for bodies: drop, shove, and a grab that feels their weight."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.session import commands as c
from wavetank.session.recording import Recording, replay
from wavetank.session.session import Session
from wavetank.session.tools import TOOL_NAMES
from wavetank.session.tools.grab import STRETCH
from wavetank.session.tools.solids import force_unit, to_world_frame

pytest.importorskip("rapier3d")

SPACING = 0.05


def pond(dim: int, *solids, **more) -> Session:
    size = (1.2, 1.2, 0.6)[:dim]
    block = wt.Block(lower=(0,) * dim, upper=(1.2, 0.3, 0.6)[:dim])
    return Session(wt.Scene(spacing=SPACING, tank=wt.Tank(size=size), fluids=[block], solids=[*solids], **more))


def box(dim: int, **more) -> wt.Box:
    center, size = (0.6, 0.5, 0.3)[:dim], (0.2, 0.2, 0.2)[:dim]
    return wt.Box(**{"name": "box", "center": center, "size": size, "density": 400.0, **more})


def ray(x: float, y: float, z: float = 0.3) -> dict:
    return {"origin": (x, y, 4.0 + z), "direction": (0.0, 0.0, -1.0)}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("shape", ["box", "ball", "log", "plank"])
def test_what_is_dropped_falls_and_floats_as_its_density_says(dim, shape):
    session = pond(dim)
    options = {"shape": shape, "density": 0.5}
    session.apply(c.ToolBegin(tool="drop", options=options, **ray(0.6, 0.25)))
    session.apply(c.ToolEnd())
    (body,) = session.sim.bodies.values()
    assert body.mass == pytest.approx(500.0 * body.wet.mass / 1000.0, rel=1e-6)
    x = session.sim.positions
    assert body.position[1] - body.solid.reach() > x[:, 1].max(), "it begins over the water"
    session.tick()
    assert body.velocity[1] < 0.0
    heights = []
    for _ in range(120):
        session.tick()
        heights.append(session.sim.bodies[body.name].position[1])
    assert 0.2 < np.mean(heights[60:]) < 0.45


def test_bodies_that_are_dropped_on_one_place_do_not_overlap():
    session = pond(3)
    for _ in range(4):
        session.apply(c.ToolBegin(tool="drop", options={"shape": "ball"}, **ray(0.6, 0.25)))
        session.apply(c.ToolEnd())
    heights = sorted(body.position[1] for body in session.sim.bodies.values())
    radius = next(iter(session.sim.bodies.values())).solid.reach()
    assert np.diff(heights).min() > 1.99 * radius


@pytest.mark.parametrize("dim", [2, 3])
def test_shove_presses_where_it_is_dragged(dim):
    """Force times time is the momentum it gives; off the middle it turns the body too."""
    session = pond(dim, box(dim, center=(0.6, 0.9, 0.3)[:dim]))
    strength = 0.1
    session.apply(c.ToolBegin(tool="shove", options={"strength": strength}, **ray(0.6, 0.98)))
    session.apply(c.ToolMove(**ray(2.1, 0.9)))
    for _ in range(5):
        session.tick()
    body = session.sim.bodies["box"]
    force = strength * force_unit(session.sim, 1.2)
    assert body.velocity[0] * body.mass == pytest.approx(force * 5 / 60, rel=0.05)
    assert body.angular_velocity[2] < 0.0


def test_shove_says_where_there_is_no_body():
    session = pond(3, wt.Sphere(name="rock", center=(0.6, 0.15, 0.3), radius=0.1))
    session.apply(c.ToolBegin(tool="shove", **ray(0.6, 0.15)))
    session.tick()
    assert any("no body under the pointer" in note for note in session.notes)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_body_hangs_on_the_hand_by_its_weight(dim):
    """The spring is longer by weight over stiffness, and one too heavy stays where it is."""
    session = pond(dim, box(dim, center=(0.6, 0.8, 0.3)[:dim]))
    session.apply(c.ToolBegin(tool="grab", **ray(0.6, 0.8)))
    for _ in range(150):
        session.tick()
    body = session.sim.bodies["box"]
    stiffness = force_unit(session.sim, 1.2) / (STRETCH * 1.2)
    tool, hand = session.hands[0]
    stretch = hand.point - to_world_frame(body, tool._point)
    assert stretch == pytest.approx([0.0, 9.81 * body.mass / stiffness, 0.0], abs=2e-3)
    heavy = pond(dim, box(dim, center=(0.6, 0.12, 0.3)[:dim], density=8000.0))
    heavy.apply(c.ToolBegin(tool="grab", options={"strength": 0.5}, **ray(0.6, 0.12)))
    heavy.apply(c.ToolMove(**ray(0.6, 0.9)))
    for _ in range(60):
        heavy.tick()
    assert heavy.sim.bodies["box"].position[1] < 0.2


def test_a_body_let_go_goes_on_as_fast_as_the_hand():
    session = pond(2, box(2, center=(0.2, 0.8)))
    session.apply(c.ToolBegin(tool="grab", options={"strength": 5.0}, **ray(0.2, 0.8)))
    for k in range(20):
        session.apply(c.ToolMove(**ray(0.2 + 0.015 * k, 0.8)))
        session.tick()
    session.apply(c.ToolEnd())
    session.tick()
    assert session.sim.bodies["box"].velocity[0] == pytest.approx(0.015 * 60, rel=0.25)


def test_tools_for_bodies_are_replayed_to_the_same_bits():
    session = pond(3, box(3))
    session.apply(c.ToolBegin(tool="drop", options={"shape": "log"}, **ray(0.3, 0.25)))
    session.apply(c.ToolBegin(tool="grab", **ray(0.6, 0.5)))
    for k in range(20):
        session.apply(c.ToolMove(**ray(0.6 + 0.01 * k, 0.5)))
        session.tick()
    *_, again = replay(Recording.of(session, session.scene))
    assert again.sim.digest() == session.sim.digest()
    assert {"drop", "shove"} <= set(TOOL_NAMES)
