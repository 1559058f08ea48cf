"""What every tool has. A tool is one file: what it is called, its options, and what it does while it is held."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from wavetank.foundation.model import Model
from wavetank.session.tools.hand import Hand


def option(default: Any, low: float | None, high: float | None, unit: str, sentence: str) -> Any:
    """Declare an option: default, range (inclusive), unit and one sentence; fronts draw their controls from it."""
    limits: dict[str, Any] = {} if low is None else {"ge": low, "le": high, "allow_inf_nan": False}
    return Field(default=default, description=sentence, json_schema_extra={"unit": unit}, **limits)


Color = Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")]


class Tool(Model):
    """Something a hand can do. Lengths are shares of the world's length, speeds of the square root of g times it."""

    name: ClassVar[str]
    label: ClassVar[str]
    sentence: ClassVar[str]
    icon: ClassVar[str]  # SVG path in a square of 24, drawn with a line
    key: ClassVar[str] = ""
    through_water: ClassVar[bool] = False  # whether the pointer reaches what is under the surface
    cursor_radius: ClassVar[bool] = True  # whether fronts show `radius` around the pointer
    tilts: ClassVar[bool] = False  # whether it leans the tank, which pictures then show
    takes: ClassVar[str] = ""  # solid or body, where a click takes hold of one: fronts light it up

    @property
    def lasting(self) -> bool:
        """Whether this goes on when the pointer is lifted."""
        return bool(getattr(self, "keep", False))

    def begin(self, hand: Hand) -> None:
        """The pointer goes down, perhaps while time stands still."""

    def move(self, hand: Hand) -> None:
        """The pointer has moved, perhaps while time stands still."""

    def hold(self, hand: Hand, duration: float) -> None:
        """A frame of `duration` [s] is about to be computed."""

    def end(self, hand: Hand) -> None:
        """The pointer goes up, or the world is about to be another."""


def describe(tool: type[Tool]) -> dict[str, Any]:
    """Return a tool and its options as plain data, for fronts to draw."""
    options = []
    for name, field in tool.model_fields.items():
        low = next((m.ge for m in field.metadata if hasattr(m, "ge")), None)
        high = next((m.le for m in field.metadata if hasattr(m, "le")), None)
        extra: Any = field.json_schema_extra or {}
        choices = list(getattr(field.annotation, "__args__", ())) if isinstance(field.default, str) else []
        options.append(
            {
                "name": name,
                "default": field.default,
                "low": low,
                "high": high,
                "unit": extra.get("unit", ""),
                "sentence": field.description,
                "choices": choices,
            }
        )
    return {
        "name": tool.name,
        "label": tool.label,
        "sentence": tool.sentence,
        "icon": tool.icon,
        "key": tool.key,
        "cursor": tool.cursor_radius,
        "takes": tool.takes,
        "options": options,
    }


def dye_of(color: str, strength: float = 1.0) -> int:
    """Return a colour ``#rrggbb`` as a dye; 0, clear, for an empty one. See `state.Particles`."""
    return 0 if not color else max(1, round(127 * strength)) << 24 | int(color[1:], 16)
