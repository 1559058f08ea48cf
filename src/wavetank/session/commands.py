"""All input is a command: plain validated data, from a window, a browser, a script or a recording.

A front makes commands from pointer and keys, `Session` carries them out in the order in which they came, between two
frames. What is refused is refused with one sentence and changes nothing.
"""

from collections.abc import Hashable
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from wavetank.foundation.door import check_plain
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Model, Quaternion, Vector, sentence
from wavetank.scene.light import HIGHEST, LOWEST
from wavetank.solids.shapes import AnySolid

FARTHEST = 1e5  # m: no place of interest is farther out
STRONGEST = 1e3  # m/s^2: a gravity above it is a slip of the finger
LONGEST_TEXT = 2_000_000  # characters of a scene file

Length = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Point = tuple[Length, Length, Length]
Share = Annotated[float, Field(ge=-2, le=3, allow_inf_nan=False)]
Angle = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]  # rad
Degrees = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]
Name = Annotated[str, Field(max_length=80)]
Pointer = Annotated[int, Field(ge=0, le=9)]
Value = bool | int | Annotated[float, Field(allow_inf_nan=False)] | Annotated[str, Field(max_length=80)] | Vector


class Command(Model):
    """One thing to do. `do` names its kind."""

    model_config = ConfigDict(frozen=True)
    fusible: ClassVar[tuple[str, ...]] = ()  # fields that tell what a later command of this kind replaces

    @property
    def slot(self) -> Hashable | None:
        """What this acts on, where the latest of several waiting commands is all that counts; else None."""
        name = type(self).model_fields["do"].default
        return (name, *(getattr(self, field) for field in self.fusible)) if self.fusible else None

    def after(self, earlier: "Command") -> "Command":
        """Return the one command that does what `earlier`, on the same target, and then this one do."""
        return self


class SetParameter(Command):
    """Set a live parameter."""

    do: Literal["set"] = "set"
    fusible: ClassVar = ("name",)
    name: Name
    value: Value


class Reset(Command):
    """Begin the scene anew, with parameters changed on the way where some are given."""

    do: Literal["reset"] = "reset"
    parameters: dict[Name, Value] = {}


class LoadScene(Command):
    """Begin another scene: a bundled one by name, or the text of a scene file."""

    do: Literal["load"] = "load"
    name: Name = ""
    text: Annotated[str, Field(max_length=LONGEST_TEXT)] = ""
    file: Annotated[str, Field(max_length=200)] = ""  # what the text is called where something is wrong with it
    particles: Annotated[int, Field(ge=0, le=100_000_000)] = 0  # about how many; 0 is as many as the scene says

    @model_validator(mode="after")
    def _one_of_both(self) -> "LoadScene":
        if bool(self.name) == bool(self.text):
            raise ValueError("give either the name of a bundled scene or the text of a scene file.")
        return self


class Undo(Command):
    """Go back to the world that was left by the last reset or scene, as it was; once more, and come back."""

    do: Literal["undo"] = "undo"


class _Ray(Command):
    origin: Point  # m
    direction: tuple[Length, Length, Length]
    pointer: Pointer = 0

    @model_validator(mode="after")
    def _has_direction(self) -> "_Ray":
        if sum(part * part for part in self.direction) < 1e-12:
            raise ValueError(f"direction = {self.direction} is too short; give a vector of about unit length.")
        return self


class ToolBegin(_Ray):
    """Put a tool down along a ray into the world."""

    do: Literal["tool-begin"] = "tool-begin"
    tool: Name
    options: dict[Name, Value] = {}


class ToolMove(_Ray):
    """Move the tool that is down."""

    do: Literal["tool-move"] = "tool-move"
    fusible: ClassVar = ("pointer",)


class ToolEnd(Command):
    """Lift the tool; one that lasts goes on."""

    do: Literal["tool-end"] = "tool-end"
    pointer: Pointer = 0


class ToolStop(Command):
    """Stop a tool that goes on by itself, or all of them."""

    do: Literal["tool-stop"] = "tool-stop"
    tool: Name = ""


class MoveSolid(Command):
    """Carry a solid to a pose, no faster than water can make way."""

    do: Literal["move-solid"] = "move-solid"
    fusible: ClassVar = ("name",)
    name: Name
    position: tuple[Length, Length] | Point | None = None  # m
    rotation: Quaternion | Angle | None = None


class AddSolid(Command):
    """Put a solid into the world."""

    do: Literal["add-solid"] = "add-solid"
    solid: AnySolid


class RemoveSolid(Command):
    """Take a solid out of the world."""

    do: Literal["remove-solid"] = "remove-solid"
    name: Name


class Pause(Command):
    """Stop time, or let it run."""

    do: Literal["pause"] = "pause"
    on: bool = True


class Step(Command):
    """Compute a few frames while time stands still."""

    do: Literal["step"] = "step"
    frames: Annotated[int, Field(ge=1, le=600)] = 1


class Speed(Command):
    """Set how much water time passes in a second: 1 is real time, below it is slow motion."""

    do: Literal["speed"] = "speed"
    fusible: ClassVar = ("do",)
    factor: Annotated[float, Field(ge=1 / 64, le=4, allow_inf_nan=False)]


class FrameLength(Command):
    """Divide frames into so many, and let them end with a time step of full length where that is sooner (`filled`).

    A session on a slow machine chooses it by itself. Frames in parts are slower water, but each has its picture; frames
    that end with a time step need fewer of these.
    """

    do: Literal["frame-length"] = "frame-length"
    fusible: ClassVar = ("do",)
    parts: Annotated[int, Field(ge=1, le=8)] = 1
    filled: bool = False


