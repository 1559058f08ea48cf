"""Wave maker: a piston at the end of the tank, with regular or random waves.

The stroke S (1 - cos wt) starts at rest. Random waves are a sum of eight sines with frequencies around the given one
and phases by the golden ratio, the same in every run.
"""

from typing import ClassVar, Literal

import numpy as np
from pydantic import PrivateAttr
from typing_extensions import override

from wavetank.session.tools.hand import Hand
from wavetank.session.tools.solids import TOOL_SOLID
from wavetank.session.tools.tool import Tool, option
from wavetank.solids.shapes import Box

GOLDEN = 0.6180339887


class Waves(Tool):
    """Make waves with a piston."""

    name: ClassVar[str] = "waves"
    label: ClassVar[str] = "Waves"
    sentence: ClassVar[str] = "Click near an end of the tank: a piston there makes waves until it is stopped."
    icon: ClassVar[str] = "M2 9c3-4 6-4 9 0s6 4 11 0M2 16c3-4 6-4 9 0s6 4 11 0"
    key: ClassVar[str] = "w"
    cursor_radius: ClassVar[bool] = False

    stroke: float = option(0.04, 0.005, 0.15, "L", "Half of the piston's stroke.")
    frequency: float = option(0.45, 0.05, 2.0, "√(g/L)", "Frequency, in units of the tank's own.")
    kind: Literal["sine", "random"] = option("sine", None, None, "", "Regular or random waves.")
    keep: bool = option(True, None, None, "", "Keeps running when you let go.")
    _held: str = PrivateAttr("")
    _time: float = PrivateAttr(0.0)
    _side: float = PrivateAttr(1.0)
    _home: np.ndarray | None = PrivateAttr(None)

    @override
    def begin(self, hand: Hand) -> None:
        size = hand.upper - hand.lower
        thick = 2.0 * self.stroke * hand.size + 2.0 * hand.spacing
        along = hand.axes[0]
        left = hand.anchor[along] < 0.5 * (hand.lower[along] + hand.upper[along])
        self._side = 1.0 if left else -1.0
        self._home = hand.lower + 0.5 * size
        self._home[along] = hand.lower[along] - 0.5 * thick if left else hand.upper[along] + 0.5 * thick
        plate = size.copy()
        plate[along] = thick
        box = Box(name=f"{TOOL_SOLID}piston", center=hand.flat(self._home), size=hand.flat(plate))
        self._held = hand.sim.add_solid(box)

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        if self._held not in hand.sim.solids.names or self._home is None:
            return
        self._time += duration
        f = self.frequency * np.sqrt(9.81 / hand.size)
        if self.kind == "sine":
            way = 1.0 - np.cos(2.0 * np.pi * f * self._time)
        else:
            k = np.arange(8)
            waves = np.sin(2.0 * np.pi * (f * (0.5 + k / 7.0) * self._time + k * GOLDEN))
            way = (1.0 + np.clip(waves.sum() / 3.0, -1.0, 1.0)) * min(1.0, f * self._time)
        place = self._home + hand.along_axes(self._side * self.stroke * hand.size * way, 0.0, 0.0)
        hand.sim.move(self._held, hand.flat(place))

    @override
    def end(self, hand: Hand) -> None:
        if self._held in hand.sim.solids.names:
            hand.sim.remove_solid(self._held)
