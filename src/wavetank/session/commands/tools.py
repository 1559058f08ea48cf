"""Commands of a pointer that holds a tool."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from wavetank.session.commands.command import Command, Length, Name, Point, Value
from wavetank.session.game import Game
from wavetank.session.state import SessionState
from wavetank.session.tools import Hand

Pointer = Annotated[int, Field(ge=0, le=9)]


class _Ray(Command):
    origin: Point  # m
    direction: tuple[Length, Length, Length]
    pointer: Pointer = 0

    @model_validator(mode="after")
    def _check_direction(self) -> "_Ray":
        if sum(part * part for part in self.direction) < 1e-12:
            raise ValueError(f"direction = {self.direction} is too short; give a vector of about unit length.")
        return self


class ToolBegin(_Ray):
    """Press a tool down along a ray into the world."""

    do: Literal["tool-begin"] = "tool-begin"
    tool: Name
    options: dict[Name, Value] = {}

    def as_allowed(self, game: Game) -> Command:
        """Return this with the options that the level fixes."""
        fixed = game.allow_tool(self.tool)
        return self.model_copy(update={"options": {**self.options, **fixed}}) if fixed else self

    def apply(self, state: SessionState) -> None:
        """Let the tool begin; the same pointer, or the same tool where it runs on by itself, ends first."""
        tool = state.tool_named(self.tool, self.options)
        if self.pointer in state.hands:
            state.end_tool(self.pointer)
        if tool.name in state.running:
            state.end_tool(tool.name)
        hand = Hand(state.sim, self.origin, self.direction, state.most_particles, tool.through_water)
        state.hands[self.pointer] = (tool, hand)
        if tool.tilts and state.untilted_gravity is None:
            state.untilted_gravity = tuple(state.sim.gravity)
        if state.awaits_touch:
            state.paused = state.awaits_touch = False
        state.run_tool(hand, tool.begin, hand)
        if state.game is not None:
            state.game.strokes += 1


class ToolMove(_Ray):
    """Move the tool that is down."""

    do: Literal["tool-move"] = "tool-move"
    coalesces_by: ClassVar = ("pointer",)

    def apply(self, state: SessionState) -> None:
        """Move it; without a tool down, do nothing."""
        if self.pointer in state.hands:
            tool, hand = state.hands[self.pointer]
            hand.aim(self.origin, self.direction)
            state.run_tool(hand, tool.move, hand)


class ToolEnd(Command):
    """Lift the tool; one with `keep` runs on."""

    do: Literal["tool-end"] = "tool-end"
    pointer: Pointer = 0

    def apply(self, state: SessionState) -> None:
        """Lift it."""
        if self.pointer in state.hands:
            tool, hand = state.hands[self.pointer]
            if tool.lasting:
                del state.hands[self.pointer]
                state.running[tool.name] = (tool, hand)
            else:
                state.end_tool(self.pointer)


class ToolStop(Command):
    """Stop a tool that runs on by itself, or all of them."""

    do: Literal["tool-stop"] = "tool-stop"
    tool: Name = ""

    def apply(self, state: SessionState) -> None:
        """Stop it."""
        for name in [name for name in state.running if self.tool in ("", name)]:
            state.end_tool(name)
