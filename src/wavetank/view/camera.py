"""Where a picture is taken from: plain data on the host."""

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.foundation.arguments import array_of, brief, finite
from wavetank.foundation.errors import WavetankError
from wavetank.scene.schedule import tilted_by
from wavetank.scene.upward import TURNS, nearest_axis
from wavetank.view.extent import Extent, extent_of, extent_of_water
from wavetank.view.lens import Lens, basis, lens_at

Point = tuple[float, float, float]

#: Three-quarter view from slightly above: azimuth from +z towards +x, elevation above the horizon [rad].
FRAMING_AZIMUTH, FRAMING_ELEVATION = math.radians(30.0), math.radians(20.0)
UPRIGHT = 0.85  # width over height of a picture below which it is upright
ROOM = 1.25  # more height that a picture of a tilted tank shows
STEEPEST = math.radians(89.0)  # an orbit stops short of the pole, where `up` has no meaning
NEAREST, FARTHEST = 1e-3, 1e4  # m: how close and how far zooming goes


@dataclasses.dataclass(frozen=True)
class Camera:
    """An eye at `eye` that looks at `target`. Moving it returns a new one."""

    eye: Point  # m
    target: Point  # m
    up: Point | None = None  # that of the world which it sees where None
    field_of_view: float = math.radians(28.0)  # rad, vertical
    near: float = 0.01  # m, nothing nearer is drawn
    height: float | None = None  # m; a number makes the camera orthographic with that much height in view

    def __post_init__(self) -> None:
        """Refuse what has no picture; raises `WavetankError`."""
        for name in ("eye", "target", "up"):
            value = getattr(self, name)
            if value is None and name == "up":
                continue
            point = array_of(f"camera {name}", value, float, "[3]")
            if point.shape != (3,) or not np.isfinite(point).all():
                raise WavetankError(f"camera {name} = {brief(value)} must be three finite numbers.")
            object.__setattr__(self, name, _point(point))
        finite("camera field_of_view [rad]", self.field_of_view, 1e-6, math.pi - 1e-6)
        finite("camera near [m]", self.near, 1e-6)
        if self.height is not None and finite("camera height [m]", self.height, 0.0) == 0.0:
            raise WavetankError("camera height = 0 must be a positive length [m], or None.")
        if self.distance < 1e-9:
            raise WavetankError(f"camera eye and target are both {self.eye}; they must differ.")
        if self.up is not None and not any(self.up):
            raise WavetankError("camera up = (0, 0, 0) has no direction; (0, 1, 0) is usual.")

    @property
    def upward(self) -> Point:
        """What points up in the picture, y where nothing else was chosen."""
        return self.up or (0.0, 1.0, 0.0)

    def turned(self, turn: np.ndarray) -> "Camera":
        """Return this rotated about the origin by a matrix [3, 3]."""
        eye, target, up = (_point(turn @ np.array(point)) for point in (self.eye, self.target, self.upward))
        return dataclasses.replace(self, eye=eye, target=target, up=up)

    def in_world(self, scene: Any) -> "Camera":
        """Return this with what is up in `scene`, where nothing else was chosen."""
        return dataclasses.replace(self, up=_point(scene.upright[1])) if self.up is None else self

    @property
    def distance(self) -> float:
        """Distance from the eye to the target [m]."""
        return math.dist(self.eye, self.target)

    @property
    def visible_height(self) -> float:
        """Height of the picture at the target [m]."""
        return self.height or 2.0 * self.distance * math.tan(0.5 * self.field_of_view)

    def lens(self, width: int, height: int) -> Lens:
        """Return this camera on the device for a picture of that many pixels."""
        return lens_at(
            np.array(self.eye),
            self._axes,
            width,
            height,
            self._focal(height),
            perspective=self.height is None,
            near=self.near,
        )

    def orbit(self, azimuth: float, elevation: float) -> "Camera":
        """Turn around the target by `azimuth` about the vertical and `elevation` to the zenith [rad], distance kept."""
        turn = TURNS[nearest_axis(self.upward)]
        offset = turn @ np.subtract(self.eye, self.target)
        old = math.asin(max(-1.0, min(1.0, offset[1] / self.distance)))
        new = max(-STEEPEST, min(STEEPEST, old + elevation))
        around = math.atan2(offset[0], offset[2]) + azimuth
        offset = self.distance * turn.T @ _direction(around, new)
        return dataclasses.replace(self, eye=_point(np.add(self.target, offset)))

    def zoom(self, factor: float, right: float = 0.0, up: float = 0.0) -> "Camera":
        """Show `factor` times as much height: below 1 comes closer, above 1 goes away.

        What is `right` and `up` of the middle, in shares of the visible height, stays where it is in the picture.
        """
        if not (math.isfinite(factor) and factor > 0.0):
            raise WavetankError(f"zoom factor = {factor} must be a positive number; below 1 comes closer.")
        if self.height is not None:
            height = max(NEAREST, min(FARTHEST, self.height * factor))
            aside = self.pan((1.0 - height / self.height) * right, (1.0 - height / self.height) * up)
            return dataclasses.replace(aside, height=height)
        distance = max(NEAREST, min(FARTHEST, self.distance * factor))
        share = distance / self.distance
        aside = self.pan((1.0 - share) * right, (1.0 - share) * up)
        offset = np.subtract(aside.eye, aside.target) * share
        return dataclasses.replace(aside, eye=_point(np.add(aside.target, offset)))

    def pan(self, right: float, up: float, ahead: float = 0.0) -> "Camera":
        """Move eye and target by these shares of the visible height."""
        shift = self.visible_height * (np.array([right, up, ahead]) @ self._axes)
        return dataclasses.replace(self, eye=_point(np.add(self.eye, shift)), target=_point(np.add(self.target, shift)))

    def turned_with(self, before: Sequence[float], after: Sequence[float]) -> "Camera":
        """Turn around the target as a vector [2 or 3] did: in the picture it points where it pointed before."""
        a, b = (np.array([*vector, 0.0][:3], float) for vector in (before, after))
        lengths = float(np.linalg.norm(a)), float(np.linalg.norm(b))
        if min(lengths) < 1e-9:
            return self
        a, b = a / lengths[0], b / lengths[1]
        axis, cosine = np.cross(a, b), float(a @ b)
        if cosine < -0.9999:
            axis, cosine = np.array([0.0, 0.0, 1e-9]), -1.0
        sine = float(np.linalg.norm(axis))
        if sine < 1e-12:
            return self
        axis /= sine

        def turned(v: np.ndarray) -> np.ndarray:  # Rodrigues
            along: np.ndarray = v * cosine + np.cross(axis, v) * sine + axis * float(axis @ v) * (1.0 - cosine)
            return along

        eye = np.add(self.target, turned(np.subtract(self.eye, self.target)))
        return dataclasses.replace(self, eye=_point(eye), up=_point(turned(np.array(self.upward))))

    def ray(self, column: float, row: float, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
        """Return origin [m] and unit direction of the ray through a place in a picture of `width` x `height` px."""
        u, v = (np.array([column, row]) - [0.5 * width, 0.5 * height]) / self._focal(height)
        across, forward = np.array([u, -v, 0.0]) @ self._axes, self._axes[2]
        if self.height is not None:
            return np.add(self.eye, across), forward
        direction = forward + across
        return np.array(self.eye), direction / np.linalg.norm(direction)

    def project(self, points: Any, width: int, height: int) -> np.ndarray:
        """Return column and row [px] and depth [m] of `points` [n, 3], shape [n, 3]; NaN pixels behind the eye."""
        c = (np.atleast_2d(points) - self.eye) @ self._axes.T
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = self._focal(height) * (1.0 if self.height else np.where(c[:, 2] > 0.0, 1.0 / c[:, 2], np.nan))
        return np.stack([0.5 * width + scale * c[:, 0], 0.5 * height - scale * c[:, 1], c[:, 2]], axis=1)

    @classmethod
    def framing(cls, scene: Any, aspect: float = 16 / 9) -> "Camera":
        """Return a camera that frames the tank: from slightly above in 3-D, straight from the front in 2-D."""
        return cls.framing_extent(extent_of(scene).turned(scene.upright), aspect).turned(scene.upright.T)

    @classmethod
    def framing_extent(cls, extent: Extent, aspect: float = 16 / 9) -> "Camera":
        """Return a camera that frames a box of the world."""
        if extent.dim == 2:
            return _front(cls, extent, aspect)
        return _three_quarter(cls, extent, aspect)

    @classmethod
    def looking(cls, frame: Any, eye: Any = None, target: Any = None, aspect: float = 16 / 9) -> "Camera":
        """Return a camera at `eye` [m] that looks at `target` [m]; what is None frames the water of `frame`."""
        turn = frame.scene.upright
        usual = cls.framing_extent(extent_of_water(frame).turned(turn), aspect).turned(turn.T)
        chosen = cls(
            eye=usual.eye if eye is None else eye,
            target=usual.target if target is None else target,
            up=usual.up,
            height=usual.height,
        )
        return chosen.tilted(frame.scene, frame.time, ROOM if eye is None else 1.0)

    def tilted(self, scene: Any, time: float, room: float = 1.0) -> "Camera":
        """Turn around the target as the tank of `scene` stands at `time` [s]: it is seen tilted, gravity points down.

        Where a tank ever tilts the camera shows `room` times as much height, so that corners stay in the picture.
        """
        if scene.tank is None or not scene.tank.is_tilted:
            return self
        upright, own = tilted_by(scene, time)
        return (self if room == 1.0 else self.zoom(room)).turned_with(tuple(upright), tuple(own))

    @property
    def _axes(self) -> np.ndarray:
        """Unit vectors (right, up, forward), [3, 3]."""
        return basis(np.subtract(self.target, self.eye), np.array(self.upward))

    def _focal(self, height: int) -> float:
        """Pixels per unit of the picture plane; pixels are square, so the height alone sets it."""
        return height / (self.height or 2.0 * math.tan(0.5 * self.field_of_view))


def _front(kind: type[Camera], extent: Extent, aspect: float) -> Camera:
    size = extent.upper - extent.lower
    height = max(1.28 * float(size[1]), 1.08 * float(size[0]) / aspect)
    # The legend stands below, so the world stands a little higher.
    middle = extent.middle - [0.0, min(0.055 * height, 0.5 * height - 0.55 * float(size[1])), 0.0]
    distance = max(float(size.max()), 10.0 * extent.spacing)
    return kind(
        eye=_point(middle + [0.0, 0.0, distance]), target=_point(middle), near=min(0.01, 0.1 * distance), height=height
    )


def _three_quarter(kind: type[Camera], extent: Extent, aspect: float) -> Camera:
    """Step back until all corners are in view, and move the target until they sit in the middle."""
    if aspect >= UPRIGHT:
        return _framed(kind, extent, aspect, FRAMING_AZIMUTH, FRAMING_ELEVATION)
    # An upright picture shows a long world from nearer its end and more from above, where it looks largest.
    places = [(math.radians(turn), math.radians(rise)) for turn in (30, 45, 60, 70) for rise in (20, 30, 40)]
    return min((_framed(kind, extent, aspect, *place) for place in places), key=lambda camera: camera.distance)


def _framed(kind: type[Camera], extent: Extent, aspect: float, azimuth: float, elevation: float) -> Camera:
    margin = 1.12
    target, toward = extent.middle.copy(), _direction(azimuth, elevation)
    camera = kind(eye=_point(target + toward), target=_point(target))
    right, up, _ = camera._axes
    steep = math.tan(0.5 * camera.field_of_view) / margin
    for _ in range(5):
        offset = extent.corners - target
        across, rise, ahead = offset @ right, offset @ up, offset @ toward
        need = np.maximum(np.abs(rise) / steep, np.abs(across) / (steep * aspect)) + ahead
        distance = float(need.max())
        u, v = across / (distance - ahead), rise / (distance - ahead)
        target = target + 0.5 * distance * ((u.max() + u.min()) * right + (v.max() + v.min()) * up)
    return kind(
        eye=_point(target + distance * toward), target=_point(target), near=max(1e-6, min(0.01, 0.01 * distance))
    )


def _direction(azimuth: float, elevation: float) -> np.ndarray:
    flat = math.cos(elevation)
    return np.array([flat * math.sin(azimuth), math.sin(elevation), flat * math.cos(azimuth)])


def _point(values: Sequence[float] | np.ndarray) -> Point:
    x, y, z = (float(value) for value in values)
    return x, y, z
