"""What was left by a reset or another scene comes back; levels wait; zoom stays where it is pointed."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError
from wavetank.session import commands as do
from wavetank.session.commands import command_of
from wavetank.session.recording import Recording, replay

POOL = wt.Scene(
    title="Pool",
    spacing=0.04,
    tank=wt.Tank(size=(1.2, 0.8, 0.4)),
    fluids=[wt.Block(lower=(0, 0, 0), upper=(1.2, 0.32, 0.4))],
)


def ray(session, u, v):
    origin, direction = session.camera.ray(u * 960, v * 540, 960, 540)
    return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}


def ticked(scene, frames=5):
    session = wt.Session(scene)
    for _ in range(frames):
        session.tick()
    return session


def test_undo_brings_back_the_world_that_was_left_and_once_more_the_other():
    session = ticked(POOL)
    left, digest = session.sim.time, session.sim.digest()
    with pytest.raises(WavetankError, match="nothing to undo"):
        session.apply(do.Undo())
    session.apply(do.LoadScene(name="drop-2d"))
    session.tick()
    other = session.sim.digest()
    session.apply(do.Undo())
    assert (session.sim.time, session.sim.digest(), session.scene.title) == (left, digest, "Pool")
    assert session.history.times[0] == 0.0, "its past is there, too"
    session.apply(do.Undo())
    assert session.sim.digest() == other


def test_a_recording_repeats_what_was_undone():
    session = ticked(POOL)
    session.apply(do.Reset(parameters={"spacing": 0.05}))
    session.tick()
    session.apply(do.Undo())
    session.tick()
    recording = Recording.of(session, POOL)
    assert list(replay(recording))[-1].sim.digest() == session.sim.digest()


def test_a_scene_of_so_many_particles():
    session = ticked(POOL, 0)
    session.apply(do.LoadScene(name="obstacle-tank", particles=2000))
    assert 1400 < session.sim.count < 2600
    session.apply(do.LoadScene(name="over-the-wall", particles=300))
    assert session.sim.count > 800, "a level is what it is"


def test_a_level_waits_for_the_first_touch_where_there_are_people():
    session = wt.Session(wt.Scene.load("over-the-wall"))
    session.starts_on_touch = True
    session.wait_for_touch()
    assert not session.turn()
    session.apply(do.ToolBegin(tool="push", origin=(0.5, 0.2, 5), direction=(0, 0, -1)))
    assert session.turn()
    session.apply(do.Reset())
    assert not session.turn()
    session.apply(do.LoadScene(name="drop-2d"))
    assert session.turn(), "what is no level moves at once"


def test_zoom_keeps_the_place_under_the_pointer_and_ends_where_nothing_is_seen():
    session = ticked(POOL, 0)
    session.aspect = 16 / 9
    before = session.camera
    u, v = 0.3, 0.6
    origin, way = before.ray(u * 16, v * 9, 16, 9)
    forward = before._axes[2]
    point = origin + way * (before.distance / float(way @ forward))
    session.apply(do.Zoom(factor=0.5, x=u, y=v))
    assert session.camera.visible_height == pytest.approx(0.5 * before.visible_height)
    assert session.camera.project([point], 16, 9)[0][:2] == pytest.approx([u * 16, v * 9], abs=1e-6)
    for _ in range(40):
        session.apply(do.Zoom(factor=0.5))
    assert session.camera.visible_height > 4 * POOL.spacing
    for _ in range(40):
        session.apply(do.Zoom(factor=2.0))
    assert session.camera.visible_height < 20.0


def test_a_tilted_tank_is_seen_tilted_and_gravity_points_down_in_the_picture():
    session = ticked(POOL)
    session.apply(do.ToolBegin(tool="tilt", **ray(session, 0.5, 0.5)))
    session.apply(do.ToolMove(**ray(session, 0.6, 0.5)))
    gravity = np.array(session.sim.gravity)
    assert gravity[0] != 0.0
    eye, axes = session.tilted_camera, session.tilted_camera._axes
    assert session.tilted_camera != session.camera
    level, upright = axes @ gravity, session.camera._axes @ [0.0, -9.81, 0.0]
    assert level == pytest.approx(upright, abs=1e-4)
    assert eye.distance == pytest.approx(session.camera.distance)
    session.apply(do.ToolEnd())
    assert session.tilted_camera == session.camera


def test_who_asks_for_a_colour_sees_it():
    session = ticked(POOL, 0)
    session.apply(do.SetView(color_by="density"))
    assert session.view == "particles"
    session.apply(do.SetView(view="slice", axis="x", place=0.25))
    session.apply(do.SetView(color_by="speed"))
    assert (session.view, session.cut) == ("slice", ("x", 0.25))
    waiting = do.SetView(color_by="speed").after(do.SetView(view="particles"))
    assert (waiting.view, waiting.color_by) == ("particles", "speed"), "none of two that wait is lost"


def test_the_sun_is_turned_and_stays_above_the_horizon():
    session = ticked(POOL, 0)
    session.apply(do.SetLight(environment="evening"))
    assert session.light == {"environment": "evening"}
    session.apply(do.SetLight(turn=10.0, rise=-2.0))
    assert session.light["sun"] == "245,7", "from where the evening's own sun stands: -125, 9"
    session.apply(do.SetLight(rise=-300.0))
    session.apply(do.SetLight(azimuth=40.0))
    assert session.light == {"environment": "evening", "sun": "40,3"}
    waiting = do.SetLight(turn=5.0, rise=1.0).after(do.SetLight(azimuth=90.0, turn=5.0))
    assert (waiting.azimuth, waiting.turn, waiting.rise) == (90.0, 10.0, 1.0), "none of two that wait is lost"
    session.apply(do.SetLight(environment="sky"))
    assert session.light == {"environment": "sky"}, "with a sun of its own"
    with pytest.raises(WavetankError, match="one of studio, pool"):
        session.apply(do.SetLight(environment="disco"))


def test_messages_name_the_command_once_and_the_file():
    with pytest.raises(WavetankError) as told:
        command_of({"do": "load"})
    assert str(told.value).count("load") == 1
    session = ticked(POOL, 0)
    with pytest.raises(WavetankError, match=r"^mine\.toml"):
        session.apply(do.LoadScene(text="spacing = -1", file="mine.toml"))


@pytest.mark.parametrize(("tool", "rise", "speed"), [("push", 0.03, 0.5), ("stir", 0.05, 0.8), ("attract", 0.1, 0.8)])
def test_a_tool_is_seen_in_still_water_at_its_default(tool, rise, speed):
    """The surface rises by so much of the length within a second, and the fastest per cent moves at so much [m/s]."""
    session = ticked(POOL, 10)
    session.aspect = 16 / 9
    level = float(np.percentile(session.sim.positions[:, 1], 99.9))
    session.apply(do.ToolBegin(tool=tool, **ray(session, 0.35, 0.5)))
    top = fast = 0.0
    for k in range(45):
        if tool == "push":
            session.apply(do.ToolMove(**ray(session, 0.35 + 0.3 * k / 45, 0.5)))
        session.tick()
        top = max(top, float(session.sim.positions[:, 1].max()))
        fast = max(fast, float(np.percentile(np.linalg.norm(session.sim.velocities, axis=1), 99)))
    assert top - level > rise * 1.2
    assert fast > speed
