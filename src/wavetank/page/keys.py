"""Keys of page and window, speeds of time, and the tool that only moves the camera."""

import dataclasses
from typing import Any


@dataclasses.dataclass(frozen=True)
class Key:
    """A key, with a command as a plain table, or the name of an action of page and window."""

    key: str  # a character, or a name as in a browser's `KeyboardEvent.key`
    label: str = ""  # in the list of keys, with `text`; keys without one share the row of another
    text: str = ""
    action: str = ""
    command: dict[str, Any] | None = None
    page_only: bool = False
    repeats: bool = False  # while held; toggles do not


KEYS = (
    Key(" ", "Space", "Play, pause", "pause"),
    Key(".", ".", "One frame", command={"do": "step"}, repeats=True),
    Key(",", ",", "One second back", "back", repeats=True),
    Key("r", "R", "Restart the scene", "again"),
    Key("[", "[ ]", "Slower, faster", "slower", repeats=True),
    Key("]", action="faster", repeats=True),
    Key("m", "M", "Bookmark", "bookmark"),
    Key("h", "H", "Reset the view", command={"do": "home"}),
    Key("Escape", "Esc", "Stop all tools", command={"do": "tool-stop"}),
    Key("f", "F", "Full screen", "full-screen", page_only=True),
    Key("c", "C", "Show or hide the controls", "panel"),
    Key("z", "Z", "Undo a reset or a change of scene", command={"do": "undo"}),
    Key("Enter", "Enter", "Use the tool by keyboard: arrows aim, Enter presses and releases", "aim", page_only=True),
    Key("+", "+ −", "Zoom in, out", command={"do": "zoom", "factor": 0.85}, repeats=True),
    Key("-", command={"do": "zoom", "factor": 1.18}, repeats=True),
    Key("ArrowLeft", "Arrows", "Turn the view", command={"do": "orbit", "azimuth": -0.12}, repeats=True),
    Key("ArrowRight", command={"do": "orbit", "azimuth": 0.12}, repeats=True),
    Key("ArrowUp", command={"do": "orbit", "elevation": 0.08}, repeats=True),
    Key("ArrowDown", command={"do": "orbit", "elevation": -0.08}, repeats=True),
    Key("n", "N", "Forces on bodies: buoyancy, drag, power", "forces"),
    Key("<", "< >", "Turn the sun", command={"do": "light", "turn": -10}, repeats=True),
    Key(">", command={"do": "light", "turn": 10}, repeats=True),
    Key("{", "{ }", "Lower, raise the sun", command={"do": "light", "rise": -4}, repeats=True),
    Key("}", command={"do": "light", "rise": 4}, repeats=True),
    Key("?", "?", "This list", "help"),
)

#: choices of seconds of water in a second, and their labels
SPEEDS = ((1 / 16, "1/16 ×"), (1 / 8, "1/8 ×"), (1 / 4, "1/4 ×"), (1 / 2, "1/2 ×"), (1.0, "1 ×"), (2.0, "2 ×"))

#: the tool that only moves the camera, and makes no command
LOOK: dict[str, Any] = {
    "name": "look",
    "label": "Look",
    "key": "l",
    "options": [],
    "cursor": False,
    "takes": "",
    "icon": "M2 12c3-5 6.500-7 10-7s7 2 10 7c-3 5-6.500 7-10 7s-7-2-10-7zM12 9a3 3 0 1 1 0 6 3 3 0 0 1 0-6",
    "sentence": "Drag to turn the view. With any tool: right button or two fingers turn, wheel or pinch zooms, middle "
    "button or Shift moves.",
}


def nearest_speed(factor: float) -> int:
    """Return the index of the nearest entry of `SPEEDS`."""
    return min(range(len(SPEEDS)), key=lambda n: abs(SPEEDS[n][0] - factor))
