"""Without any display: pictures reach a texture through EGL, at whatever size, and come back as they were."""

import ctypes
import os
import time

import numpy as np
import pytest

import wavetank as wt
from wavetank.page.window.engine import Engine
from wavetank.session.session import Session


@pytest.fixture
def context(monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    import moderngl

    try:
        made = moderngl.create_context(standalone=True, backend="egl")
    except Exception as error:
        if os.environ.get("CI") == "true":
            pytest.fail(f"no EGL here ({error}); .ci/run installs it with apt-get")
        pytest.skip(f"no EGL here ({error}): apt-get install libegl1 libgl1-mesa-dri")
    yield made
    made.release()
    ctypes.CDLL("libEGL.so.1").eglReleaseThread()  # it is still current, and no window could open in this process


def on_graphics(plate) -> np.ndarray:
    width, height = plate.texture.size
    return np.frombuffer(plate.texture.read(alignment=1), np.uint8).reshape(height, width, 3)


def test_pictures_of_any_size_arrive(context):
    from wavetank.page.window.plate import Plate

    sim, plate = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.05)), Plate(context)
    for width, height in ((63, 41), (63, 41), (130, 77), (1, 1)):
        image = wt.render(sim, width, height)
        plate.show(image)
        np.testing.assert_array_equal(on_graphics(plate), image)
        sim.step()
    plate.show(image[:, ::-1])
    np.testing.assert_array_equal(on_graphics(plate), image[:, ::-1])
    plate.release()
    assert plate.texture is None


def test_a_world_is_played_without_a_display(context):
    """The window's engine and its texture, without the window: commands go in, other pictures come out."""
    from wavetank.page.window.plate import Plate
    from wavetank.session import commands

    engine, plate = Engine(Session(wt.Scene.load("dam-break-2d").changed(spacing=0.05))), Plate(context)

    def picture(after: int) -> int:
        end = time.monotonic() + 120.0
        while engine.shown.number <= after and time.monotonic() < end:
            time.sleep(0.01)
        plate.show(engine.shown.image)
        return engine.shown.number

    engine.size = (320, 200)
    engine.start()
    try:
        number = picture(0)
        first = on_graphics(plate)
        assert first.std() > 10
        picture(number + 20)  # the water falls, and drafts may be smaller
        late = on_graphics(plate)
        assert late.shape != first.shape or (late != first).any()
        engine.do(commands.SetParameter, name="viscosity", value=0.4)
        picture(engine.shown.number + 2)
        assert engine.session.sim.viscosity == 0.4
    finally:
        engine.stop()
        plate.release()
    assert engine.failure is None
