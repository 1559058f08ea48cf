"""Forces beside gravity: one file each, listed here. A scene names them under ``[[forces]]`` by their `kind`."""

from typing import Annotated

from pydantic import Field

from wavetank.forces.attract import Attract
from wavetank.forces.burst import Burst
from wavetank.forces.drag import Drag
from wavetank.forces.force import Force
from wavetank.forces.sway import Sway
from wavetank.forces.vortex import Vortex
from wavetank.forces.wind import Wind
from wavetank.model import register_model

FORCES: tuple[type[Force], ...] = (Wind, Attract, Vortex, Drag, Burst, Sway)
AnyForce = Annotated[Wind | Attract | Vortex | Drag | Burst | Sway, Field(discriminator="kind")]
for _force in FORCES:
    register_model(_force.model_fields["kind"].default, _force)

__all__ = ["FORCES", "AnyForce", "Attract", "Burst", "Drag", "Force", "Sway", "Vortex", "Wind"]
