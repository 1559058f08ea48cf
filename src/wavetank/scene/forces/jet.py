"""What holds the speed of a jet in the mouth of an emitter: no force of a scene, but applied as one."""

from typing import Any

from typing_extensions import override

from wavetank.scene.forces.force import Force


class Jet(Force):
    """Holds the speed of a jet in the mouth; emitters push with it."""

    opening: Any  # `physics.forces.jet.Opening`

    @override
    def largest_speed(self) -> float:
        return float(self.opening.speed)