class Rewind(Command):
    """Go back to the last kept instant that is not after `time` [s of water]."""

    do: Literal["rewind"] = "rewind"
    fusible: ClassVar = ("do",)
    time: Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]


class Bookmark(Command):
    """Keep this instant under a name, go to it, or forget it."""

    do: Literal["bookmark"] = "bookmark"
    name: Annotated[str, Field(min_length=1, max_length=40)]
    action: Literal["set", "go", "forget"] = "set"


class SetCamera(Command):
    """Put the camera somewhere."""

    do: Literal["camera"] = "camera"
    fusible: ClassVar = ("do",)
    eye: Point  # m
    target: Point  # m
    up: Point = (0.0, 1.0, 0.0)
    field_of_view: Annotated[float, Field(gt=0.01, lt=3, allow_inf_nan=False)] = 0.4887
    height: Annotated[float, Field(gt=1e-6, le=FARTHEST, allow_inf_nan=False)] | None = None


class Orbit(Command):
    """Turn the camera around its target."""

    do: Literal["orbit"] = "orbit"
    fusible: ClassVar = ("do",)
    azimuth: Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)] = 0.0  # rad
    elevation: Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)] = 0.0  # rad

    def after(self, earlier: Command) -> Command:
        """Turns add up."""
        assert isinstance(earlier, Orbit)
        return Orbit.model_construct(
            azimuth=_within(self.azimuth + earlier.azimuth), elevation=_within(self.elevation + earlier.elevation)
        )


class Pan(Command):
    """Move the camera sideways, up and ahead, by shares of the height in view."""

    do: Literal["pan"] = "pan"
    fusible: ClassVar = ("do",)
    right: Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)] = 0.0
    up: Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)] = 0.0
    ahead: Annotated[float, Field(ge=-100, le=100, allow_inf_nan=False)] = 0.0

    def after(self, earlier: Command) -> Command:
        """Ways add up."""
        assert isinstance(earlier, Pan)
        return Pan.model_construct(
            right=_within(self.right + earlier.right),
            up=_within(self.up + earlier.up),
            ahead=_within(self.ahead + earlier.ahead),
        )


class Zoom(Command):
    """Show `factor` times as much height."""

    do: Literal["zoom"] = "zoom"
    fusible: ClassVar = ("do",)
    factor: Annotated[float, Field(ge=0.01, le=100, allow_inf_nan=False)]
    x: Share = 0.5  # of the picture's width and height: the place that stays where it is
    y: Share = 0.5

    def after(self, earlier: Command) -> Command:
        """Factors multiply."""
        assert isinstance(earlier, Zoom)
        return Zoom.model_construct(factor=min(100.0, max(0.01, self.factor * earlier.factor)), x=self.x, y=self.y)


class Home(Command):
    """Frame the whole world again."""

    do: Literal["home"] = "home"


class SetView(Command):
    """Choose what is drawn: a view of the renderer, what particles are coloured by, where a slice lies, forces."""

    do: Literal["view"] = "view"
    fusible: ClassVar = ("do",)
    view: Name = ""
    color_by: Name = ""
    axis: Literal["", "x", "y", "z"] = ""  # across which a slice lies
    place: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None  # of it along that, 0 to 1
    forces: bool | None = None  # whether what the water does to bodies is shown, as arrows and numbers

    def after(self, earlier: Command) -> Command:
        """What is not said again stays as it was said."""
        assert isinstance(earlier, SetView)
        return SetView.model_construct(
            view=self.view or earlier.view,
            color_by=self.color_by or earlier.color_by,
            axis=self.axis or earlier.axis,
            place=earlier.place if self.place is None else self.place,
            forces=earlier.forces if self.forces is None else self.forces,
        )


class SetLight(Command):
    """Choose an environment, and where its sun stands [deg]; `turn` and `rise` move the sun from there.

    Another environment begins with a sun of its own.
    """

    do: Literal["light"] = "light"
    fusible: ClassVar = ("do",)
    environment: Name = ""
    azimuth: Degrees | None = None  # from +z towards +x
    elevation: Annotated[float, Field(ge=LOWEST, le=HIGHEST, allow_inf_nan=False)] | None = None
    turn: Degrees = 0.0
    rise: Degrees = 0.0

    def after(self, earlier: Command) -> Command:
        """Turns add up, but for those before a sun that was put somewhere."""
        assert isinstance(earlier, SetLight)
        if self.environment:
            return self
        placed, raised = self.azimuth is not None, self.elevation is not None
        return SetLight.model_construct(
            environment=earlier.environment,
            azimuth=self.azimuth if placed else earlier.azimuth,
            elevation=self.elevation if raised else earlier.elevation,
            turn=self.turn if placed else (self.turn + earlier.turn) % 360.0,
            rise=self.rise if raised else min(360.0, max(-360.0, self.rise + earlier.rise)),
        )


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


def command_of(table: Any) -> Command:
    """Return the command that a plain table says; raise `WavetankError` with one sentence for what is none."""
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


def table_of(command: Command) -> dict[str, Any]:
    """Return a command as a plain table that `command_of` reads back: what was set, and what it is called."""
    table: dict[str, Any] = command.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    if isinstance(command, AddSolid):
        table["solid"]["shape"] = command.solid.shape
    return {"do": type(command).model_fields["do"].default, **table}


def _within(value: float) -> float:
    return min(100.0, max(-100.0, value))
