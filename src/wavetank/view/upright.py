"""Worlds in which another axis than y is up are turned before they are drawn: all passes know y as up."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import upload
from wavetank.device.state import MARGIN, integers, scalars
from wavetank.foundation.rotations import product, quaternion_of
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.scene.upward import nearest_axis
from wavetank.simulation.frame import Frame, FrameBuffer
from wavetank.simulation.instant import PlacedSolid
from wavetank.simulation.state import State


class Upright:
    """Arrays on the device that hold a frame with y up."""

    def __init__(self) -> None:
        self._of: Any = None
        self._buffer: FrameBuffer | None = None

    def frame(self, frame: Frame) -> Frame:
        """Return the frame with y up: itself, or a turned copy that is valid until the next one is asked for."""
        if frame.scene.upward == "y":
            return frame
        of = (frame.scene.tank, frame.scene.upward, frame.dim)
        if self._buffer is None or of != self._of:
            self._buffer, self._of = FrameBuffer(frame.scene), of
        state = turned_state(frame.state(), frame.scene.upright)
        self._buffer.scene = state.scene
        result = self._buffer.frame(state)
        if frame.read_pressure:
            result = dataclasses.replace(result, read_pressure=lambda: _by_id(frame))
        if not frame.frozen_count:
            return result
        frozen = integers(frame.count + MARGIN)
        upload(frozen, frame.frozen_by_id)
        return dataclasses.replace(result, frozen=frozen, frozen_count=frame.frozen_count)


def _by_id(frame: Frame) -> Any:
    """Return the pressures of a frame ordered by particle id, as a turned frame has its particles."""
    values = scalars(frame.count)
    upload(values, frame.pressure_by_id)
    return values


def turned_state(state: State, turn: np.ndarray) -> State:
    """Return a state for pictures rotated about the origin by a matrix [3, 3] that maps axes to axes."""
    q = np.array(quaternion_of(turn))
    flat = turn[: state.dim, : state.dim].T.astype(np.float32)
    arrays = dict(state.arrays)
    for name in ("x", "v", "foam_positions", "foam_velocities"):
        arrays[name] = arrays[name] @ flat
    placed = tuple(
        PlacedSolid(
            one.name,
            one.solid,
            turn @ one.position,
            product(q, one.rotation),
            turn @ one.velocity,
            turn @ one.angular_velocity,
        )
        for one in state.placed
    )
    scene = turned_scene(state.scene, turn)
    return dataclasses.replace(state, scene=scene, arrays=arrays, placed=placed)


def turned_scene(scene: Scene, turn: np.ndarray) -> Scene:
    """Return what pictures need to know of a scene, rotated likewise."""

    def box(lower: Any, upper: Any) -> np.ndarray:
        corners = np.array([lower, upper], float) @ turn[: scene.dim, : scene.dim].T
        return np.sort(corners, axis=0)

    def side(name: str) -> str:
        name = {"top": "+y", "bottom": "-y"}.get(name, name)
        way = turn[:, "xyz".index(name[-1])]
        axis = nearest_axis([*(-way if name[0] == "-" else way)])
        return axis if axis[0] == "-" else f"+{axis}"

    tank: Tank | None = None
    if scene.tank is not None:
        lower, upper = box(*scene.tank.box())
        sides: dict[str, Any] = {
            "lower": tuple(lower.tolist()),
            "size": tuple((upper - lower).tolist()),
            "open": [side(name) for name in scene.tank.open],
            "periodic": [side(axis)[-1] for axis in scene.tank.periodic],
            "tilt_axis": tuple((turn @ np.array(scene.tank.tilt_axis)).tolist()),
        }
        tank = scene.tank.model_copy(update=sides)
    boxes = [box(*fluid.bounds()) for fluid in scene.fluids if not tank and fluid.estimate(scene.spacing) > 0.0]
    changes: dict[str, Any] = {
        "up": "y",
        "tank": tank,
        "gravity": tuple((turn[: scene.dim, : scene.dim] @ np.array(scene.gravity)).tolist()),
        "fluids": [Block(lower=tuple(low), upper=tuple(high)) for low, high in boxes],
    }
    return scene.model_copy(update=changes)
