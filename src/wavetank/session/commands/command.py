"""What every command has: a validated model that says what to do and applies itself to a session."""

from collections.abc import Hashable, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import ConfigDict, Field

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Model, Vector
from wavetank.session.game import Game
from wavetank.session.state import SessionState

FARTHEST = 1e5  # m: limit of all coordinates

Length = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Point = tuple[Length, Length, Length]
Angle = Annotated[float, Field(ge=-1e4, le=1e4, allow_inf_nan=False)]  # rad
Name = Annotated[str, Field(max_length=80)]
Value = bool | int | Annotated[float, Field(allow_inf_nan=False)] | Annotated[str, Field(max_length=80)] | Vector


class Command(Model):
    """One thing to do; `do` names its kind."""

    model_config = ConfigDict(frozen=True)
    do: str
    coalesces_by: ClassVar[tuple[str, ...]] = ()  # fields that say which waiting command a later one replaces
    is_slow: ClassVar[bool] = False  # whether it may take longer than a frame, so that few may wait
    restarts: ClassVar[bool] = False  # whether it starts a scene, so that an earlier one that waits is pointless

    def apply(self, state: SessionState) -> None:
        """Do it; raises `WavetankError`, and changes nothing, where it is not allowed."""
        raise NotImplementedError

    def as_allowed(self, game: Game) -> "Command":
        """Return this as a level allows it; raises `WavetankError` where it does not."""
        return self

    @property
    def kind(self) -> str:
        """Its name in recordings and messages."""
        name: str = type(self).model_fields["do"].default
        return name

    @property
    def coalescing_key(self) -> Hashable | None:
        """Key of the waiting command that this one replaces; None where all of them count."""
        return (self.kind, *(getattr(self, field) for field in self.coalesces_by)) if self.coalesces_by else None

    def after(self, earlier: "Command") -> "Command":
        """Return one command with the effect of `earlier`, of the same key, followed by this one."""
        return self


class WorldEdit(Command):
    """A command that changes water or solids other than by a tool; levels forbid it."""

    def as_allowed(self, game: Game) -> Command:
        """Raise `WavetankError`."""
        raise WavetankError("A level does not allow changes of water or solids; use its tools, or another scene.")


def check_known(what: str, value: str, allowed: Sequence[str]) -> None:
    """Raise `WavetankError` for a name that is not `allowed`; "" means no change and passes."""
    if value and value not in allowed:
        raise WavetankError(f"{what} = {value!r} is not known; it must be one of {', '.join(allowed)}.")


def table_of(command: Command) -> dict[str, Any]:
    """Return a command as a plain table with the fields that were set; `command_of` reads it back."""
    table: dict[str, Any] = command.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    solid = getattr(command, "solid", None)
    if solid is not None:
        table["solid"]["shape"] = solid.shape
    return {"do": command.kind, **table}
