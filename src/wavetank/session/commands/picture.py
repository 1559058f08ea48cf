"""Commands for the camera, and for what is drawn."""

import math
from typing import Annotated, ClassVar, Literal

from pydantic import Field

from wavetank.scene.light import HIGHEST, LOWEST
from wavetank.session.commands.command import FARTHEST, Command, Name, Point, check_known
from wavetank.session.state import SessionState
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of

CLOSEST, WIDEST = 8.0, 6.0  # height in view: least, in spacings; most, in sizes of the world
MOST_CHANGE = 100.0  # of the camera by one command

Change = Annotated[float, Field(ge=-MOST_CHANGE, le=MOST_CHANGE, allow_inf_nan=False)]
Share = Annotated[float, Field(ge=-2, le=3, allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360, le=360, allow_inf_nan=False)]


class SetCamera(Command):
    """Set the camera."""

    do: Literal["camera"] = "camera"
    coalesces_by: ClassVar = ("do",)
    eye: Point  # m
    target: Point  # m
    up: Point = (0.0, 1.0, 0.0)
    field_of_view: Annotated[float, Field(gt=0.01, lt=3, allow_inf_nan=False)] = 0.4887
    height: Annotated[float, Field(gt=1e-6, le=FARTHEST, allow_inf_nan=False)] | None = None

    def apply(self, state: SessionState) -> None:
        """Set it."""
        state.camera = Camera(self.eye, self.target, self.up, self.field_of_view, height=self.height)


class Orbit(Command):
    """Turn the camera around its target."""

    do: Literal["orbit"] = "orbit"
    coalesces_by: ClassVar = ("do",)
    azimuth: Change = 0.0  # rad
    elevation: Change = 0.0  # rad

    def apply(self, state: SessionState) -> None:
        """Turn it; a 2-D world is always seen from the front."""
        if state.sim.scene.dim == 3:
            state.camera = state.camera.orbit(self.azimuth, self.elevation)

    def after(self, earlier: Command) -> Command:
        """Add both turns."""
        assert isinstance(earlier, Orbit)
        return Orbit.model_construct(
            azimuth=_clamped(self.azimuth + earlier.azimuth), elevation=_clamped(self.elevation + earlier.elevation)
        )


class Pan(Command):
    """Move the camera sideways, up and ahead, by shares of the height in view."""

    do: Literal["pan"] = "pan"
    coalesces_by: ClassVar = ("do",)
    right: Change = 0.0
    up: Change = 0.0
    ahead: Change = 0.0

    def apply(self, state: SessionState) -> None:
        """Move it, within `FARTHEST`."""
        moved = state.camera.pan(self.right, self.up, self.ahead)
        if max(abs(part) for part in moved.eye) < FARTHEST:
            state.camera = moved

    def after(self, earlier: Command) -> Command:
        """Add both moves."""
        assert isinstance(earlier, Pan)
        return Pan.model_construct(
            right=_clamped(self.right + earlier.right),
            up=_clamped(self.up + earlier.up),
            ahead=_clamped(self.ahead + earlier.ahead),
        )


class Zoom(Command):
    """Show `factor` times as much height."""

    do: Literal["zoom"] = "zoom"
    coalesces_by: ClassVar = ("do",)
    factor: Annotated[float, Field(ge=0.01, le=100, allow_inf_nan=False)]
    x: Share = 0.5  # of the picture's width and height: the point that does not move on the screen
    y: Share = 0.5

    def apply(self, state: SessionState) -> None:
        """Zoom, between `CLOSEST` and `WIDEST`."""
        camera, extent = state.camera, extent_of(state.sim.scene)
        nearest = math.log(CLOSEST * extent.spacing / camera.visible_height)
        farthest = math.log(WIDEST * 2.0 * extent.radius / camera.visible_height)
        factor = math.exp(min(max(math.log(self.factor), min(nearest, 0.0)), max(farthest, 0.0)))
        state.camera = camera.zoom(factor, state.aspect * (self.x - 0.5), 0.5 - self.y)

    def after(self, earlier: Command) -> Command:
        """Multiply both factors."""
        assert isinstance(earlier, Zoom)
        return Zoom.model_construct(factor=min(100.0, max(0.01, self.factor * earlier.factor)), x=self.x, y=self.y)


