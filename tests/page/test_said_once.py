"""Colours, keys and paces of page and window are declared once."""

import re
from pathlib import Path

import pytest

from wavetank.page import keys, theme
from wavetank.session.commands import Step, command_of

PAGE = Path(theme.__file__).parent
FILES = [*(PAGE / "window").glob("*.py"), *(PAGE / "static").glob("*.js"), PAGE / "static/style.css"]
ACTIONS = {key.action for key in keys.KEYS if key.action}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_colour_of_the_theme_is_said_again(path):
    said = set(re.findall(r"#[0-9a-f]{6}", path.read_text()))
    assert not said & {*theme.COLORS.values(), *(paint for paint, _ in theme.PAINTS)}


def test_the_page_knows_every_colour_that_it_asks_for():
    text = "\n".join(path.read_text() for path in FILES)
    sheet = theme.style_sheet() + (PAGE / "static/style.css").read_text()
    asked = {*re.findall(r"var\(--([\w-]+)", text), *re.findall(r'colour\("([\w-]+)"\)', text)}
    assert len(asked) > 20
    assert {name for name in asked if f"--{name}:" not in sheet} == {"share"}, "a slider sets its share itself"


def test_every_key_does_one_thing():
    assert len({key.key for key in keys.KEYS}) == len(keys.KEYS)
    for key in keys.KEYS:
        assert bool(key.action) != bool(key.command), key
        assert bool(key.label) == bool(key.text), key
        if key.command:
            command_of(key.command)
    assert command_of(next(key.command for key in keys.KEYS if key.key == ".")) == Step()


def test_the_page_has_every_action():
    script = (PAGE / "static/main.js").read_text()
    table = script.partition("const ACTIONS = {")[2].partition("\n};")[0]
    for action in ACTIONS:
        assert re.search(rf"""(^|[\s"]){action}"?: """, table), action


def test_the_window_has_every_action():
    pytest.importorskip("imgui_bundle")
    from wavetank.page.window.keys import ACTIONS as here

    assert set(here) == {key.action for key in keys.KEYS if key.action and not key.page_only}


def test_the_nearest_pace_is_found():
    assert [keys.nearest_speed(factor) for factor in (0.01, 0.2, 0.9, 40.0)] == [0, 2, 4, 5]
