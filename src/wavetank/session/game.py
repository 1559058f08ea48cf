"""A game: one attempt at the goal of a level, and its outcome."""

from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.scene.goal import Aim, Goal
from wavetank.session.measures import counted, measure
from wavetank.session.tools import TOOL_NAMES
from wavetank.simulation.frame import Frame

HARMLESS = ("foam", "foam_lifetime")  # parameters that do not act on the water


class Game:
    """Judges one attempt at a goal. Raises `WavetankError` for a goal with unknown tools."""

    def __init__(self, goal: Goal, frame: Frame) -> None:
        for name, options in (goal.tools or {}).items():
            if name not in TOOL_NAMES:
                raise WavetankError(f"goal.tools: {name!r} is not a tool; those are {', '.join(TOOL_NAMES)}.")
            TOOL_NAMES[name].parse(options, f"goal.tools.{name}")
        self.goal = goal
        self.outcome = ""  # won or lost, at the end
        self.elapsed = 0.0  # s of water that were computed; going back does not lower it
        self.held = 0.0  # s for which all aims have been met
        self.strokes = 0
        self.worst = 0.0  # largest value so far of forbidding aims, over their limits
        self.start = [int(counted(aim, frame).sum()) for aim in goal.aims]
        self.values = [0.0] * len(goal.aims)
        self._measure(frame)

    def allow_tool(self, name: str) -> dict[str, Any]:
        """Return the options that the level fixes for a tool; raises `WavetankError` where it does not allow it now."""
        tools = self.goal.tools
        if tools is not None and name not in tools:
            known = ", ".join(tools) or "none"
            raise WavetankError(f"{name!r} is not allowed in this level; its tools are: {known}.")
        if self.goal.strokes is not None and self.strokes >= self.goal.strokes:
            raise WavetankError(f"All {self.goal.strokes} strokes are used; wait for the water or start again.")
        return (tools or {}).get(name) or {}

    def watch(self, frame: Frame, duration: float) -> None:
        """Judge a frame of `duration` [s]; once the game is over nothing changes."""
        if self.outcome:
            return
        self.elapsed += duration
        self._measure(frame)
        goal = self.goal
        met = all(aim.progress(value) >= 1.0 for aim, value in self._measured_aims())
        self.held = self.held + duration if met else 0.0
        if any(aim.forbids and value > aim.share for aim, value in self._measured_aims()):
            self.outcome = "lost"
        elif not goal.is_endured and met and self.held >= goal.hold:
            self.outcome = "won"
        elif self.elapsed >= goal.seconds - 1e-6:
            self.outcome = "won" if goal.is_endured else "lost"

    @property
    def progress(self) -> float:
        """Progress, 0 to 1: the mean of the aims, or the share of time where it only has to be endured."""
        if self.outcome == "won":
            return 1.0
        if self.goal.is_endured:
            return min(1.0, self.elapsed / self.goal.seconds)
        reached = [aim.progress(value) for aim, value in self._measured_aims() if not aim.forbids]
        return sum(reached) / len(reached)

    @property
    def mark(self) -> float:
        """What stars reward when small: time [s], or the worst share where time has to be endured."""
        return self.worst if self.goal.is_endured else self.elapsed

    @property
    def stars(self) -> int:
        """Stars, 1 to 3, of a win now: by time [s], or by how little of the allowed share got wet."""
        first, second = self.goal.stars or ((0.4, 0.75) if self.goal.is_endured else self._divide_time())
        return 0 if self.outcome == "lost" else 3 if self.mark <= first else 2 if self.mark <= second else 1

    def describe(self) -> dict[str, Any]:
        """Return the goal and its progress as plain data."""
        goal = self.goal
        return {
            "text": goal.text,
            "hint": goal.hint,
            "seconds": goal.seconds,
            "elapsed": self.elapsed,
            "hold": goal.hold,
            "held": self.held,
            "progress": self.progress,
            "outcome": self.outcome,
            "stars": self.stars,
            "endured": goal.is_endured,
            "tools": goal.tools,
            "strokes": None if goal.strokes is None else goal.strokes - self.strokes,
            "aims": [
                {
                    "kind": aim.kind,
                    "name": aim.name,
                    "value": value,
                    "share": aim.share,
                    "forbids": aim.forbids,
                    "progress": aim.progress(value),
                }
                for aim, value in self._measured_aims()
            ],
        }

    def _measure(self, frame: Frame) -> None:
        self.values = [measure(aim, frame, start) for aim, start in zip(self.goal.aims, self.start, strict=True)]
        self.worst = max([self.worst, *(value / aim.share for aim, value in self._measured_aims() if aim.forbids)])

    def _measured_aims(self) -> list[tuple[Any, float]]:
        aims: list[Aim] = [*self.goal.aims]
        return list(zip(aims, self.values, strict=True))

    def _divide_time(self) -> tuple[float, float]:
        return self.goal.seconds / 3.0, 2.0 * self.goal.seconds / 3.0
