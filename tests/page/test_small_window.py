"""A window of 760 x 520 px: nothing lies over anything else, and the panel comes and goes."""

import os
from pathlib import Path

import pytest
from test_window import Person, display  # noqa: F401

import wavetank as wt
from wavetank.page import play
from wavetank.session.session import Session

SIZE = (760, 520)


def overlap(a, b) -> bool:
    return min(a[2], b[2]) - max(a[0], b[0]) > 1.0 and min(a[3], b[3]) - max(a[1], b[1]) > 1.0


@pytest.mark.parametrize("name", ["drop-2d", "over-the-wall"])
def test_nothing_overlaps(display, monkeypatch, name):  # noqa: F811
    monkeypatch.setenv("DISPLAY", display.name)
    assert play.why_no_window() is None
    from wavetank.page.window.window import Window

    window = Window(Session(wt.Scene.load(name)), SIZE)
    window.open()
    try:
        person = Person(display, window)
        person.until(lambda: window.engine.shown.number > 1)
        for panel in (False, True):
            assert window.desk.panel is False or panel
            window.desk.panel = panel
            person.look(0.3)
            places = dict(window.desk.places)
            parts = {one: box for one, box in places.items() if one.startswith("part.")}
            assert {"part.tools", "part.stage", "part.time"} <= parts.keys()
            assert ("part.panel" in parts) == panel
            cards = {one: box for one, box in places.items() if one.startswith("card.")}
            assert len(cards) == (2 if "wall" in name else 1)
            for boxes in (parts, cards):
                names = sorted(boxes)
                assert [
                    (a, b) for k, a in enumerate(names) for b in names[k + 1 :] if overlap(boxes[a], boxes[b])
                ] == []
            for box in parts.values():
                assert min(box[0], box[1]) >= -1
                assert box[2] <= SIZE[0] + 1
                assert box[3] <= SIZE[1] + 1
            if folder := os.environ.get("WAVETANK_PICTURES"):  # to look at
                from PIL import Image

                Image.fromarray(window.screenshot()).save(Path(folder) / f"{name}-{SIZE[0]}-{panel}.png")
            rail = [box for one, box in places.items() if one.startswith("tool.")]
            assert max(box[3] for box in rail) <= SIZE[1], "every tool is in sight"
    finally:
        window.close()
