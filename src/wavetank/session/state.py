"""What a session is about: a world, the hands in it, its past, what is shown of it. Rules act on this."""

import copy
import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import give_back, in_words
from wavetank.foundation.params import LIVE
from wavetank.scene.fluids import Points
from wavetank.scene.forces import Force
from wavetank.scene.scene import Scene
from wavetank.session.game import HARMLESS, Game
from wavetank.session.history import History
from wavetank.session.pace import Pace
from wavetank.session.tools import TOOL_NAMES, Hand, Tool
from wavetank.session.tools.carry import TOOL_SOLID, carry
from wavetank.simulation.cost import cost_of
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.snapshot import Snapshot
from wavetank.solids.shapes import moved
from wavetank.view.camera import Camera

MOST_BYTES = 4_000_000_000  # that the world of a session may take
MOST_SOLIDS = 300  # in a session: each is looked for by every particle near it
CARRY_PACE = 0.8  # of sqrt(g L): how fast a command carries a solid


@dataclasses.dataclass(frozen=True)
class World:
    """A world that was left, as it was."""

    scene: Scene
    sim: Simulation
    game: Game | None
    history: History
    camera: Camera | None
    paused: bool
    waits: bool


class SessionState:
    """One running world with all that commands change, and no time that passes by itself: see `Session`."""

    def __init__(
        self, scene: Scene, arch: str, most_particles: int, history: History, own: Simulation | None = None
    ) -> None:
        self.most_particles, self.arch, self.history, self.own = most_particles, arch, history, own
        self.pace = Pace()
        self.notes: list[str] = []  # for the person, one sentence each
        self.refused: Callable[[str], None] = self.note  # takes what a command may not do, while one is carried out
        self.paused, self.speed, self.steps_left = False, 1.0, 0
        self.patient = False  # whether a level begins with the first touch of a hand
        self.waits = False  # for it
        self.frame_parts = 1  # into which a frame is divided
        self.fills_frames = False  # whether frames end with a time step of full length
        self.view, self.color_by = "", "speed"
        self.cut = ("z", 0.5)  # of a slice: the axis across it, and where along that, 0 to 1
        self.shows_forces = False  # that the water puts on bodies, over the picture
        self.light: dict[str, str] = {}  # of the renderer's options: environment and sun, as far as they were chosen
        self.former: World | None = None  # what the last reset or scene left
        self.lit = ""  # name of the solid that a hand would take
        self.upright: tuple[float, ...] | None = None  # gravity [m/s^2] before a hand tilted the tank
        self.per_particle = 0.0  # s of a step, as fronts have measured it
        self.aspect = 16 / 9  # of the picture, set by the front
        self.hands: dict[int, tuple[Tool, Hand]] = {}
        self.running: dict[str, tuple[Tool, Hand]] = {}
        self.moving: dict[str, tuple[Any, Any]] = {}
        self.commanded: list[Force] = []  # forces that tools push with in the next frame
        if own is None:
            self.begin(scene)
        else:
            self._enter(scene, own)

    def begin(self, scene: Scene) -> None:
        """Start a scene; raises `WavetankError` and changes nothing where it is too large.

        A simulation of someone's own begins it as the object that it is, with the forces that were given to it.
        """
        count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
        if count > self.most_particles:
            raise WavetankError(
                f"spacing = {scene.spacing} makes about {count:,.0f} particles; at most {self.most_particles:,} are "
                "allowed in a session: use a larger spacing or less fluid."
            )
        cost = cost_of(scene)
        if cost.bytes > MOST_BYTES:
            raise WavetankError(
                f"{cost.sentence()}; at most {in_words(MOST_BYTES)} are allowed in a session: use a larger "
                "spacing or a smaller tank."
            )
        sim = Simulation(scene, self.arch)
        if scene.emitters:
            sim.scene.assign("most_particles", min(scene.most_particles or self.most_particles, self.most_particles))
        sim.load_kernels()
        self._leave(cost.bytes)
        give_back()
        if self.own is not None:
            sim.forces += [force for force in self.own.forces if force not in self.own.scene.forces]
        self._enter(scene, self._own(sim))

    def _enter(self, scene: Scene, sim: Simulation) -> None:
        sim.load_kernels()
        game = Game(scene.goal, sim.frame(measured=False)) if scene.goal else None
        self.scene, self.sim, self.game = scene, sim, game
        self.hands, self.running, self.moving = {}, {}, {}
        self.chosen_camera: Camera | None = None
        self.lit, self.upright = "", None
        self.history.keep(sim.snapshot())
        if self.patient:  # another scene moves, whatever was before
            self.paused, self.steps_left = False, 0
        self.wait_for_hand()

    def _own(self, sim: Simulation) -> Simulation:
        """Return the object that is to be that world: someone's own, or `sim` itself."""
        if self.own is None:
            return sim
        self.own.become(sim)
        return self.own

    def _leave(self, coming: int) -> None:
        """Keep the world there is, for `undo`, where it has moved, and both it and the one of `coming` bytes fit."""
        if not hasattr(self, "sim"):
            self.history.clear()
            return
        if self.sim.frame_number or self.former is None:
            fits = cost_of(self.scene).bytes + coming <= MOST_BYTES
            self.former = self._present() if fits else None
        self.history = History(self.history.memory)

    def undo(self) -> None:
        """Exchange the world with the one that was left last, to the last bit; raises `WavetankError` without one."""
        if self.former is None:
            raise WavetankError("There is nothing to undo: no world was left by a reset or another scene.")
        self.lift_all()
        then = self.former
        self.former = self._present()
        self.scene, self.sim, self.game, self.history = then.scene, self._own(then.sim), then.game, then.history
        self.chosen_camera = then.camera
        self.lit, self.upright, self.steps_left = "", None, 0
        self.paused, self.waits = then.paused, then.waits

    def _present(self) -> World:
        sim = self.sim if self.own is None else copy.copy(self.sim)  # someone's own object goes on as another world
        return World(self.scene, sim, self.game, self.history, self.chosen_camera, self.paused, self.waits)

    def wait_for_hand(self) -> None:
        """Let a level that has just begun wait for the first touch, where the front is `patient`."""
        self.waits = self.patient and self.game is not None and not self.sim.frame_number
        self.paused = self.paused or self.waits

    def note(self, sentence: str) -> None:
        """Keep a sentence for the person; fronts show it and take it away."""
        if sentence not in self.notes[-3:]:
            self.notes.append(sentence)
            del self.notes[:-20]

    @property
    def camera(self) -> Camera:
        """Where pictures are taken from."""
        return self.chosen_camera or Camera.framing(self.sim.scene, self.aspect)

    @camera.setter
    def camera(self, camera: Camera | None) -> None:
        self.chosen_camera = camera

    @property
    def sight(self) -> Camera:
        """The camera as pictures show it: a tank that a hand tilts is seen tilted, and gravity points down."""
        if self.upright is None:
            return self.camera.tilted(self.sim.scene, self.sim.time)
        return self.camera.turned_with(self.upright, self.sim.gravity)

    def camera_of(self, tool: str) -> Camera:
        """The camera that a tool's rays come from; one that tilts the tank stays with the room."""
        return self.camera if tool in TOOL_NAMES and TOOL_NAMES[tool].tilts else self.sight

    def let_act(self, hand: Hand, act: Any, *arguments: Any) -> None:
        """Let a tool act; what it has to say, and what it may not do, becomes a note."""
        before = len(self.sim.pushed)
        try:
            act(*arguments)
        except WavetankError as error:
            self.refused(str(error))
        self.commanded += self.sim.pushed[before:]
        for sentence in hand.notes:
            self.note(sentence)
        hand.notes.clear()

    def lift(self, hand: int | str) -> None:
        """End the tool of a pointer (a number), or one that goes on by itself (a name)."""
        tool, held = self.hands.pop(hand) if isinstance(hand, int) else self.running.pop(hand)
        self.let_act(held, tool.end, held)
        if tool.tilts and not getattr(tool, "stay", False):
            self.upright = None

    def lift_all(self) -> None:
        """End all tools."""
        for pointer in [*self.hands]:
            self.lift(pointer)
        for name in [*self.running]:
            self.lift(name)
        self.moving = {}

    def go_to(self, snapshot: Snapshot) -> None:
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
        held = sim.solids.courses.held
        pairs = list(zip(sim.solids.members, sim.solids.names, sim.solids.poses, strict=True))[sim.solids.tank_count :]
        solids = [
            moved(solid, *pose).model_copy(update={"name": name} | ({"motion": None} if name in held else {}))
            for solid, name, pose in pairs
            if not name.startswith(TOOL_SOLID)
        ]
        fluids = [Points(positions=frame.positions, velocities=frame.velocities)] if sim.count else []
        return sim.scene.changed(
            fluids=fluids,
            solids=solids,
            **({"start_time": sim.scene.start_time + sim.time} if sim.scene.is_timed() else {}),
        )

    def carry_solids(self, duration: float) -> None:
        """Bring the solids that commands carry as far as they get in a frame of `duration` [s]."""
        for name, (position, rotation) in list(self.moving.items()):
            self._carry(name, position, rotation, duration)

    def _carry(self, name: str, position: Any, rotation: Any, duration: float) -> None:
        if name not in self.sim.solids.names:
            del self.moving[name]
            return
        where = self.sim.solids.poses[self.sim.solids.find(name)][0]
        goal = np.array([*(where if position is None else position), 0.0][:3])
        size = max(self.sim.scene.tank.size) if self.sim.scene.tank else 1.0
        if carry(self.sim, name, goal, rotation, CARRY_PACE * (9.81 * size) ** 0.5 * duration):
            del self.moving[name]
