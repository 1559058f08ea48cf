"""The state of a session, which commands change: a world, tools in use, its history, what is shown of it."""

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
from wavetank.session.tools.solids import TOOL_SOLID, move_towards
from wavetank.session.warm_up import launches
from wavetank.simulation.cost import cost_of
from wavetank.simulation.simulation import Simulation
from wavetank.simulation.state import State
from wavetank.solids.shapes import moved
from wavetank.view.camera import Camera

MOST_BYTES = 4_000_000_000  # memory of a session's world
MOST_SOLIDS = 300  # in a session: every particle tests those near it
CARRY_SPEED = 0.8  # sqrt(g L): speed at which a command moves a solid


@dataclasses.dataclass(frozen=True)
class World:
    """A world that was replaced, stored for undo."""

    scene: Scene
    sim: Simulation
    game: Game | None
    history: History
    camera: Camera | None
    paused: bool
    awaits_touch: bool


class SessionState:
    """One running world and all that commands change; time passes in `Session`."""

    def __init__(
        self, scene: Scene, arch: str, most_particles: int, history: History, own: Simulation | None = None
    ) -> None:
        self.most_particles, self.arch, self.history, self.own = most_particles, arch, history, own
        self.pace = Pace()
        self.notes: list[str] = []  # messages to viewers, one sentence each
        #: reports why the command that is being applied was refused
        self.report_refusal: Callable[[str], None] = self.note
        self.paused, self.speed, self.steps_left = False, 1.0, 0
        self.starts_on_touch = False  # whether time in a level starts with the first use of a tool
        self.awaits_touch = False  # whether it waits for that now
        self.frame_parts = 1  # that each frame is divided into
        self.fills_frames = False  # whether frames end with a time step of full length
        self.view, self.color_by = "", "speed"
        self.cut = ("z", 0.5)  # slice: its normal, and its position along that, 0 to 1
        self.shows_forces = False  # whether forces of the water on bodies are shown
        self.light: dict[str, str] = {}  # options of the renderer: environment and sun, where chosen
        self.previous_world: World | None = None  # replaced by the last reset or scene
        self.highlighted = ""  # name of the solid under the pointer that a tool would take
        self.untilted_gravity: tuple[float, ...] | None = None  # gravity [m/s^2] before a tool tilted the tank
        self.seconds_per_particle = 0.0  # s of a time step in 3-D, measured; 0: not yet
        self.aspect = 16 / 9  # width over height of the picture
        self.hands: dict[int, tuple[Tool, Hand]] = {}
        self.running: dict[str, tuple[Tool, Hand]] = {}
        self.moving: dict[str, tuple[Any, Any]] = {}
        self.tool_forces: list[Force] = []  # that tools apply in the next frame
        if own is None:
            self.begin(scene)
        else:
            self._enter(scene, own)

    def begin(self, scene: Scene) -> None:
        """Start a scene; raises `WavetankError` and changes nothing where it is too large.

        A session of a given simulation keeps that object, and the forces that were added to it.
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
            sim.scene.most_particles = min(scene.most_particles or self.most_particles, self.most_particles)
        self._store_for_undo(cost.bytes)
        give_back()
        if self.own is not None:
            sim.forces += [force for force in self.own.forces if force not in self.own.scene.forces]
            sim.terms += self.own.terms
        self._enter(scene, self._adopted(sim))

    def _enter(self, scene: Scene, sim: Simulation) -> None:
        self.warm_up = launches(sim)
        game = Game(scene.goal, sim.frame(measured=False)) if scene.goal else None
        self.scene, self.sim, self.game = scene, sim, game
        self.hands, self.running, self.moving = {}, {}, {}
        self.chosen_camera: Camera | None = None
        self.highlighted, self.untilted_gravity = "", None
        self.history.record(sim.snapshot())
        if self.starts_on_touch:  # a new scene is not paused
            self.paused, self.steps_left = False, 0
        self.wait_for_touch()

    def _adopted(self, sim: Simulation) -> Simulation:
        """Return `sim`, or the given simulation with the contents of `sim`."""
        if self.own is None:
            return sim
        self.own.replace_state(sim)
        return self.own

    def _store_for_undo(self, coming: int) -> None:
        """Store the current world for `undo` if it has moved and there is memory for it and `coming` bytes."""
        if not hasattr(self, "sim"):
            self.history.clear()
            return
        if self.sim.frame_number or self.previous_world is None:
            fits = cost_of(self.scene).bytes + coming <= MOST_BYTES
            self.previous_world = self._current_world() if fits else None
        self.history = History(self.history.memory)

    def undo(self) -> None:
        """Swap the world with the one that was replaced last; raises `WavetankError` without one."""
        if self.previous_world is None:
            raise WavetankError("There is nothing to undo: no reset and no other scene replaced a world.")
        self.end_all_tools()
        then = self.previous_world
        self.previous_world = self._current_world()
        self.scene, self.sim, self.game, self.history = then.scene, self._adopted(then.sim), then.game, then.history
        self.chosen_camera = then.camera
        self.highlighted, self.untilted_gravity, self.steps_left = "", None, 0
        self.paused, self.awaits_touch = then.paused, then.awaits_touch
        self.warm_up = launches(self.sim)

    def _current_world(self) -> World:
        sim = self.sim if self.own is None else copy.copy(self.sim)  # the given object becomes the other world
        return World(self.scene, sim, self.game, self.history, self.chosen_camera, self.paused, self.awaits_touch)

    def wait_for_touch(self) -> None:
        """Let a level that has just started wait for the first touch, if `starts_on_touch`."""
        self.awaits_touch = self.starts_on_touch and self.game is not None and not self.sim.frame_number
        self.paused = self.paused or self.awaits_touch

    def compile_ahead(self) -> bool:
        """Compile a few kernels that tools may need; return whether there were any left."""
        if self.warm_up:
            self.warm_up.pop(0)()
            return True
        return False

    def note(self, sentence: str) -> None:
        """Add a message to viewers; those who show `notes` empty it."""
        if sentence not in self.notes[-3:]:
            self.notes.append(sentence)
            del self.notes[:-20]

    @property
    def camera(self) -> Camera:
        """The camera, the scene's own unless one was chosen."""
        return self.chosen_camera or Camera.framing(self.sim.scene, self.aspect)

    @camera.setter
    def camera(self, camera: Camera | None) -> None:
        self.chosen_camera = camera

    @property
    def tilted_camera(self) -> Camera:
        """The camera with which pictures show a tank that a tool tilts: gravity points down."""
        if self.untilted_gravity is None:
            return self.camera.tilted(self.sim.scene, self.sim.time)
        return self.camera.turned_with(self.untilted_gravity, self.sim.gravity)

    def camera_for(self, tool: str) -> Camera:
        """The camera that a tool's rays come from; for one that tilts the tank it does not tilt."""
        return self.camera if tool in TOOL_NAMES and TOOL_NAMES[tool].tilts else self.tilted_camera

    def run_tool(self, hand: Hand, act: Any, *arguments: Any) -> None:
        """Call a method of a tool; its messages, and refusals, become notes."""
        before = len(self.sim.pushed)
        try:
            act(*arguments)
        except WavetankError as error:
            self.report_refusal(str(error))
        self.tool_forces += self.sim.pushed[before:]
        for sentence in hand.notes:
            self.note(sentence)
        hand.notes.clear()

    def end_tool(self, hand: int | str) -> None:
        """End the tool of a pointer (a number), or one that runs on by itself (a name)."""
        tool, held = self.hands.pop(hand) if isinstance(hand, int) else self.running.pop(hand)
        self.run_tool(held, tool.end, held)
        if tool.tilts and not getattr(tool, "stay", False):
            self.untilted_gravity = None

    def end_all_tools(self) -> None:
        """End all tools."""
        for pointer in [*self.hands]:
            self.end_tool(pointer)
        for name in [*self.running]:
            self.end_tool(name)
        self.moving = {}

    def restore(self, snapshot: State) -> None:
        """Go back to an instant of the history; solids of tools are removed."""
        self.end_all_tools()
        self.sim.resume(snapshot)
        for name in [name for name in self.sim.solids.names if name.startswith(TOOL_SOLID)]:
            self.sim.remove_solid(name)

    def tool_named(self, name: str, options: dict[str, Any]) -> Tool:
        """Return a tool with its options; raises `WavetankError` for unknown ones."""
        if name not in TOOL_NAMES:
            raise WavetankError(f"tool = {name!r} is not known; it must be one of {', '.join(TOOL_NAMES)}.")
        tool: Tool = TOOL_NAMES[name].parse(options, name)
        return tool

    def changed_scene(self, parameters: dict[str, Any]) -> Scene:
        """Return the initial scene with the current live parameters and the given `parameters`.

        A level keeps only those that do not act on its water: a tank that was left tilted is upright again.
        """
        now = {name: getattr(self.sim.scene, name) for name in LIVE}
        start = {name: getattr(self.scene, name) for name in LIVE}
        free = LIVE if self.game is None else HARMLESS
        kept = {name: value for name, value in now.items() if value != start[name] and name in free}
        return self.scene.changed(**{**kept, **parameters}) if kept or parameters else self.scene

    def current_scene(self) -> Scene:
        """Return the current world as a scene: water as points, solids at their poses; without solids of tools."""
        sim, frame = self.sim, self.sim.frame()
        held = sim.solids.motions.held
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
        """Move the solids that commands carry, by as much as is allowed in a frame of `duration` [s]."""
        for name, (position, rotation) in list(self.moving.items()):
            self._carry(name, position, rotation, duration)

    def _carry(self, name: str, position: Any, rotation: Any, duration: float) -> None:
        if name not in self.sim.solids.names:
            del self.moving[name]
            return
        where = self.sim.solids.poses[self.sim.solids.find(name)][0]
        goal = np.array([*(where if position is None else position), 0.0][:3])
        size = max(self.sim.scene.tank.size) if self.sim.scene.tank else 1.0
        if move_towards(self.sim, name, goal, rotation, CARRY_SPEED * (9.81 * size) ** 0.5 * duration):
            del self.moving[name]
