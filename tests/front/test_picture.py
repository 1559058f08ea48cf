import numpy as np
import pytest

import wavetank as wt
from wavetank.front import picture
from wavetank.pace import MADE_GOOD, Pace
from wavetank.session import Session


@pytest.fixture
def session():
    return Session(
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(0.4, 0.4)), fluids=[wt.Block(lower=(0, 0), upper=(0.2, 0.2))])
    )


@pytest.fixture
def machine(session, monkeypatch):
    """A session on a machine whose frames and pictures take so many seconds; runs it and counts both."""
    clock, cost = [100.0], {}
    for module in (picture, __import__("wavetank.session", fromlist=["time"])):
        monkeypatch.setattr(f"{module.__name__}.time.perf_counter", lambda: clock[0])
    painter = picture.Painter(session)

    class Canvas:
        def render(self, *_, **__):
            clock[0] += cost["picture"]
            return np.zeros((8, 8, 3), np.uint8)

    monkeypatch.setattr(painter, "_renderer", lambda *_: Canvas())
    monkeypatch.setattr(session, "tick", lambda: clock.__setitem__(0, clock[0] + cost["frame"]))

    def run(seconds: float, frame: float, picture: float) -> tuple[int, int]:
        cost.update(frame=frame, picture=picture)
        frames = pictures = 0
        start = clock[0]
        while clock[0] < start + seconds:
            frames += session.turn()
            if painter.is_due(clock[0]):
                painter.paint()
                pictures += 1
            clock[0] += 0.0005
        return frames, pictures

    run.session, run.painter = session, painter
    return run


def test_a_machine_too_slow_for_all_pictures_keeps_the_waters_pace(machine):
    """Frames of 8 ms and pictures of 25: one for one they would be at half of real time."""
    machine(3.0, 0.008, 0.025)
    frames, pictures = machine(5.0, 0.008, 0.025)
    assert frames == pytest.approx(5.0 * 60.0, rel=0.05)
    assert 5.0 * 13.0 < pictures < 5.0 * 30.0


def test_pictures_do_not_end_where_the_water_is_slow_anyway(machine):
    machine(3.0, 0.1, 0.02)
    _, pictures = machine(5.0, 0.1, 0.02)
    assert pictures >= 5.0 / 0.125


def test_a_fast_machine_shows_every_frame(machine):
    machine(3.0, 0.1, 0.02)  # it was slow
    machine(2.0, 0.002, 0.004)
    frames, pictures = machine(5.0, 0.002, 0.004)
    assert frames == pytest.approx(5.0 * 60.0, rel=0.02)
    assert pictures >= 0.98 * frames


def test_nothing_waits_for_resting_water(machine):
    machine(3.0, 0.1, 0.02)
    machine.session.paused = True
    assert machine.painter.is_due(0.0)


def test_pace_is_the_water_over_the_time_it_took():
    """Frames that a picture delays count by their time: 0.05 s of water in 0.08 s, whatever the single frames say."""
    pace, now = Pace(), 0.0
    for n in range(300):
        now += (0.06, 0.01, 0.01)[n % 3]
        pace.passed(now, 1 / 60, 1 / 60)
    assert pace.measured == pytest.approx(0.05 / 0.08, rel=0.12)


def test_only_a_picture_of_lateness_is_made_good():
    pace = Pace()
    pace.passed(0.0, 1 / 60, 1 / 60)
    pace.passed(5.0, 1 / 60, 1 / 60)
    assert pace.wait(5.0) == 0.0
    assert pace.due == pytest.approx(5.0 - MADE_GOOD)
