"""A session: a world, the commands that act on it, its history, and time.

Commands are submitted from any thread; everything else happens in the one thread that calls `turn`.
"""

import math
import threading
import time
from collections.abc import Callable
from typing import Any

from wavetank.foundation.errors import NotFiniteError, WavetankError
from wavetank.foundation.input_limits import explain_errors
from wavetank.scene.scene import Scene
from wavetank.session.commands import Command, FrameLength
from wavetank.session.history import History
from wavetank.session.state import SessionState
from wavetank.simulation.simulation import Simulation

MOST_PARTICLES = 200_000
SLOW_FRAME, FAST_FRAME = 0.045, 0.025  # s of computing: above it frames are divided, below it less so
MOST_PARTS = 8  # of a frame; shorter time steps would turn density errors into velocity
FRAME_PER_PICTURE = 1.0  # least time of a frame over that of its picture, or pictures would take most of the time
MOST_SLOW = 8  # slow commands in the queue
PAUSE, SHORTEST_PAUSE = 2.0, 0.1  # until the next slow command: times what the last one took, and s at least
QUICK = 0.02  # s after which other commands wait for the next frame
LONGEST_NOTE = 400  # characters
Report = Callable[[str], None] | None  # takes the reason why a command failed
Waiting = tuple[Command, Report]
MOST_WAITING = 256  # commands in the queue; more are dropped