class Home(Command):
    """Frame the whole world."""

    do: Literal["home"] = "home"

    def apply(self, state: SessionState) -> None:
        """Frame it."""
        state.camera = None


class SetView(Command):
    """Choose what is drawn: a view of the renderer, the coloured quantity, where a slice lies, forces on bodies."""

    do: Literal["view"] = "view"
    coalesces_by: ClassVar = ("do",)
    view: Name = ""
    color_by: Name = ""
    axis: Literal["", "x", "y", "z"] = ""  # normal of the slice
    place: Annotated[float, Field(ge=0, le=1, allow_inf_nan=False)] | None = None  # of the slice along its normal
    forces: bool | None = None  # whether forces of the water on bodies are shown

    def apply(self, state: SessionState) -> None:
        """Choose it; what is not given stays."""
        from wavetank.view.choices import colorings, showing, views

        check_known("view", self.view, views())
        if not _is_color(self.color_by):
            check_known("color_by", self.color_by, colorings())
        state.view, state.color_by = self.view or state.view, self.color_by or state.color_by
        if self.color_by and not self.view:  # choosing a quantity switches to a view that shows it
            state.view = showing(state.view, self.color_by)
        if self.axis or self.place is not None:
            axis, place = state.cut
            state.cut = (self.axis or axis, place if self.place is None else self.place)
        state.shows_forces = state.shows_forces if self.forces is None else self.forces

    def after(self, earlier: Command) -> Command:
        """Keep what only the earlier one gives."""
        assert isinstance(earlier, SetView)
        return SetView.model_construct(
            view=self.view or earlier.view,
            color_by=self.color_by or earlier.color_by,
            axis=self.axis or earlier.axis,
            place=earlier.place if self.place is None else self.place,
            forces=earlier.forces if self.forces is None else self.forces,
        )


class SetLight(Command):
    """Choose an environment, and the direction of its sun [deg]; `turn` and `rise` are relative.

    Choosing an environment resets the sun to that environment's own.
    """

    do: Literal["light"] = "light"
    coalesces_by: ClassVar = ("do",)
    environment: Name = ""
    azimuth: Degrees | None = None  # from +z towards +x
    elevation: Annotated[float, Field(ge=LOWEST, le=HIGHEST, allow_inf_nan=False)] | None = None
    turn: Degrees = 0.0
    rise: Degrees = 0.0

    def apply(self, state: SessionState) -> None:
        """Choose both."""
        from wavetank.view.choices import standing
        from wavetank.view.environments import ENVIRONMENTS

        check_known("environment", self.environment, ENVIRONMENTS)
        if self.environment:
            state.light = {"environment": self.environment}
        if self.azimuth is not None or self.elevation is not None or self.turn or self.rise:
            now = standing(state.sim.scene, state.view, state.light)
            azimuth = now.azimuth if self.azimuth is None else self.azimuth
            elevation = now.elevation if self.elevation is None else self.elevation
            height = min(HIGHEST, max(LOWEST, elevation + self.rise))
            state.light = state.light | {"sun": f"{(azimuth + self.turn) % 360.0:.6g},{height:.6g}"}

    def after(self, earlier: Command) -> Command:
        """Add both turns, except those before an absolute direction."""
        assert isinstance(earlier, SetLight)
        if self.environment:
            return self
        placed, raised = self.azimuth is not None, self.elevation is not None
        return SetLight.model_construct(
            environment=earlier.environment,
            azimuth=self.azimuth if placed else earlier.azimuth,
            elevation=self.elevation if raised else earlier.elevation,
            turn=self.turn if placed else (self.turn + earlier.turn) % 360.0,
            rise=self.rise if raised else min(360.0, max(-360.0, self.rise + earlier.rise)),
        )


def _is_color(value: str) -> bool:
    return len(value) == 7 and value[0] == "#" and all(digit in "0123456789abcdefABCDEF" for digit in value[1:])


def _clamped(value: float) -> float:
    return min(MOST_CHANGE, max(-MOST_CHANGE, value))
