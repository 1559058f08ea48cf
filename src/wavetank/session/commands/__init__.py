"""All input is a command: validated data from a page, a notebook, a window, a script or a recording.

A `Session` applies commands in the order in which they came, between two frames. A command that is refused raises one
sentence and changes nothing.
"""

from typing import Any

from pydantic import TypeAdapter, ValidationError

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import check_plain
from wavetank.foundation.model import sentence
from wavetank.session.commands.command import Command, table_of
from wavetank.session.commands.picture import Home, Orbit, Pan, SetCamera, SetLight, SetView, Zoom
from wavetank.session.commands.time import Bookmark, FrameLength, Pause, Rewind, Speed, Step
from wavetank.session.commands.tools import ToolBegin, ToolEnd, ToolMove, ToolStop
from wavetank.session.commands.world import AddSolid, LoadScene, MoveSolid, RemoveSolid, Reset, SetParameter, Undo

COMMANDS: tuple[type[Command], ...] = (
    SetParameter,
    Reset,
    LoadScene,
    Undo,
    ToolBegin,
    ToolMove,
    ToolEnd,
    ToolStop,
    MoveSolid,
    AddSolid,
    RemoveSolid,
    Pause,
    Step,
    Speed,
    FrameLength,
    Rewind,
    Bookmark,
    SetCamera,
    Orbit,
    Pan,
    Zoom,
    Home,
    SetView,
    SetLight,
)
_BY_NAME: dict[str, type[Command]] = {kind.model_fields["do"].default: kind for kind in COMMANDS}
_TABLE: TypeAdapter[dict[str, Any]] = TypeAdapter(dict[str, Any])

__all__ = [
    "COMMANDS",
    "AddSolid",
    "Bookmark",
    "Command",
    "FrameLength",
    "Home",
    "LoadScene",
    "MoveSolid",
    "Orbit",
    "Pan",
    "Pause",
    "RemoveSolid",
    "Reset",
    "Rewind",
    "SetCamera",
    "SetLight",
    "SetParameter",
    "SetView",
    "Speed",
    "Step",
    "ToolBegin",
    "ToolEnd",
    "ToolMove",
    "ToolStop",
    "Undo",
    "Zoom",
    "command_of",
    "table_of",
]


def command_of(table: Any) -> Command:
    """Return the command that a plain table stands for; raises `WavetankError` for a table that is not a command."""
    try:
        keys = _TABLE.validate_python(table, strict=True)
    except ValidationError:
        raise WavetankError("a command must be a table with the key 'do'.") from None
    kind = _BY_NAME.get(keys["do"]) if isinstance(keys.get("do"), str) else None
    if kind is None:
        known = ", ".join(_BY_NAME)
        raise WavetankError(f"do = {str(keys.get('do'))[:40]!r} is not a command; it must be one of {known}.")
    check_plain(keys, "a command")
    try:
        return kind.model_validate(keys, context={"files": False})
    except ValidationError as report:
        raise WavetankError(f"{keys['do']}: {sentence(report, kind)}") from None
