"""What each command does to the state of a session: one small function each, listed in `RULES`."""

import math
from collections.abc import Callable, Sequence
from typing import Any

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import LIVE, Parameters
from wavetank.scene.light import HIGHEST, LOWEST
from wavetank.scene.scene import Scene, bundled_levels, bundled_scenes, with_particles
from wavetank.session import commands as c
from wavetank.session.history import BOOKMARKS
from wavetank.session.state import MOST_SOLIDS, SessionState
from wavetank.session.tools import Hand
from wavetank.simulation.snapshot import Packed
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of

CLOSEST, WIDEST = 8.0, 6.0  # of a picture's height: spacings, and sizes of the world


def set_parameter(state: SessionState, command: c.SetParameter) -> None:
    """Set a live parameter."""
    name, value = command.name, command.value
    if name not in LIVE:
        if name in Parameters.model_fields:
            raise WavetankError(f"{name} does not change while the water moves; reset the scene with it.")
        raise WavetankError(f"{name!r} is not a parameter.")
    if name == "gravity" and isinstance(value, tuple) and math.hypot(*value) > c.STRONGEST:
        raise WavetankError(f"gravity = {value} is too strong; its length must be at most {c.STRONGEST:g} m/s^2.")
    setattr(state.sim, name, value)
    if name == "gravity":
        state.upright = None


def reset(state: SessionState, command: c.Reset) -> None:
    """Begin the scene anew, paused if it is."""
    unknown = next((name for name in command.parameters if name not in Parameters.model_fields), None)
    if unknown is not None:
        raise WavetankError(f"{unknown!r} is not a parameter.")
    state.lift_all()
    scene, camera, paused = state.changed_scene(command.parameters), state.chosen_camera, state.paused
    state.begin(scene)
    state.camera, state.paused = camera, paused or state.waits


def load(state: SessionState, command: c.LoadScene) -> None:
    """Begin another scene. Only bundled names: a command may come from afar, and must not open files."""
    if command.text:
        scene = Scene.from_text(command.text, command.file or "scene", files=False)
    elif command.name in (*bundled_scenes(), *bundled_levels()):
        scene = Scene.load(command.name)
    else:
        known = ", ".join((*bundled_scenes(), *bundled_levels()))
        raise WavetankError(f"{command.name!r} is not a bundled scene; those are {known}.")
    if command.particles and scene.goal is None:
        scene = with_particles(scene, command.particles)
    state.lift_all()
    state.begin(scene)


def undo(state: SessionState, command: c.Undo) -> None:
    """Go back to the world that was left."""
    state.undo()


def tool_begin(state: SessionState, command: c.ToolBegin) -> None:
    """Put a tool down."""
    tool = state.tool_named(command.tool, command.options)
    if command.pointer in state.hands:
        state.lift(command.pointer)
    if tool.name in state.running:
        state.lift(tool.name)
    hand = Hand(state.sim, command.origin, command.direction, state.most_particles, tool.through_water)
    state.hands[command.pointer] = (tool, hand)
    if tool.tilts and state.upright is None:
        state.upright = tuple(state.sim.gravity)
    if state.waits:
        state.paused = state.waits = False
    state.let_act(hand, tool.begin, hand)


def tool_move(state: SessionState, command: c.ToolMove) -> None:
    """Move a tool; one that is not down has nothing to move."""
    if command.pointer in state.hands:
        tool, hand = state.hands[command.pointer]
        hand.aim(command.origin, command.direction)
        state.let_act(hand, tool.move, hand)


def tool_end(state: SessionState, command: c.ToolEnd) -> None:
    """Lift a tool; one that lasts goes on."""
    if command.pointer in state.hands:
        tool, hand = state.hands[command.pointer]
        if tool.lasting:
            del state.hands[command.pointer]
            state.running[tool.name] = (tool, hand)
        else:
            state.lift(command.pointer)


def tool_stop(state: SessionState, command: c.ToolStop) -> None:
    """Stop what goes on by itself."""
    for name in [name for name in state.running if command.tool in ("", name)]:
        state.lift(name)


def move_solid(state: SessionState, command: c.MoveSolid) -> None:
    """Carry a solid to a pose."""
    number = state.sim.solids.find(command.name)
    if number < state.sim.solids.tank_count:
        raise WavetankError(f"{command.name!r} is a wall of the tank, which stays.")
    if command.position is not None and len(command.position) != state.sim.scene.dim:
        raise WavetankError(f"position = {command.position} must be {state.sim.scene.dim} numbers.")
    if isinstance(command.rotation, tuple) and sum(part * part for part in command.rotation) < 1e-12:
        raise WavetankError(f"rotation = {command.rotation} is not a quaternion of non-zero length.")
    state.moving[command.name] = (command.position, command.rotation)


def add_solid(state: SessionState, command: c.AddSolid) -> None:
    """Put a solid into the world; it swells, so that the water has time to make way."""
    if len(state.sim.scene.solids) >= MOST_SOLIDS:
        raise WavetankError(f"there are {MOST_SOLIDS} solids already; take one away first.")
    state.sim.add_solid(command.solid, 0.35)


def remove_solid(state: SessionState, command: c.RemoveSolid) -> None:
    """Take a solid away."""
    state.sim.remove_solid(command.name)


def pause(state: SessionState, command: c.Pause) -> None:
    """Stop time, or let it run."""
    state.paused, state.steps_left, state.waits = command.on, 0, False


def step(state: SessionState, command: c.Step) -> None:
    """Stop time and compute a few frames."""
    state.paused, state.waits = True, False
    state.steps_left += command.frames


