"""A run's folder opened again: pictures of instants and films without computing anything twice, and play."""

import json

import av
import numpy as np
import pytest
from PIL import Image

import wavetank as wt
from wavetank.formats import npz
from wavetank.run import archived
from wavetank.run.archived import film_archived, frame_at, scene_path
from wavetank.run.options import RunOptions
from wavetank.run.record import record
from wavetank.run.still import render_still
from wavetank.simulation.frame import FrameBuffer
from wavetank.simulation.instant import FOAM, PARTICLES
from wavetank.view.renderer import Renderer

SCENE = """
spacing = 0.06
foam = 1.0
tank.size = [1.0, 0.7, 0.5]
fluids = [{ lower = [0, 0, 0], upper = [0.4, 0.6, 0.5] }]
solids = [{ name = "paddle", center = [0.8, 0.2, 0.25], size = [0.05, 0.3, 0.3], motion = { rotation = "2*t" } }]
"""
FPS, SECONDS = 10.0, 0.8


@pytest.fixture(scope="module", params=["npz", "h5", ""])
def run(request, tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    exports = (request.param,) if request.param else ()
    record(wt.Simulation(wt.Scene.from_text(SCENE)), RunOptions(out, SECONDS, FPS, (96, 64), exports=exports))
    return out, request.param


@pytest.fixture(scope="module")
def frames():
    """What the run saw: arrays and pictures."""
    sim, renderer, found = wt.Simulation(wt.Scene.from_text(SCENE)), Renderer(96, 64), []
    for frame in sim.frames(SECONDS, FPS):
        arrays = {field.name: getattr(frame, field.name).copy() for field in (*PARTICLES, *FOAM)}
        found.append((arrays, renderer.render(frame), renderer.render(frame, view="particles")))
    assert len(found[-1][0]["foam_ids"]) > 0, "there is foam to be shown"
    return found


def no_simulation(monkeypatch) -> None:
    def refuse(*arguments, **more):
        raise AssertionError("the water was computed again")

    monkeypatch.setattr(archived, "Simulation", refuse)
    monkeypatch.setattr("wavetank.run.export.Simulation", refuse)


@pytest.mark.parametrize(("at", "number"), [(0.0, 0), (0.33, 3), (0.8, 8), (None, 8)])
def test_a_picture_of_an_instant_is_that_of_the_run(run, frames, at, number, monkeypatch):
    out, kind = run
    if kind:
        no_simulation(monkeypatch)
    frame = frame_at(str(out), at)
    assert frame.time == pytest.approx(number / FPS, abs=1e-9)
    for name, values in frames[number][0].items():
        np.testing.assert_array_equal(getattr(frame, name), values, err_msg=name)
    renderer = Renderer(96, 64)
    np.testing.assert_array_equal(renderer.render(frame), frames[number][1])
    np.testing.assert_array_equal(renderer.render(frame, view="particles"), frames[number][2])


def test_a_film_shows_each_frame(run, frames, monkeypatch, tmp_path):
    out, kind = run
    if kind:
        no_simulation(monkeypatch)
    figures = film_archived(str(out), tmp_path / "a.mp4", 96, 64)
    assert figures["frames"] == 9 and figures["fps"] == FPS and figures["time"] == pytest.approx(SECONDS)
    with av.open(str(tmp_path / "a.mp4")) as video:
        shown = [picture.to_ndarray(format="rgb24") for picture in video.decode(video=0)]
    assert len(shown) == 9
    for picture, (_, drawn, _) in zip(shown, frames, strict=True):
        assert np.abs(picture.astype(int) - drawn).mean() < 6.0, "a film is packed with loss"


def test_the_command_line_opens_a_run(wavetank, run, tmp_path, monkeypatch):
    out, kind = run
    small = ("--width", "96", "--height", "64")
    result = wavetank("render", str(out), "--time", "0.3", *small, "--out", str(tmp_path / "a.png"), "--json")
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout.splitlines()[-1])["time"] == pytest.approx(0.3)
    with Image.open(tmp_path / "a.png") as picture:
        assert picture.size == (96, 64) and picture.info["time"] == "0.3000 s"
    if kind == "npz":
        result = wavetank("render", str(out), *small, "--out", str(tmp_path / "a.gif"))
        assert result.returncode == 0 and "9 frames" in result.stdout
        for words, arguments in {
            "from 0 to 0.8 s": (str(out), "--at", "0.9"),
            "--set cannot be used with": (str(out), "--set", "viscosity=1"),
            "cannot be used with a film": (str(out), "--at", "0.1", "--out", str(tmp_path / "b.mp4")),
            "wavetank run drop-2d --video": ("drop-2d", "--out", str(tmp_path / "b.mp4")),
        }.items():
            refused = wavetank("render", *arguments)
            assert refused.returncode == 1 and words in refused.stderr and refused.stderr.count("\n") == 1


def test_a_run_is_played_from_its_scene(run):
    out, _ = run
    scene = wt.Scene.load(scene_path(str(out)))
    assert scene.spacing == 0.06 and [solid.name for solid in scene.solids] == ["paddle"]
    assert scene_path("drop-2d") == "drop-2d"


def test_a_run_without_frames_goes_on_from_its_checkpoint(tmp_path, frames, monkeypatch):
    from wavetank.simulation.simulation import Simulation

    advance, count = Simulation._advance_frame, [0]

    def ending(self, duration):
        count[0] += 1
        if self.time > 0.65:
            raise KeyboardInterrupt
        advance(self, duration)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(Simulation, "_advance_frame", ending)
        record(
            wt.Simulation(wt.Scene.from_text(SCENE)), RunOptions(tmp_path, SECONDS, FPS, (96, 64), checkpoint_every=0.4)
        )
    with monkeypatch.context() as patch:
        patch.setattr(archived, "Simulation", None)  # not from the start
        np.testing.assert_array_equal(frame_at(str(tmp_path), 0.6).positions, frames[6][0]["positions"])
    np.testing.assert_array_equal(frame_at(str(tmp_path), 0.2).positions, frames[2][0]["positions"])


def test_a_state_shown_is_not_the_water_it_came_from(frames):
    """Frames of fewer and of more particles in the same room."""
    scene = wt.Scene.from_text(SCENE)
    shown = FrameBuffer(scene)
    whole = npz.State.read(scene, 1, 0.1, frames[1][0], ())
    part = npz.State.read(scene, 2, 0.2, {name: rows[:7] for name, rows in frames[2][0].items()}, ())
    for instant in (part, whole, part):
        frame = shown.frame(instant)
        assert frame.count == instant.count and frame.foam_count == len(instant.foam_ids)
        np.testing.assert_array_equal(frame.positions, instant.positions)


def test_the_picture_of_a_run_is_written(run, tmp_path):
    out, _ = run
    figures = render_still(str(out), None, tmp_path / "x.png", 64, 48, at=0.5, quality="draft")
    assert figures["time"] == pytest.approx(0.5) and (tmp_path / "x.png").is_file()
