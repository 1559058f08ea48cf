"""What the person at the window has chosen: tool, options, page of the panel, parameters that wait for a reset."""

import dataclasses
import time
from collections import deque
from pathlib import Path
from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.page.about import hello_message
from wavetank.page.dropped import drop_mesh
from wavetank.page.keys import LOOK
from wavetank.page.window.engine import Engine
from wavetank.scene.scene import Scene
from wavetank.session.tools import TOOLS, describe

LOOK_TOOL = {
    **LOOK,
    "sentence": "Drag to turn the view. With any tool: the right button turns, the wheel zooms, the middle button or "
    "Shift moves; W A S D Q E fly while the right button is down.",
}
PATIENCE = 0.6  # s for which a value set here is shown before what the simulation says
LONGEST_SCENE = 2_000_000  # bytes of a dropped file
KEPT = 600  # points of a curve
FIRST_FRAMES = 2  # are compiled on the way; what they took would flatten every curve


@dataclasses.dataclass
class Desk:
    """All that the parts of the window share."""

    engine: Engine
    start_scene: Scene
    tools: list[dict[str, Any]] = dataclasses.field(default_factory=lambda: [LOOK_TOOL, *map(describe, TOOLS)])
    tool: str = "push"
    chosen: dict[str, dict[str, Any]] = dataclasses.field(default_factory=dict)  # options by tool
    pending: dict[str, Any] = dataclasses.field(default_factory=dict)  # parameters that wait for a reset
    panel: bool = True
    help: bool = False
    held: tuple[str, float] = ("", 0.0)  # the sign whose key may still be down, and when it was last read [s]
    filter: str = ""
    notes: list[tuple[str, float]] = dataclasses.field(default_factory=list)  # with the time at which they go
    curves: dict[str, deque[float]] = dataclasses.field(default_factory=dict)
    places: dict[str, tuple[float, float, float, float]] = dataclasses.field(default_factory=dict)  # of what is drawn
    banner_height: float = 160.0  # px
    _touched: dict[str, tuple[float, Any]] = dataclasses.field(default_factory=dict)
    _measured: int = 0
    _rules: dict[str, Any] | None = None  # the level's, that the tool in hand was last checked against

    def __post_init__(self) -> None:
        """Read the declarations."""
        self.declared = hello_message(self.engine.session)
        self.shown = self.engine.shown

    @property
    def game(self) -> dict[str, Any] | None:
        """How the game stands, where there is one."""
        return self.shown.game

    @property
    def rules(self) -> dict[str, Any] | None:
        """The tools that a level allows, with the options that it fixes; None where all are free."""
        return self.game["tools"] if self.game else None

    @property
    def rail(self) -> list[dict[str, Any]]:
        """The tools there are to choose from."""
        rules = self.rules
        return [tool for tool in self.tools if rules is None or tool["name"] == "look" or tool["name"] in rules]

    @property
    def hand(self) -> dict[str, Any]:
        """The tool in hand, without the options that are not free."""
        tool = next(tool for tool in self.tools if tool["name"] == self.tool)
        return {**tool, "options": [about for about in tool["options"] if about["name"] not in self.fixed]}

    @property
    def fixed(self) -> dict[str, Any]:
        """The options of the tool in hand that the level fixes."""
        return (self.rules or {}).get(self.tool, {})

    @property
    def options(self) -> dict[str, Any]:
        """What was chosen of its options; the rest is as declared."""
        return self.chosen.setdefault(self.tool, {})

    @property
    def status(self) -> dict[str, Any]:
        """What changes all the time."""
        return self.shown.status

    @property
    def world(self) -> dict[str, Any]:
        """What changes with the scene."""
        return self.shown.world

    def value(self, name: str) -> Any:
        """Return a parameter as it was last set here, or as it is."""
        if name in self.pending:
            return self.pending[name]
        when, value = self._touched.get(name, (-1e9, None))
        return value if time.perf_counter() - when < PATIENCE else self.world["values"][name]

    def set(self, about: dict[str, Any], value: Any) -> None:
        """Set a live parameter; one that is not waits for a reset."""
        from wavetank.session.commands import SetParameter

        if not about["live"]:
            self.pending[about["name"]] = value
            return
        self._touched[about["name"]] = (time.perf_counter(), value)
        self.engine.do(SetParameter, name=about["name"], value=value)

    def say(self, sentence: str) -> None:
        """Show a sentence for as long as it takes to read."""
        if sentence not in [note for note, _ in self.notes]:
            self.notes = [*self.notes[-3:], (sentence, time.perf_counter() + 2.5 + 0.045 * len(sentence))]

    def pass_time(self) -> None:
        """Take what this picture of the window shows, the same for all its parts; collect notes and curves."""
        self.shown = shown = self.engine.shown
        while not self.engine.notes.empty():
            self.say(self.engine.notes.get())
        self.notes = [note for note in self.notes if note[1] > time.perf_counter()]
        if self.rules != self._rules:
            self._rules = self.rules
            self.tool = next(iter(self._rules), "look") if self._rules is not None else self.tool
        if shown.measured != self._measured:
            self._measured = shown.measured
            if shown.status["ticks"] <= FIRST_FRAMES:
                return
            if self.curves.get("time") and shown.status["time"] < self.curves["time"][-1]:
                self.curves.clear()  # rewound, or another scene
            for name, value in {
                "time": shown.status["time"],
                **shown.figures,
                "frame_ms": shown.status["frame_ms"],
                "picture_ms": shown.status["picture_ms"],
            }.items():
                self.curves.setdefault(name, deque(maxlen=KEPT)).append(value)

    def open(self, path: Path) -> None:
        """Begin the scene of a file; what is wrong with it becomes a note."""
        try:
            if path.stat().st_size > LONGEST_SCENE:
                self.say(f"{path.name} is too large for a scene file.")
                return
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            self.say(f"{path.name} cannot be read: {error}.")
            return
        if not text:
            self.say(f"{path.name} is empty; drop the TOML file of a scene, or an OBJ.")
            return
        if path.suffix.lower() == ".obj":
            self._place_mesh(text, path.name)
            return
        if "mesh" in text:  # a command opens no files: the mesh goes into the text
            try:
                text = Scene.load(path).text()
            except WavetankError as error:
                self.say(str(error))
                return
        self.begin(text=text, file=path.name[:200])

    def _place_mesh(self, text: str, file: str) -> None:
        """Let the mesh of an OBJ become a solid; what is wrong with it becomes a note."""
        answer = self.engine.call(lambda: drop_mesh(self.engine.session, text, file))
        answer.add_done_callback(lambda answer: self.engine.notes.put(answer.result()))

    def begin(self, **which: str) -> None:
        """Begin a bundled scene or level by `name`, or one whose file says `text`."""
        from wavetank.session.commands import LoadScene

        self.pending.clear()
        self.engine.do(LoadScene, **which)
