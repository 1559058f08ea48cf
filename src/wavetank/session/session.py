"""A session: a world, the commands that act on it, its past, and time that passes.

Fronts submit commands from any thread; everything else happens in the one thread that calls `turn`.
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
SLUGGISH, SWIFT = 0.045, 0.025  # s: a frame that takes longer is made shorter, one that takes less longer again
MOST_PARTS = 8  # of a frame; shorter time steps would turn density errors into velocity
WORTH = 1.0  # a frame takes no less than so many times its picture, or pictures would eat the time
MOST_SLOW = 8  # slow commands in the queue
SPARED, SHORTEST_REST = 2.0, 0.1  # times as long as such a command took, and s at least, none follows it
LONGEST_NOTE = 400  # characters
Refused = Callable[[str], None] | None  # is told why a command failed
Waiting = tuple[Command, Refused]
MOST_WAITING = 4096  # commands in the queue; what comes on top is dropped


class Session(SessionState):
    """One running world and all that is done to it.

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
        super().__init__(scene, arch, most_particles, history or History(), own)
        self.ticks = 0  # frames computed since the session began, whatever was rewound
        self.log: list[tuple[int, Command]] = []
        self.smooth = False  # whether frames are made shorter on a slow machine
        self.picture_seconds = 0.0  # that the front takes for a picture, for that choice
        self.changes = 0  # grows whenever a picture would look different
        self.uncommanded: set[str] = set()  # forces that came or went without a command: no recording has them
        self._waiting: list[Waiting] = []
        self._spared_until = 0.0  # on the clock of the process, until which nothing that takes long is done
        self._latest: dict[Any, int] = {}
        self._lock, self._wake = threading.Lock(), threading.Event()

    @classmethod
    def of(cls, sim: Simulation) -> "Session":
        """Return a session of someone's own simulation, as it is: it stays that object whatever is begun anew.

        What is not done by commands, as `sim.advance` between two turns, is in no recording.
        """
        scene = sim.scene.model_copy(deep=True)
        return cls(scene, sim.arch or "cpu", most_particles=max(MOST_PARTICLES, 2 * sim.count), own=sim)

    # --- commands ---

    def submit(self, command: Command, refused: Refused = None) -> bool:
        """Put a command into the queue, from any thread; say whether there was room.

        Where it fails `refused` is told why, in the simulation's thread; without it, everyone is, by a note.
        Of those that take long few wait, and another beginning takes the place of one that was not reached yet.
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
                self._waiting[place] = command.after(self._waiting[place][0]), refused
            elif len(self._waiting) >= MOST_WAITING:
                return False
            else:
                if key is None:
                    # Nothing moves past a command that others may depend on.
                    self._latest.clear()
                else:
                    self._latest[key] = len(self._waiting)
                self._waiting.append((command, refused))
        self._wake.set()
        return True

    def drain(self, *, sparing: bool = False) -> int:
        """Carry out the waiting commands in order and return how many there were; failures become notes.

        `sparing` the time of those who watch, one that takes long waits, and all behind it, until twice as much time
        has passed as the one before took: most of the time belongs to the water, whatever comes.
        """
        with self._lock:
            commands, self._waiting = self._waiting, []
            self._latest.clear()
        for number, (command, refused) in enumerate(commands):
            if sparing and command.is_slow and time.perf_counter() < self._spared_until:
                with self._lock:
                    self._waiting[:0] = commands[number:]
                    self._latest.clear()  # places have changed; what comes joins those behind it only
                return number
            self._carry_out(command, refused)
        return len(commands)

    def _carry_out(self, command: Command, refused: Refused) -> None:
        """Carry out one command; whatever goes wrong becomes a note to who gave it, and the water goes on."""
        began, self.refused = time.perf_counter(), refused or self.note
        try:
            with explain_errors(f"The command {command.kind!r} failed", "command"):
                self.apply(command)
        except WavetankError as error:
            self.refused(str(error)[:LONGEST_NOTE])
        self.refused = self.note
        if command.is_slow:
            end = time.perf_counter()
            self._spared_until = end + max(SPARED * (end - began), SHORTEST_REST)

    def apply(self, command: Command) -> None:
        """Carry out one command now; raises `WavetankError` and changes nothing where it is not allowed."""
        if self.game is not None:
            command = command.as_allowed(self.game)
        command.apply(self)
        self.log.append((self.ticks, command))
        self.changes += 1

    # --- time ---

    @property
    def frame_duration(self) -> float:
        """Seconds of water in a frame [s]; slow motion has shorter ones, as long as they hold a good time step."""
        longest = self.sim.scene.frame_time * min(1.0, max(self.speed, 1.0 / MOST_PARTS), 1.0 / self.frame_parts)
        try:
            return self.sim.full_steps_time(longest) if self.fills_frames else longest
        except WavetankError:  # the frame itself will say it
            return longest

    def tick(self) -> float:
        """Compute one frame, with what the hands do to it, and return the seconds of water in it [s]."""
        duration = self.frame_duration
        self._note_uncommanded_forces()
        for tool, hand in [*self.hands.values(), *self.running.values()]:
            hand.pass_time(duration)
            self.let_act(hand, tool.hold, hand, duration)
        self.carry_solids(duration)
        self._advance(duration)
        if not self.sim.pushed:  # else too little time has passed for a frame, and they still wait for it
            self.commanded = []
        self.ticks += 1
        self.changes += 1
        if self.game is not None:
            self.game.watch(self.sim.frame(measured=False), duration)
        self.history.forget_from(self.sim.time)
        if self.history.wants(self.sim.time):
            self.history.keep(self.sim.snapshot())
        return duration

    def _advance(self, duration: float) -> None:
        """Let the water move; where an expression of the scene has no value time stops, and a note says why."""
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
        """Go to the last kept instant whose numbers are numbers."""
        instant = self.history.last_finite()
        if instant is not None:
            self.go_to(instant)
            self.note(f"Back at t = {instant.time:.3g} s, and paused; what was changed since then is as it was left.")

    def turn(self) -> bool:
        """Carry out what waits and compute a frame if one is due; say whether anything happened."""
        happened = self.drain(sparing=self.smooth) > 0
        if self.paused and not self.steps_left:
            self.pace.stop()
            return happened
        now = time.perf_counter()
        if not self.steps_left and self.pace.wait(now) > 0.0:
            return happened
        self.steps_left = max(0, self.steps_left - 1)
        duration = self.tick()
        self.pace.passed(time.perf_counter(), duration, duration / self.speed)
        if self.smooth:
            self._fit_frame(time.perf_counter() - now)
        return True

    def _note_uncommanded_forces(self) -> None:
        """Take note of forces that a script added or took away itself."""
        now, declared = self.sim.forces, self.sim.scene.forces
        commanded = {id(force) for force in self.commanded}
        changed = [force for force in now if force not in declared] + [force for force in declared if force not in now]
        changed += [force for force in self.sim.pushed if id(force) not in commanded]
        self.uncommanded.update(type(force).__name__ for force in changed)

    def _fit_frame(self, took: float) -> None:
        """Shorten the frames of a machine that is too slow for them; a command, so that a recording knows."""
        most, parts = max(SLUGGISH, WORTH * self.picture_seconds), self.frame_parts
        several = self.sim.time_steps > 1
        late = several and self.pace.is_late(self.speed)
        if several and took > 1.2 * most:
            parts = min(MOST_PARTS, math.ceil(parts * took / most))
        elif took < most * SWIFT / SLUGGISH:
            parts = max(1, parts - 1)
        if parts != self.frame_parts or (late and not self.fills_frames):
            self.apply(FrameLength(parts=parts, filled=self.fills_frames or late))

    def wake(self) -> None:
        """End `rest` early, from any thread."""
        self._wake.set()

    def rest(self, longest: float = 0.1, *, asleep: bool = False) -> None:
        """Wait until a command comes or a frame is due, at most `longest` [s]; `asleep` no frame is."""
        wait = self.time_to_rest(longest, asleep=asleep)
        if wait > 0.0:
            self._wake.wait(wait)
        self._wake.clear()

    def time_to_rest(self, longest: float, *, asleep: bool = False) -> float:
        """Return the time until a frame is due [s], `longest` at most; `asleep` none is."""
        running = (not self.paused or self.steps_left) and not asleep
        return min(longest, self.pace.wait(time.perf_counter())) if running else longest
