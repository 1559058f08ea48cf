"""Films: the camera's path, slow motion, and going on."""

import json

import numpy as np
import pytest

import wavetank as wt
from wavetank.run import film
from wavetank.scene.film import Film

SCENE = """
spacing = 0.1
[tank]
size = [1.2, 0.8, 0.6]
[[fluids]]
lower = [0, 0, 0]
upper = [0.5, 0.6, 0.6]
[film]
duration = 1
fps = 4
size = [64, 36]
quality = "draft"
start = 0.05
speed = "0.2 + 0.2*t"
eye = [{time=0, value=[2, 0.5, 3]}, {time=1, value=[4, 0.5, 3]}]
target = [0.6, "0.3 + 0.1*t", 0.3]
"""


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "x.toml").write_text(SCENE)
    return wt.Scene.load(tmp_path / "x.toml")


def test_the_camera_goes_its_way_and_the_water_its_pace(scene):
    for time in (0.0, 0.25, 0.9):
        camera = film.camera_at(scene.film, scene, time, 0.0)
        assert camera.eye == pytest.approx((2.0 + 2.0 * time, 0.5, 3.0))
        assert camera.target == pytest.approx((0.6, 0.3 + 0.1 * time, 0.3))
    # The integral of 0.2 + 0.2 t from 0 to the time of each frame.
    t = np.arange(4) / 4.0
    np.testing.assert_allclose(scene.film.times(), 0.05 + 0.2 * t + 0.1 * t**2, atol=1e-9)


def test_frames_are_of_their_time_and_seen_from_their_place(scene, tmp_path):
    """The frame of a film is the picture of a world that was advanced and looked at by hand."""
    out = tmp_path / "x.gif"
    figures = film.film_scene(scene, out, keep=True)
    assert figures["frames"] == figures["rendered"] == 4 and out.exists()
    sim = wt.Simulation(scene)
    before = 0.0
    for time in scene.film.times()[:3]:
        sim.advance(time - before)
        before = time
    from PIL import Image

    camera = film.camera_at(scene.film, scene, 0.5, sim.time)
    order = scene.film.at(0.5)
    shutter = order.shutter * order.speed / scene.film.fps
    by_hand = wt.render(sim, 64, 36, quality="draft", camera=camera, legend=False, shutter=shutter)
    kept = np.asarray(Image.open(tmp_path / "x.gif.frames" / "frame-00002.png"))
    np.testing.assert_array_equal(kept, by_hand)


def test_frames_that_are_there_are_not_made_again(scene, tmp_path):
    out = tmp_path / "x.gif"
    film.film_scene(scene, out, keep=True)
    folder = tmp_path / "x.gif.frames"
    gone = folder / "frame-00002.png"
    whole = gone.read_bytes()
    gone.unlink()
    again = film.film_scene(scene, out, keep=True)
    assert again["rendered"] == 1 and gone.read_bytes() == whole
    changed = film.film_scene(scene, out, keep=True, speed=0.5)
    assert changed["rendered"] == 4
    assert film.film_scene(scene, out, speed=0.5)["rendered"] == 0 and not folder.exists()


def test_a_film_that_is_stopped_goes_on_to_the_same_frames(scene, tmp_path, monkeypatch):
    film.film_scene(scene, tmp_path / "whole.gif", keep=True)
    real, count = film.Renderer.render, []

    def stopping(self, *arguments, **options):
        count.append(1)
        if len(count) == 3:
            import os
            import signal

            os.kill(os.getpid(), signal.SIGTERM)
        return real(self, *arguments, **options)

    monkeypatch.setattr(film.Renderer, "render", stopping)
    figures = film.film_scene(scene, tmp_path / "x.gif")
    assert figures["interrupted"] and figures["frames"] == 3 and figures["exit_code"] == 143
    about = json.loads((tmp_path / "x.gif.frames" / "film.json").read_text())
    assert about["state"] == 2
    rest = film.film_scene(scene, tmp_path / "x.gif", keep=True)
    assert rest["rendered"] == 1 and rest["frames"] == 4
    for number in range(4):
        name = f"frame-{number:05d}.png"
        assert (tmp_path / "x.gif.frames" / name).read_bytes() == (tmp_path / "whole.gif.frames" / name).read_bytes()


def test_a_traced_frame_is_kept_in_its_midst(scene, tmp_path):
    options = {"quality": "film", "samples": 3, "duration": 0.25}
    figures = film.film_scene(scene, tmp_path / "x.gif", keep=True, **options)
    assert figures["frames"] == 1


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"duration": -1}, "duration = -1 is not allowed"),
        ({"speed": 1000.0}, "speed = 1000"),
        ({"quality": "best"}, "quality = 'best'"),
        ({"fps": 240.0, "duration": 3600.0}, "at most 100,000"),
    ],
)
def test_what_no_film_has_is_said_in_a_sentence(scene, tmp_path, change, sentence):
    with pytest.raises(wt.WavetankError, match=sentence) as error:
        film.film_scene(scene, tmp_path / "x.mp4", **change)
    assert "\n" not in str(error.value)


def test_a_scene_without_a_film_is_filmed_from_where_it_is_seen_best(tmp_path):
    scene = wt.Scene.load("dam-break").changed(spacing=0.1)
    figures = film.film_scene(scene, tmp_path / "x.mp4", duration=0.1, fps=20.0, size=(64, 36), quality="draft")
    assert figures["frames"] == 2 and (tmp_path / "x.mp4").exists()
    assert film.camera_at(Film(), scene, 0.0, 0.0).eye == wt.Camera.framing(scene, 1280 / 720).eye


def test_a_film_is_no_part_of_what_the_water_feels(scene):
    assert wt.Simulation(scene).digest() == wt.Simulation(scene.changed(film=None)).digest()


def test_the_command_films(wavetank, tmp_path):
    (tmp_path / "x.toml").write_text(SCENE)
    done = wavetank("film", str(tmp_path / "x.toml"), "-o", str(tmp_path / "y.mp4"), "--fps", "2", "--json")
    assert done.returncode == 0 and json.loads(done.stdout.splitlines()[-1])["frames"] == 2
    wrong = wavetank("film", str(tmp_path / "x.toml"), "-o", str(tmp_path / "y.avi"))
    assert wrong.returncode == 1 and ".mp4" in wrong.stderr
