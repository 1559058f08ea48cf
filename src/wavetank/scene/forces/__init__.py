"""Forces beside gravity: one file each, listed here. A scene names them under ``[[forces]]`` by their `kind`."""

from typing import Annotated

from pydantic import Field

from wavetank.foundation.model import register_model
from wavetank.scene.forces.attract import Attract
from wavetank.scene.forces.burst import Burst
from wavetank.scene.forces.drag import Drag
from wavetank.scene.forces.force import Force
from wavetank.scene.forces.sway import Sway
from wavetank.scene.forces.vortex import Vortex
from wavetank.scene.forces.wind import Wind

FORCES: tuple[type[Force], ...] = (Wind, Attract, Vortex, Drag, Burst, Sway)
AnyForce = Annotated[Wind | Attract | Vortex | Drag | Burst | Sway, Field(discriminator="kind")]
for _force in FORCES:
    register_model(_force.model_fields["kind"].default, _force)

__all__ = ["FORCES", "AnyForce", "Attract", "Burst", "Drag", "Force", "Sway", "Vortex", "Wind"]