class Session(SessionState):
    """A running world to which commands are applied.

    `log` lists every command that took effect, with the number of frames computed before it: `recording` writes it.
    """

    def __init__(
        self,
        scene: Scene,
        arch: str = "cpu",
        *,
        most_particles: int = MOST_PARTICLES,
        history: History | None = None,
        own: Simulation | None = None,
    ) -> None:
        super().__init__(Scene.checked(scene), arch, most_particles, history or History(), own)
        self.ticks = 0  # frames computed since the session started; going back does not lower it
        self.log: list[tuple[int, Command]] = []
        self.smooth = False  # whether frames are divided on a slow machine
        self.picture_seconds = 0.0  # s that a picture takes, for that choice
        self.changes = 0  # increases whenever a picture would look different
        self.unrecorded_forces: set[str] = set()  # names of forces that a script added or removed
        self._waiting: list[Waiting] = []
        self._slow_after = 0.0  # s of `perf_counter`, until which slow commands wait
        self._slow_began: float | None = None  # s, likewise: the last one, until the first frame after it
        self._latest: dict[Any, int] = {}
        self._lock, self._wake = threading.Lock(), threading.Event()

    @classmethod
    def of(cls, sim: Simulation) -> "Session":
        """Return a session of a given simulation, which stays the same object after resets and other scenes.

        Only commands are recorded, not calls such as `sim.advance`.
        """
        scene = sim.scene.model_copy(deep=True)
        return cls(scene, sim.arch or "cpu", most_particles=max(MOST_PARTICLES, 2 * sim.count), own=sim)

    # --- commands ---

    def submit(self, command: Command, report_refusal: Report = None) -> bool:
        """Queue a command, from any thread; return whether there was room.

        Where it fails, `report_refusal` is called with the reason, in the simulation's thread; by default it becomes a
        note to all viewers. At most `MOST_SLOW` slow commands wait, and only the last one that restarts.
        """
        with self._lock:
            key = command.coalescing_key
            if command.restarts:
                kept = [other for other in self._waiting if not other[0].restarts]
                if len(kept) != len(self._waiting):
                    self._waiting = kept
                    self._latest.clear()
            elif command.is_slow:
                if sum(other.is_slow for other, _ in self._waiting) >= MOST_SLOW:
                    return False
            if key is not None and key in self._latest:
                place = self._latest[key]
                self._waiting[place] = command.after(self._waiting[place][0]), report_refusal
            elif len(self._waiting) >= MOST_WAITING:
                return False
            else:
                if key is None:
                    # Later commands must not overtake this one.
                    self._latest.clear()
                else:
                    self._latest[key] = len(self._waiting)
                self._waiting.append((command, report_refusal))
        self._wake.set()
        return True

    def drain(self, *, defer_slow: bool = False) -> int:
        """Apply the queued commands in order and return how many; failures become notes.

        With `defer_slow` most of the time remains for the water: a slow command, and all after it, wait until twice the
        time has passed that the last slow one took up to the first frame after it; all wait for the next frame once
        some have taken `QUICK`.
        """
        began = time.perf_counter()
        with self._lock:
            commands, self._waiting = self._waiting, []
            self._latest.clear()
        for number, (command, report_refusal) in enumerate(commands):
            if defer_slow and self._must_wait(command, began):
                with self._lock:
                    self._waiting[:0] = commands[number:]
                    self._latest.clear()  # positions have changed: no coalescing with those ahead
                return number
            self._apply_safely(command, report_refusal)
        return len(commands)

    def _must_wait(self, command: Command, began: float) -> bool:
        """Return whether a command waits, in a drain that began at that time [s]."""
        now, is_settling = time.perf_counter(), self._slow_began is not None and not self.paused
        return now > began + QUICK or (command.is_slow and (is_settling or now < self._slow_after))

    def _slow_has_ended(self) -> None:
        """Space the next slow command by what the last one has taken until now."""
        if self._slow_began is not None:
            end = time.perf_counter()
            self._slow_after = end + max(PAUSE * (end - self._slow_began), SHORTEST_PAUSE)

    def _apply_safely(self, command: Command, report_refusal: Report) -> None:
        """Apply one command; any error is reported to its sender, and the water continues."""
        began, self.report_refusal = time.perf_counter(), report_refusal or self.note
        try:
            with explain_errors(f"The command {command.kind!r} failed", "command"):
                self.apply(command)
        except WavetankError as error:
            self.report_refusal(str(error)[:LONGEST_NOTE])
        self.report_refusal = self.note
        if command.is_slow:
            self._slow_began = began
            self._slow_has_ended()

    def apply(self, command: Command) -> None:
        """Apply one command now; raises `WavetankError` and changes nothing where it is not allowed."""
        if self.game is not None:
            command = command.as_allowed(self.game)
        command.apply(self)
        self.log.append((self.ticks, command))
        self.changes += 1

    # --- time ---

    @property
    def frame_duration(self) -> float:
        """Seconds of water in a frame [s]; less in slow motion, but not below a good time step."""
        longest = self.sim.scene.frame_time * min(1.0, max(self.speed, 1.0 / MOST_PARTS), 1.0 / self.frame_parts)
        try:
            return self.sim.full_steps_time(longest) if self.fills_frames else longest
        except WavetankError:  # computing the frame will raise it
            return longest

    def tick(self) -> float:
        """Compute one frame, with the tools in use, and return its duration [s of water]."""
        duration = self.frame_duration
        self._note_uncommanded_forces()
        for tool, hand in [*self.hands.values(), *self.running.values()]:
            hand.pass_time(duration)
            self.run_tool(hand, tool.hold, hand, duration)
        self.carry_solids(duration)
        self._advance(duration)
        if not self.sim.pushed:  # else no frame was due yet, and they still wait for it
            self.tool_forces = []
        self.ticks += 1
        self.changes += 1
        if self.game is not None:
            self.game.watch(self.sim.frame(measured=False), duration)
        self.history.forget_from(self.sim.time)
        if self.history.is_due(self.sim.time):
            self.history.record(self.sim.snapshot())
        return duration

    def _advance(self, duration: float) -> None:
        """Advance the water; an error pauses it and becomes a note."""
        try:
            self.sim.advance(duration)
        except WavetankError as error:
            self.paused, self.steps_left = True, 0
            self.note(str(error))
            if isinstance(error, NotFiniteError):
                self._go_back()
        for sentence in self.sim.notes:
            self.note(sentence)
        self.sim.notes.clear()

    def _go_back(self) -> None:
        """Go back to the last instant of the history without non-finite values."""
        instant = self.history.last_finite()
        if instant is not None:
            self.restore(instant)
            self.note(
                f"Went back to t = {instant.time:.3g} s and paused; later changes of parameters and solids remain."
            )

    def turn(self) -> bool:
        """Apply queued commands and compute a frame if one is due; return whether anything happened."""
        happened = self.drain(defer_slow=self.smooth) > 0
        if self.paused and not self.steps_left:
            self.pace.stop()
            return happened
        now = time.perf_counter()
        if not self.steps_left and self.pace.wait(now) > 0.0:
            return happened
        self.steps_left = max(0, self.steps_left - 1)
        duration = self.tick()
        self._slow_has_ended()
        self._slow_began = None
        self.pace.passed(time.perf_counter(), duration, duration / self.speed)
        if self.smooth:
            self._fit_frame(time.perf_counter() - now)
        return True

    def _note_uncommanded_forces(self) -> None:
        """Record forces that a script added or removed, and its terms, which no recording can hold."""
        now, declared = self.sim.forces, self.sim.scene.forces
        tool_forces = {id(force) for force in self.tool_forces}
        changed = [force for force in now if force not in declared] + [force for force in declared if force not in now]
        changed += [force for force in self.sim.pushed if id(force) not in tool_forces]
        self.unrecorded_forces.update(type(force).__name__ for force in changed)
        self.unrecorded_forces.update(term.name for term in self.sim.terms)

    def _fit_frame(self, took: float) -> None:
        """Divide frames on a machine that is too slow for whole ones, by a command, so that it is recorded."""
        most, parts = max(SLOW_FRAME, FRAME_PER_PICTURE * self.picture_seconds), self.frame_parts
        several = self.sim.time_steps > 1
        late = several and self.pace.is_late(self.speed)
        if several and took > 1.2 * most:
            parts = min(MOST_PARTS, math.ceil(parts * took / most))
        elif took < most * FAST_FRAME / SLOW_FRAME:
            parts = max(1, parts - 1)
        if parts != self.frame_parts or (late and not self.fills_frames):
            self.apply(FrameLength(parts=parts, filled=self.fills_frames or late))

    def wake(self) -> None:
        """End a `rest` early, from any thread."""
        self._wake.set()

    def rest(self, longest: float = 0.1, *, asleep: bool = False) -> None:
        """Wait until a command comes or a frame is due, at most `longest` [s]; `asleep`: no frame is due."""
        wait = self.time_to_rest(longest, asleep=asleep)
        if wait > 0.0:
            self._wake.wait(wait)
        self._wake.clear()

    def time_to_rest(self, longest: float, *, asleep: bool = False) -> float:
        """Return the time until a frame is due, at most `longest` [s]; `asleep`: no frame is due."""
        running = (not self.paused or self.steps_left) and not asleep
        return min(longest, self.pace.wait(time.perf_counter())) if running else longest
