"""Frames shifted in time, for the instants of an open shutter: water and moving solids."""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.foundation.rotations import product
from wavetank.simulation.frame import Frame
from wavetank.solids.distance import SolidSet
from wavetank.view.lens import vec3, vec4


def shifted(frame: Frame, by: float) -> Frame:
    """Return the frame `by` [s] later: particles move straight on, solids as `_solids` says."""
    changes: dict[str, Any] = {"solids": _solids(frame, by)}
    if frame.count:
        x = qd.ndarray(vec3, shape=frame.x.shape)
        upload(x, download(frame.x) + np.float32(by) * download(frame.v))
        changes["x"] = x
    return dataclasses.replace(frame, **changes)


def _solids(frame: Frame, by: float) -> SolidSet:
    """Return the solids then: bodies moved by their velocities, others by their motion unless they are held."""
    solids, placed = frame.solids, frame.placed
    poses = {k: _pose(frame, one, by) for k, one in enumerate(placed, solids.tank_count) if k < solids.count}
    if all(
        np.array_equal(poses[k][0], one.position) and np.array_equal(poses[k][1], one.rotation)
        for k, one in enumerate(placed, solids.tank_count)
        if k in poses
    ):
        return solids
    place, turn = download(solids.position).copy(), download(solids.rotation).copy()
    for k, (position, rotation) in poses.items():
        place[k], turn[k] = position, rotation
    arrays = []
    for values, kind in ((place, vec3), (turn, vec4)):
        arrays.append(qd.ndarray(kind, shape=(len(values),)))
        upload(arrays[-1], values.astype(np.float32))
    return dataclasses.replace(solids, position=arrays[0], rotation=arrays[1])


def _pose(frame: Frame, one: Any, by: float) -> tuple[np.ndarray, np.ndarray]:
    if one.solid.motion is not None:
        path, rest, now = one.solid.motion.path(), (one.solid.origin, one.solid.quaternion), frame.scene.start_time
        here = path.pose(now + frame.time, rest)
        if np.allclose(here[0], one.position, atol=1e-5) and abs(float(here[1] @ one.rotation)) > 1.0 - 1e-6:
            there: tuple[np.ndarray, np.ndarray] = path.pose(now + frame.time + by, rest)
            return there
    angle = by * one.angular_velocity
    size = float(np.linalg.norm(angle))
    if size == 0.0:
        return one.position + by * one.velocity, one.rotation
    turn = np.array([np.cos(0.5 * size), *(np.sin(0.5 * size) / size * angle)])
    return one.position + by * one.velocity, product(turn, one.rotation)
