"""Joints between bodies, or between a body and the world, as plain data: `[[joints]]` in a scene file."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from pydantic import Field, model_validator

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.model import Model, Number, Place, Positive, Vector, register_model
from wavetank.foundation.tracks import checked_track

#: A number, an expression of t [s], or keyframes.
Driven = Number | str | list[object] | dict[str, object]
NotNegative = Annotated[Number, Field(ge=0)]


class Joint(Model):
    """The base class of joints: a name, the two solids that it connects, and a point."""

    name: str = ""
    first: str  # name of a solid
    second: str = ""  # name of another one; the world where empty
    at: Place  # m: where the joint is at the start

    def vectors(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Name every point and direction, to check that all have the dimension of the world."""
        yield "at", self.at


class _Motor(Joint):
    speed: Driven | None = None  # of a motor, rad/s or m/s; none where None
    target: Driven | None = None  # rad or m from where it begins: where a motor turns or pushes it to
    response: Positive = 0.03  # s in which it gets 95 % of the way to its target
    strength: Positive = 1e6  # the most that the motor gives, N m or N
    limits: tuple[Number, Number] | None = None  # rad or m: how far it goes from where it begins

    @model_validator(mode="after")
    def _one_aim(self) -> "_Motor":
        if self.speed is not None and self.target is not None:
            raise ValueError("a motor has a speed or a target, not both; leave one of them out.")
        for name in ("speed", "target"):
            if getattr(self, name) is not None:
                try:
                    checked_track(getattr(self, name), name)
                except WavetankError as error:
                    raise ValueError(str(error)) from None
        return self

    @model_validator(mode="after")
    def _limits_in_order(self) -> "_Motor":
        if self.limits is not None and self.limits[0] > self.limits[1]:
            raise ValueError(f"limits = {self.limits} of a joint must be a lower and an upper one, in this order.")
        target = self.target
        if self.limits is not None and isinstance(target, int | float):
            if not self.limits[0] <= target <= self.limits[1]:
                raise ValueError(
                    f"target = {target:g} of a joint is outside of its limits = {self.limits}; "
                    "choose a target between them."
                )
        return self


class Hinge(_Motor):
    """Lets the first solid turn about an axis, as a wheel or a door does; in a 2-D world about z."""

    kind: Literal["hinge"] = "hinge"
    axis: tuple[Number, Number, Number] = (0.0, 0.0, 1.0)

    @model_validator(mode="after")
    def _has_axis(self) -> "Hinge":
        if not any(self.axis):
            raise ValueError("axis = (0, 0, 0) of a hinge has no direction; give a vector of any length but zero.")
        return self


class Slider(_Motor):
    """Lets the first solid slide along an axis, as a gate or a piston does."""

    kind: Literal["slider"] = "slider"
    axis: Vector

    def vectors(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Name every point and direction."""
        yield from super().vectors()
        yield "axis", self.axis

    @model_validator(mode="after")
    def _has_axis(self) -> "Slider":
        if not any(self.axis):
            raise ValueError(f"axis = {self.axis} of a slider has no direction; give a vector of any length but zero.")
        return self


class BallJoint(Joint):
    """Holds a point of both solids together; both may turn about it freely."""

    kind: Literal["ball-joint"] = "ball-joint"


class Weld(Joint):
    """Holds both solids together as they are at the start."""

    kind: Literal["weld"] = "weld"


class _Line(Joint):
    to: Place  # m: the other end, on the second solid or in the world

    def vectors(self) -> Iterator[tuple[str, Sequence[float]]]:
        """Name every point."""
        yield from super().vectors()
        yield "to", self.to


class Rope(_Line):
    """Keeps two points from being farther apart than the rope is long."""

    kind: Literal["rope"] = "rope"
    length: Annotated[Positive, "m"] | None = None  # m; from one end to the other where None


class Spring(_Line):
    """Pulls two points together, or apart, to a length of rest."""

    kind: Literal["spring"] = "spring"
    length: Annotated[Positive, "m"] | None = None  # m, at rest; from one end to the other where None
    stiffness: Positive  # N/m
    damping: NotNegative = 0.0  # N s/m


JOINTS: tuple[type[Joint], ...] = (Hinge, Slider, BallJoint, Weld, Rope, Spring)
AnyJoint = Annotated[Hinge | Slider | BallJoint | Weld | Rope | Spring, Field(discriminator="kind")]
for _joint in JOINTS:
    register_model(_joint.model_fields["kind"].default, _joint)


def check_joints(joints: Sequence[Joint], bodies: dict[str, bool]) -> None:
    """Raise `ValueError` for a joint without a body; `bodies` says of each named solid whether it is a body."""
    for number, joint in enumerate(joints):
        for key, name in (("first", joint.first), ("second", joint.second)):
            if name not in bodies and (name or key == "first"):
                known = ", ".join(sorted(bodies)) or "none"
                raise ValueError(
                    f"joints[{number}].{key} = {name!r} is not a solid of the scene; named solids: {known}."
                )
        if joint.first == joint.second:
            raise ValueError(
                f"joints[{number}] joins {joint.first!r} to itself; give another solid as second, or none."
            )
        if not (bodies[joint.first] or bodies.get(joint.second, False)):
            raise ValueError(
                f"joints[{number}] joins {joint.first!r} to {joint.second or 'the world'!r}, neither of them a body; "
                "give one of them a density or a mass."
            )