def speed(state: SessionState, command: c.Speed) -> None:
    """Set the pace of time."""
    state.speed = command.factor
    state.pace.stop()


def frame_length(state: SessionState, command: c.FrameLength) -> None:
    """Set how long a frame is."""
    state.frame_parts, state.fills_frames = command.parts, command.filled


def rewind(state: SessionState, command: c.Rewind) -> None:
    """Go back."""
    snapshot = state.history.before(command.time)
    if snapshot is not None:
        state.go_to(snapshot)


def bookmark(state: SessionState, command: c.Bookmark) -> None:
    """Keep, go to or forget an instant."""
    bookmarks = state.history.bookmarks
    if command.action == "set":
        if len(bookmarks) >= BOOKMARKS and command.name not in bookmarks:
            raise WavetankError(f"there are {BOOKMARKS} bookmarks already; forget one first.")
        bookmarks[command.name] = Packed(state.sim.snapshot())
        return
    if command.name not in bookmarks:
        raise WavetankError(f"there is no bookmark {command.name!r}; there are: {', '.join(bookmarks) or 'none'}.")
    if command.action == "go":
        state.go_to(bookmarks[command.name].unpack())
    else:
        del bookmarks[command.name]


def camera(state: SessionState, command: c.SetCamera) -> None:
    """Put the camera somewhere."""
    state.camera = Camera(command.eye, command.target, command.up, command.field_of_view, height=command.height)


def orbit(state: SessionState, command: c.Orbit) -> None:
    """Turn the camera; a 2-D world is looked at straight."""
    if state.sim.scene.dim == 3:
        state.camera = state.camera.orbit(command.azimuth, command.elevation)


def pan(state: SessionState, command: c.Pan) -> None:
    """Move the camera, not out of sight of all."""
    moved = state.camera.pan(command.right, command.up, command.ahead)
    if max(abs(part) for part in moved.eye) < c.FARTHEST:
        state.camera = moved


def zoom(state: SessionState, command: c.Zoom) -> None:
    """Come closer or go away, no farther than there is something to be seen; a place of the picture stays."""
    camera, extent = state.camera, extent_of(state.sim.scene)
    nearest = math.log(CLOSEST * extent.spacing / camera.visible_height)
    farthest = math.log(WIDEST * 2.0 * extent.radius / camera.visible_height)
    factor = math.exp(min(max(math.log(command.factor), min(nearest, 0.0)), max(farthest, 0.0)))
    state.camera = camera.zoom(factor, state.aspect * (command.x - 0.5), 0.5 - command.y)


def home(state: SessionState, command: c.Home) -> None:
    """Frame the whole world."""
    state.camera = None


def view(state: SessionState, command: c.SetView) -> None:
    """Choose what is drawn."""
    from wavetank.view.choices import colorings, showing, views

    _check_known("view", command.view, views())
    if not _is_color(command.color_by):
        _check_known("color_by", command.color_by, colorings())
    state.view = command.view or state.view
    state.color_by = command.color_by or state.color_by
    if command.color_by and not command.view:  # who asks for a colour wants to see it
        state.view = showing(state.view, command.color_by)
    if command.axis or command.place is not None:
        axis, place = state.cut
        state.cut = (command.axis or axis, place if command.place is None else command.place)
    state.shows_forces = state.shows_forces if command.forces is None else command.forces


def light(state: SessionState, command: c.SetLight) -> None:
    """Choose an environment, and where its sun stands."""
    from wavetank.view.choices import standing
    from wavetank.view.environments import ENVIRONMENTS

    _check_known("environment", command.environment, ENVIRONMENTS)
    if command.environment:
        state.light = {"environment": command.environment}
    if command.azimuth is not None or command.elevation is not None or command.turn or command.rise:
        now = standing(state.sim.scene, state.view, state.light)
        azimuth = now.azimuth if command.azimuth is None else command.azimuth
        elevation = now.elevation if command.elevation is None else command.elevation
        height = min(HIGHEST, max(LOWEST, elevation + command.rise))
        state.light = state.light | {"sun": f"{(azimuth + command.turn) % 360.0:.6g},{height:.6g}"}


def _check_known(what: str, value: str, allowed: Sequence[str]) -> None:
    """Raise `WavetankError` for a name that there is not; none, "", leaves things as they are."""
    if value and value not in allowed:
        raise WavetankError(f"{what} = {value!r} is not known; it must be one of {', '.join(allowed)}.")


def _is_color(value: str) -> bool:
    return len(value) == 7 and value[0] == "#" and all(digit in "0123456789abcdefABCDEF" for digit in value[1:])


Rule = Callable[[SessionState, Any], None]
RULES: dict[type[c.Command], Rule] = {
    c.SetParameter: set_parameter,
    c.Reset: reset,
    c.LoadScene: load,
    c.Undo: undo,
    c.ToolBegin: tool_begin,
    c.ToolMove: tool_move,
    c.ToolEnd: tool_end,
    c.ToolStop: tool_stop,
    c.MoveSolid: move_solid,
    c.AddSolid: add_solid,
    c.RemoveSolid: remove_solid,
    c.Pause: pause,
    c.Step: step,
    c.Speed: speed,
    c.FrameLength: frame_length,
    c.Rewind: rewind,
    c.Bookmark: bookmark,
    c.SetCamera: camera,
    c.Orbit: orbit,
    c.Pan: pan,
    c.Zoom: zoom,
    c.Home: home,
    c.SetView: view,
    c.SetLight: light,
}
