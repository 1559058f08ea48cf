"""The base class of tools. A tool is one file: name, texts, options, and what it does while it is held."""

from typing import Annotated, Any, ClassVar

from pydantic import Field

from wavetank.foundation.model import Model
from wavetank.session.tools.hand import Hand


def option(default: Any, low: float | None, high: float | None, unit: str, sentence: str) -> Any:
    """Declare an option: default, inclusive range, unit and one sentence, from which its control is made."""
    limits: dict[str, Any] = {} if low is None else {"ge": low, "le": high, "allow_inf_nan": False}
    return Field(default=default, description=sentence, json_schema_extra={"unit": unit}, **limits)


Color = Annotated[str, Field(pattern=r"^(#[0-9a-fA-F]{6})?$")]


class Tool(Model):
    """What a pointer does to the world. Lengths are in units of the world's length L, speeds in sqrt(g L)."""

    name: ClassVar[str]
    label: ClassVar[str]
    sentence: ClassVar[str]
    icon: ClassVar[str]  # SVG path in a square of 24, drawn with a line
    key: ClassVar[str] = ""
    through_water: ClassVar[bool] = False  # whether the pointer's ray ignores the water
    cursor_radius: ClassVar[bool] = True  # whether `radius` is shown around the pointer
    tilts: ClassVar[bool] = False  # whether it tilts the tank, which pictures then show
    takes: ClassVar[str] = ""  # "solid" or "body": what a click would take, which is then highlighted

    @property
    def lasting(self) -> bool:
        """Whether this runs on when the pointer is lifted."""
        return bool(getattr(self, "keep", False))

    def begin(self, hand: Hand) -> None:
        """Handle the pointer going down, perhaps while paused."""

    def move(self, hand: Hand) -> None:
        """Handle a movement of the pointer, perhaps while paused."""

    def hold(self, hand: Hand, duration: float) -> None:
        """Act on the next frame, of `duration` [s]."""

    def end(self, hand: Hand) -> None:
        """Handle the pointer going up, or the end of this world."""


def describe(tool: type[Tool]) -> dict[str, Any]:
    """Return a tool and its options as plain data, for the controls of a page."""
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
