"""A session: a world, the commands that act on it, its past, and time that passes.

Fronts submit commands from any thread; everything else happens in the one thread that calls `turn`.
"""

import math
import threading
import time
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import LIVE
from wavetank.scene.fluids import Points
from wavetank.scene.forces import Force
from wavetank.scene.scene import Scene
from wavetank.session.commands import Command, FrameLength
from wavetank.session.game import HARMLESS, Game
from wavetank.session.history import History
from wavetank.session.pace import Pace
from wavetank.session.rules import RULES
from wavetank.session.tools import TOOL_NAMES, Hand, Tool
from wavetank.session.tools.carry import TOOL_SOLID, carry
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import moved
from wavetank.view.camera import Camera

MOST_PARTICLES = 200_000
SLUGGISH, SWIFT = 0.045, 0.025  # s: a frame that takes longer is made shorter, one that takes less longer again
MOST_PARTS = 8  # of a frame; shorter time steps would turn density errors into velocity
WORTH = 1.0  # a frame takes no less than so many times its picture, or pictures would eat the time
MOST_WAITING = 4096  # commands in the queue; what comes on top is dropped
CARRY_PACE = 0.8  # of sqrt(g L): how fast a command carries a solid


class Session:
    """One running world and all that is done to it.

    `log` lists every command that took effect, with the number of frames computed before it: `recording` writes it.
    """

    def __init__(
        self, scene: Scene, arch: str = "cpu", *, most_particles: int = MOST_PARTICLES, history: History | None = None
    ) -> None:
        self.most_particles, self.arch = most_particles, arch
        self.history = history or History()
        self.pace = Pace()
        self.ticks = 0  # frames computed since the session began, whatever was rewound
        self.log: list[tuple[int, Command]] = []
        self.notes: list[str] = []  # for the person, one sentence each
        self.paused, self.speed, self.steps_left = False, 1.0, 0
        self.frame_parts = 1  # into which a frame is divided
        self.fills_frames = False  # whether frames end with a time step of full length
        self.smooth = False  # whether frames are made shorter on a slow machine
        self.picture_seconds = 0.0  # that the front takes for a picture, for that choice
        self.view, self.color_by = "", "speed"
        self.aspect = 16 / 9  # of the picture, set by the front
        self.changes = 0  # grows whenever a picture would look different
        self.hands: dict[int, tuple[Tool, Hand]] = {}
        self.running: dict[str, tuple[Tool, Hand]] = {}
        self.moving: dict[str, tuple[Any, Any]] = {}
        self.uncommanded: set[str] = set()  # forces that came or went without a command: no recording has them
        self._commanded: list[Force] = []  # forces that tools push with in the next frame
        self._waiting: list[Command] = []
        self._latest: dict[Any, int] = {}
        self._lock, self._wake = threading.Lock(), threading.Event()
        self.begin(scene)

    def begin(self, scene: Scene) -> None:
        """Start a scene; raises `WavetankError` and changes nothing where it is too large."""
        count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
        if count > self.most_particles:
            raise WavetankError(
                f"spacing = {scene.spacing} makes about {count:,.0f} particles; at most {self.most_particles:,} are "
                "allowed in a session: use a larger spacing or less fluid."
            )
        sim = Simulation(scene, self.arch)
        sim.load_kernels()
        game = Game(scene.goal, sim.frame(measured=False)) if scene.goal else None
        self.scene, self.sim, self.game = scene, sim, game
        self.hands, self.running, self.moving = {}, {}, {}
        self._camera: Camera | None = None
        self.history.clear()
        self.history.keep(sim.snapshot())

    # --- commands ---

    def submit(self, command: Command) -> bool:
        """Put a command into the queue, from any thread; say whether there was room."""
        with self._lock:
            slot = command.slot
            if slot is not None and slot in self._latest:
                place = self._latest[slot]
                self._waiting[place] = command.after(self._waiting[place])
            elif len(self._waiting) >= MOST_WAITING:
                return False
            else:
                if slot is None:
                    # Nothing moves past a command that others may depend on.
                    self._latest.clear()
                else:
                    self._latest[slot] = len(self._waiting)
                self._waiting.append(command)
        self._wake.set()
        return True

    def drain(self) -> int:
        """Carry out all waiting commands in order and return how many there were; refusals become notes."""
        with self._lock:
            commands, self._waiting = self._waiting, []
            self._latest.clear()
        for command in commands:
            try:
                self.apply(command)
            except WavetankError as error:
                self.note(str(error))
        return len(commands)

    def apply(self, command: Command) -> None:
        """Carry out one command now; raises `WavetankError` and changes nothing where it is not allowed."""
        game = self.game
        if game is not None:
            command = game.allow(command)
        RULES[type(command)](self, command)
        if game is not None:
            game.done(command)
        self.log.append((self.ticks, command))
        self.changes += 1

    def note(self, sentence: str) -> None:
        """Keep a sentence for the person; fronts show it and take it away."""
        if sentence not in self.notes[-3:]:
            self.notes.append(sentence)
            del self.notes[:-20]

    # --- time ---

    @property
    def frame_duration(self) -> float:
        """Seconds of water in a frame [s]; slow motion has shorter ones, as long as they hold a good time step."""
        longest = self.sim.scene.frame_time * min(1.0, max(self.speed, 1.0 / MOST_PARTS), 1.0 / self.frame_parts)
        return self.sim.filled(longest) if self.fills_frames else longest

    def tick(self) -> float:
        """Compute one frame, with what the hands do to it, and return the seconds of water in it [s]."""
        duration = self.frame_duration
        self._look_for_strangers()
        for tool, hand in [*self.hands.values(), *self.running.values()]:
            hand.pass_time(duration)
            self.guard(hand, tool.hold, hand, duration)
        for name, (position, rotation) in list(self.moving.items()):
            self._carry(name, position, rotation, duration)
        self.sim.advance(duration)
        if not self.sim.pushed:  # else too little time has passed for a frame, and they still wait for it
            self._commanded = []
        self.ticks += 1
        self.changes += 1
        if self.game is not None:
            self.game.watch(self.sim.frame(measured=False), duration)
        self.history.forget_from(self.sim.time)
        if self.history.wants(self.sim.time):
            self.history.keep(self.sim.snapshot())
        return duration

    def turn(self) -> bool:
        """Carry out what waits and compute a frame if one is due; say whether anything happened."""
        happened = self.drain() > 0
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

    def _look_for_strangers(self) -> None:
        """Take note of forces that a script added or took away itself."""
        now, declared, mine = self.sim.forces, self.sim.scene.forces, {id(force) for force in self._commanded}
        changed = [force for force in now if force not in declared] + [force for force in declared if force not in now]
        changed += [force for force in self.sim.pushed if id(force) not in mine]
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
        running = (not self.paused or self.steps_left) and not asleep
        wait = min(longest, self.pace.wait(time.perf_counter())) if running else longest
        if wait > 0.0:
            self._wake.wait(wait)
        self._wake.clear()

    # --- for the rules ---

    @property
    def camera(self) -> Camera:
        """Where pictures are taken from."""
        return self._camera or Camera.framing(self.sim.scene, self.aspect)

    @camera.setter
    def camera(self, camera: Camera | None) -> None:
        self._camera = camera

    def guard(self, hand: Hand, act: Any, *arguments: Any) -> None:
        """Let a tool act; what it has to say, and what it may not do, becomes a note."""
        before = len(self.sim.pushed)
        try:
            act(*arguments)
        except WavetankError as error:
            hand.notes.append(str(error))
        self._commanded += self.sim.pushed[before:]
        for sentence in hand.notes:
            self.note(sentence)
        hand.notes.clear()

    def lift(self, hand: int | str) -> None:
        """End the tool of a pointer (a number), or one that goes on by itself (a name)."""
        tool, held = self.hands.pop(hand) if isinstance(hand, int) else self.running.pop(hand)
        self.guard(held, tool.end, held)

    def lift_all(self) -> None:
        """End all tools."""
        for pointer in [*self.hands]:
            self.lift(pointer)
        for name in [*self.running]:
            self.lift(name)
        self.moving = {}

    def go_to(self, snapshot: Any) -> None:
        """Make an instant of the past the present."""
        self.lift_all()
        self.sim.resume(snapshot)
        for name in [name for name in self.sim.solids.names if name.startswith(TOOL_SOLID)]:
            self.sim.remove_solid(name)

    def tool_named(self, name: str, options: dict[str, Any]) -> Tool:
        """Return a tool with its options; raises `WavetankError` for what it does not have."""
        if name not in TOOL_NAMES:
            raise WavetankError(f"tool = {name!r} is not known; it must be one of {', '.join(TOOL_NAMES)}.")
        tool: Tool = TOOL_NAMES[name].parse(options, name)
        return tool

    def changed_scene(self, parameters: dict[str, Any]) -> Scene:
        """Return the scene as it began, with the live parameters as they are now and `parameters` as given.

        A level keeps none that its water feels: a tank that was left tilted stands upright again.
        """
        now = {name: getattr(self.sim.scene, name) for name in LIVE}
        start = {name: getattr(self.scene, name) for name in LIVE}
        free = LIVE if self.game is None else HARMLESS
        kept = {name: value for name, value in now.items() if value != start[name] and name in free}
        return self.scene.changed(**{**kept, **parameters}) if kept or parameters else self.scene

    def present_scene(self) -> Scene:
        """Return what there is now as a scene: the water as points, the solids where they are; without tools' own."""
        sim, frame = self.sim, self.sim.frame()
        pairs = list(zip(sim.solids.members, sim.solids.names, sim.solids.poses, strict=True))[sim.solids.tank_count :]
        solids = [
            moved(solid, *pose).model_copy(update={"name": name})
            for solid, name, pose in pairs
            if not name.startswith(TOOL_SOLID)
        ]
        fluids = [Points(positions=frame.positions, velocities=frame.velocities)] if sim.count else []
        return sim.scene.changed(fluids=fluids, solids=solids)

    def _carry(self, name: str, position: Any, rotation: Any, duration: float) -> None:
        if name not in self.sim.solids.names:
            del self.moving[name]
            return
        where = self.sim.solids.poses[self.sim.solids.find(name)][0]
        goal = np.array([*(where if position is None else position), 0.0][:3])
        size = max(self.sim.scene.tank.size) if self.sim.scene.tank else 1.0
        if carry(self.sim, name, goal, rotation, CARRY_PACE * (9.81 * size) ** 0.5 * duration):
            del self.moving[name]
