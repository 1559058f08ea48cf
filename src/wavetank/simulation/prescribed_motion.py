"""Solids with a prescribed motion: which follow it, which are held by a hand, and which return to it."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.expressions import smoothstep
from wavetank.foundation.rotations import interpolate
from wavetank.solids.motion import Path, Pose
from wavetank.solids.solid import Solid


@dataclasses.dataclass(frozen=True)
class Return:
    """A solid on its way back from a hand to its motion."""

    time: float  # s, when it was let go
    within: float  # s
    position: tuple[float, ...]  # m, where
    rotation: tuple[float, ...]


class PrescribedMotions:
    """Poses over time of the solids that have a motion, by name."""

    def __init__(self, members: Sequence[Solid], names: Sequence[str], start: float) -> None:
        self.start = start  # s: time of the motions when the water starts
        self.held: set[str] = set()
        self.returning: dict[str, Return] = {}
        self.frame_start, self.duration = 0.0, 0.0  # of the present frame [s]
        self._paths: dict[str, tuple[Path, Pose]] = {}
        for solid, name in zip(members, names, strict=True):
            self.add(solid, name)

    def add(self, solid: Solid, name: str) -> None:
        """Add the motion of a solid, if it has one."""
        if solid.motion is not None:
            self._paths[name] = (solid.motion.path(), (solid.origin, solid.quaternion))

    def forget(self, name: str) -> None:
        """Remove a solid."""
        self._paths.pop(name, None)
        self.returning.pop(name, None)
        self.held.discard(name)

    def begin_frame(self, time: float, duration: float) -> None:
        """Start a frame of `duration` [s] at `time` [s]."""
        self.frame_start, self.duration = time, duration
        self.returning = {name: back for name, back in self.returning.items() if time < back.time + back.within}

    def has(self, name: str) -> bool:
        """Return whether a solid has a motion."""
        return name in self._paths

    def follows(self, name: str) -> bool:
        """Return whether a solid follows its motion now."""
        return name in self._paths and name not in self.held

    def names(self) -> list[str]:
        """Return the names of the solids that follow their motions now."""
        return [name for name in self._paths if name not in self.held]

    def hold(self, name: str) -> None:
        """Hold a solid: it no longer follows its motion."""
        if name in self._paths:
            self.held.add(name)
            self.returning.pop(name, None)

    def release(self, name: str, time: float, within: float, pose: Pose) -> None:
        """Let a held solid return to its motion from `pose` `within` [s]; raises `WavetankError` where it has none."""
        if name not in self._paths:
            known = ", ".join(sorted(self._paths)) or "none"
            raise WavetankError(f"{name!r} has no motion of its own to go back to; solids with one: {known}.")
        if name in self.held:
            self.held.discard(name)
            if within > 0.0:
                self.returning[name] = Return(time, within, tuple(pose[0].tolist()), tuple(pose[1].tolist()))

    def pose(self, name: str, time: float) -> Pose:
        """Return the pose of a solid that follows its motion at `time` [s] of the water."""
        path, rest = self._paths[name]
        place, turn = path.pose(time + self.start, rest)
        back = self.returning.get(name)
        if back is not None:
            share = smoothstep(back.time, back.time + back.within, time)
            place = np.array(back.position) + share * (place - np.array(back.position))
            turn = interpolate(np.array(back.rotation), turn, share)
        return place, turn

    def plain(self) -> dict[str, Any]:
        """Return what a saved state has of this."""
        returning = {name: dataclasses.asdict(back) for name, back in self.returning.items()}
        return {"held": sorted(self.held), "returning": returning}

    def read(self, plain: dict[str, Any]) -> None:
        """Restore what `plain` returned."""
        self.held = set(plain.get("held", []))
        self.returning = {
            name: Return(back["time"], back["within"], tuple(back["position"]), tuple(back["rotation"]))
            for name, back in plain.get("returning", {}).items()
        }
