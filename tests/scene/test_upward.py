"""Up is against gravity, or `up`: in levels, pictures, cameras, ground, tools and files."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.upward import upward_of
from wavetank.session.commands import command_of
from wavetank.session.session import Session

TO_Z = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # y up to z up


def turned(vector):
    return tuple((TO_Z @ vector).tolist())


def world(up: str, **fields) -> wt.Scene:
    """A tank whose middle is the origin of its base, with y or z up."""
    t = turned if up == "z" else tuple
    size, block = (0.8, 0.6, 0.5), ((-0.4, 0.0, -0.25), (0.4, 0.2, 0.25))
    low, high = np.sort([t(corner) for corner in block], axis=0)
    tank = wt.Tank(size=tuple(np.abs(t(size))), lower=tuple(np.minimum(t((-0.4, 0, -0.25)), t((0.4, 0.6, 0.25)))))
    block = wt.Block(lower=tuple(low), upper=tuple(high))
    return wt.Scene(spacing=0.05, gravity=t((0, -9.81, 0)), foam=0, tank=tank, fluids=[block], **fields)


@pytest.mark.parametrize(
    ("fields", "up"),
    [
        ({}, "y"),
        ({"gravity": (0, 0, 0)}, "y"),
        ({"gravity": (0, 0, -9.81)}, "z"),
        ({"gravity": (0, 0, 9.81)}, "-z"),
        ({"gravity": (3, -9, 1)}, "y"),
        ({"gravity": (-9, -9, 0)}, "y"),
        ({"gravity": (0, 0, -9.81), "up": "y"}, "y"),
        ({"gravity": ["-9.81 * cos(t)", "0", "0"]}, "x"),
    ],
)
def test_up_is_against_the_first_gravity(fields, up):
    assert wt.Scene(**{"spacing": 0.1, "tank": wt.Tank(size=(1, 1, 1)), **fields}).upward == up


def test_up_stays_when_gravity_changes_and_y_leaves_no_trace():
    sim = wt.Simulation(world("z"))
    sim.gravity = (0, -9.81, 0)
    assert sim.scene.upward == "z" and wt.Scene.parse(sim.scene.table()).upward == "z"
    before = wt.Simulation(world("y")).digest()
    assert wt.Simulation(world("y").changed(up="y")).digest() == before
    assert upward_of((2.0, -0.1, 0.0), periodic=[0]) == "y", "what drives water along a periodic axis is not down"
    with pytest.raises(wt.WavetankError, match="not an axis of a 2-D world"):
        wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1)), up="z")


@pytest.mark.parametrize("up", ["y", "z"])
def test_taps_and_drains_stop_at_their_levels(up):
    t = turned if up == "z" else tuple
    tap = wt.Emitter(name="tap", position=t((0, 0.5, 0)), direction=t((0, -1, 0)), radius=0.1, flow=80.0, level=0.3)
    plug = wt.Drain(name="plug", center=t((0, 0.0, 0)), radius=0.15, level=0.1)
    for source, level in (({"emitters": [tap]}, 0.3), ({"drains": [plug]}, 0.1)):
        sim = wt.Simulation(world(up, **source))
        sim.advance(2.0)
        assert sim.count * 0.05**3 / 0.4 == pytest.approx(level, abs=0.02)


def test_pictures_and_cameras_are_those_of_the_world_with_y_up():
    places = np.random.default_rng(1).uniform((-0.3, 0.05, -0.2), (0.3, 0.3, 0.2), (400, 3))
    ball = {"radius": 0.08, "color": "#cc4422"}
    pictures = {}
    for up in "yz":
        t = turned if up == "z" else tuple
        scene = world(up, solids=[wt.Sphere(center=t((0.2, 0.4, 0.1)), **ball)])
        scene.fluids = [wt.Points(positions=[t(x) for x in places])]
        sim = wt.Simulation(scene)
        eye, target = t((1.5, 1.0, 1.8)), t((0, 0.2, 0))
        pictures[up] = [
            wt.render(sim, 96, 64, view="particles", color_by="#3f99da"),
            wt.render(sim, 96, 64, eye=eye, target=target),
            wt.render(sim, 96, 64, camera=wt.Camera(eye, target).in_world(scene).orbit(0.4, 0.2).zoom(0.8)),
            wt.render(sim, 96, 64, view="slice", cut="y=0.1" if up == "z" else "z=-0.1"),
        ]
    for one, other in zip(pictures["y"], pictures["z"], strict=True):
        assert np.abs(one.astype(int) - other).mean() < 1.0


def test_ground_rises_along_what_is_up():
    heights = np.array([[0.0, 0.1, 0.4], [0.0, 0.2, 0.3]])
    upper = {}
    for up in "yz":
        t = turned if up == "z" else tuple
        ground = wt.HeightField(center=t((0, 0.05, 0)), size=tuple(np.abs(t((0.8, 1.0, 0.5)))), heights=heights)
        sim = wt.Simulation(world(up, solids=[ground]))
        probes = np.array([[x, y, z] for x in (-0.3, 0, 0.3) for y in (0.1, 0.3, 0.5) for z in (-0.2, 0.2)])
        upper[up] = sim.free_places(np.array([t(p) for p in probes]), 0.0, 0.0).tolist()
    assert upper["y"] == upper["z"] and len(set(upper["y"])) == 2


@pytest.mark.parametrize("tool", ["drop", "paddle", "waves", "pour", "tilt"])
def test_tools_know_what_is_up(tool):
    seen = {}
    for up in "yz":
        t = turned if up == "z" else tuple
        session = Session(world(up))
        ray = {"origin": t((0.1, 2.0, 0.05)), "direction": t((0.0, -1.0, 0.001))}
        session.apply(command_of({"do": "tool-begin", "pointer": 1, "tool": tool, **ray}))
        session.apply(command_of({"do": "tool-move", "pointer": 1, **ray, "origin": t((0.2, 2.0, 0.1))}))
        for _ in range(3):
            session.tick()
        back = TO_Z.T if up == "z" else np.eye(3)
        placed = [back @ one.position for one in session.sim.frame().placed]
        seen[up] = [session.sim.count, np.round([*placed, back @ session.sim.gravity], 3)]
    assert seen["y"][0] == pytest.approx(seen["z"][0], abs=2)
    np.testing.assert_allclose(seen["y"][1], seen["z"][1], atol=2e-3)


def test_files_say_which_axis_is_up(tmp_path):
    pytest.importorskip("pxr")
    from wavetank.formats.usd_static import up_axis

    assert [up_axis(world(up)) for up in "yz"] == ["Y", "Z"]
