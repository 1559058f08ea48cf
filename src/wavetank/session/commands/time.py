"""Commands for time: pause, steps, speed, the past."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from wavetank.foundation.errors import WavetankError
from wavetank.session.commands.command import Command
from wavetank.session.history import BOOKMARKS
from wavetank.session.state import SessionState


class Pause(Command):
    """Pause, or resume."""

    do: Literal["pause"] = "pause"
    on: bool = True

    def apply(self, state: SessionState) -> None:
        """Pause or resume."""
        state.paused, state.steps_left, state.awaits_touch = self.on, 0, False


class Step(Command):
    """Pause and compute a number of frames."""

    do: Literal["step"] = "step"
    frames: Annotated[int, Field(ge=1, le=600)] = 1

    def apply(self, state: SessionState) -> None:
        """Pause, and let the session compute them."""
        state.paused, state.awaits_touch = True, False
        state.steps_left += self.frames


class Speed(Command):
    """Set how much simulated time passes in a second: 1 is real time, less is slow motion."""

    do: Literal["speed"] = "speed"
    coalesces_by: ClassVar = ("do",)
    factor: Annotated[float, Field(ge=1 / 64, le=4, allow_inf_nan=False)]

    def apply(self, state: SessionState) -> None:
        """Set it."""
        state.speed = self.factor
        state.pace.stop()


class FrameLength(Command):
    """Divide each frame into `parts`; with `filled` a frame ends early, after a time step of full length.

    A session on a slow machine issues it by itself. Parts make the water slower, but each has its picture; frames that
    end with a full time step need fewer time steps.
    """

    do: Literal["frame-length"] = "frame-length"
    coalesces_by: ClassVar = ("do",)
    parts: Annotated[int, Field(ge=1, le=8)] = 1
    filled: bool = False

    def apply(self, state: SessionState) -> None:
        """Set both."""
        state.frame_parts, state.fills_frames = self.parts, self.filled


class Rewind(Command):
    """Go back to the last recorded instant that is not after `time` [s of water]."""

    do: Literal["rewind"] = "rewind"
    coalesces_by: ClassVar = ("do",)
    is_slow: ClassVar = True
    time: Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]

    def apply(self, state: SessionState) -> None:
        """Go back; without any instant, do nothing."""
        snapshot = state.history.before(self.time)
        if snapshot is not None:
            state.restore(snapshot)


class Bookmark(Command):
    """Store this instant under a name, go to it, or delete it."""

    do: Literal["bookmark"] = "bookmark"
    is_slow: ClassVar = True
    name: Annotated[str, Field(min_length=1, max_length=40)]
    action: Literal["set", "go", "forget"] = "set"

    def apply(self, state: SessionState) -> None:
        """Store, go to or delete it."""
        bookmarks = state.history.bookmarks
        if self.action == "set":
            if len(bookmarks) >= BOOKMARKS and self.name not in bookmarks:
                raise WavetankError(f"there are {BOOKMARKS} bookmarks already; delete one first.")
            bookmarks[self.name] = state.sim.snapshot().pack()
            return
        if self.name not in bookmarks:
            raise WavetankError(f"there is no bookmark {self.name!r}; there are: {', '.join(bookmarks) or 'none'}.")
        if self.action == "go":
            state.restore(bookmarks[self.name].unpack())
        else:
            del bookmarks[self.name]
