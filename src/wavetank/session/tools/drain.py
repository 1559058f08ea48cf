"""Drain: removes the water at the pointer, and attracts more."""

from typing import ClassVar

from typing_extensions import override

from wavetank.scene.drains import Drain as Sink
from wavetank.session.tools.hand import Hand
from wavetank.session.tools.tool import Tool, option
from wavetank.simulation.sources import drain_particles, suction_of


class Drain(Tool):
    """Remove water."""

    name: ClassVar[str] = "drain"
    label: ClassVar[str] = "Drain"
    sentence: ClassVar[str] = "Hold to drain water away."
    icon: ClassVar[str] = "M3 7c3-2 6-2 9 0s6 2 9 0M12 10v10m-4-4 4 4 4-4"
    key: ClassVar[str] = "5"

    radius: float = option(0.08, 0.01, 0.5, "L", "Radius of the drain.")
    suction: float = option(3.0, 0.0, 20.0, "9.81 m/s²", "Acceleration towards it.")
    keep: bool = option(False, None, None, "", "Keeps running when you let go.")

    @override
    def hold(self, hand: Hand, duration: float) -> None:
        place, radius = hand.pick_again().point, hand.radius(self.radius)
        sink = Sink(center=hand.flat(place), radius=0.5 * radius, suction=9.81 * self.suction)
        drain_particles(hand.sim.particles, sink)
        hand.sim.push(suction_of(sink))
