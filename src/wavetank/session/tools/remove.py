"""Remove: removes the solid under the pointer."""

from typing import ClassVar

from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool


class Remove(Tool):
    """Remove a solid."""

    name: ClassVar[str] = "remove"
    label: ClassVar[str] = "Remove"
    sentence: ClassVar[str] = "Click a solid to remove it."
    icon: ClassVar[str] = "M12 3l8 4.5v5M4 7.5v9L12 21M12 12 4 7.5 12 3M12 12v9M12 12l8-4.5M16 16l5 5M21 16l-5 5"
    key: ClassVar[str] = "x"
    cursor_radius: ClassVar[bool] = False
    through_water: ClassVar[bool] = True
    takes: ClassVar[str] = "solid"

    @override
    def begin(self, hand: Hand) -> None:
        if hand.hit.kind != "solid":
            hand.notes.append("There is no solid under the pointer.")
            return
        hand.sim.remove_solid(hand.hit.name)
