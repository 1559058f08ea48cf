import numpy as np
import pytest

import wavetank as wt
from wavetank.page import picture
from wavetank.session.pace import CATCH_UP, Pace
from wavetank.session.session import Session


@pytest.fixture
def session():
    return Session(
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(0.4, 0.4)), fluids=[wt.Block(lower=(0, 0), upper=(0.2, 0.2))])
    )


@pytest.fixture
def machine(session, monkeypatch):
    """A session on a machine whose frames and pictures take so many seconds; runs it and counts both."""
    clock, cost = [100.0], {}
    monkeypatch.setattr("wavetank.session.session.time.perf_counter", lambda: clock[0])  # of the module that all share
    painter = picture.Painter(session)

    class Canvas:
        def render(self, *_, **__):
            clock[0] += cost["picture"]
            return np.zeros((8, 8, 3), np.uint8)

    monkeypatch.setattr(painter, "_renderer", lambda *_: Canvas())
    monkeypatch.setattr(session, "tick", lambda: clock.__setitem__(0, clock[0] + cost["frame"]) or 1 / 60)

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
    assert pace.due == pytest.approx(5.0 - CATCH_UP)


def test_a_single_hitch_does_not_spoil_the_pace_but_slowness_does():
    """A frame that waits for a kernel says little; frames that take 0.2 s each do."""
    pace, now = Pace(), 0.0
    for n in range(30):
        now += 1.5 if n == 5 else 1 / 60
        pace.passed(now, 1 / 60, 1 / 60)
    assert pace.measured > 0.85
    for _ in range(100):
        now += 0.2
        pace.passed(now, 1 / 60, 1 / 60)
    assert pace.measured == pytest.approx(1 / 12, rel=0.05)


@pytest.mark.parametrize("seconds_per_pixel", [1e-9, 5e-8, 1e-7, 1e-6])
def test_the_size_of_pictures_settles(session, monkeypatch, seconds_per_pixel):
    """The first picture of a size takes 80 ms more; what follows from that must not be another size."""
    clock, sizes = [100.0], []
    monkeypatch.setattr("wavetank.page.picture.time.perf_counter", lambda: clock[0])

    class Canvas:
        def __init__(self, width, height):
            self.size, self.extra = (width, height), 0.08

        def render(self, *_, **__):
            clock[0] += 0.006 + self.extra + seconds_per_pixel * self.size[0] * self.size[1]
            self.extra = 0.0
            sizes.append(self.size[0] / 960)
            return np.zeros((8, 8, 3), np.uint8)

    monkeypatch.setattr(picture, "Renderer", Canvas)
    painter = picture.Painter(session)
    for _ in range(60):
        painter.paint()
    assert len(set(sizes[20:])) == 1
    costs = {share: 0.006 + seconds_per_pixel * 960 * 540 * share**2 for share in picture.SHARES}
    settled = min(picture.SHARES, key=lambda share: abs(share - sizes[-1]))
    assert costs[settled] <= picture.HYSTERESIS * picture.PICTURE_TIME or settled == picture.SHARES[0]
    larger = [share for share in picture.SHARES if share > settled]
    assert not larger or picture.HYSTERESIS**2 * costs[larger[0]] > picture.PICTURE_TIME
