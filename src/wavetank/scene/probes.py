"""Pressure gauges and load cells: `[[probes]]` in a scene file."""

from collections.abc import Collection, Mapping
from typing import Annotated, Any

from pydantic import Field, model_validator

from wavetank.foundation.model import Model, Place
from wavetank.solids.solid import ENDLESS


class Probe(Model):
    """Measures the pressure [Pa] at a place in the liquid, or the load on a whole solid.

    A place with a `solid` moves as that does from the start on.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    at: Place | None = None  # m, at the start; None for force [N] and moment [N m] on the solid
    solid: str = ""  # its name; without `at` a wall of the tank too, such as "tank y lower"

    @model_validator(mode="after")
    def _measures(self) -> "Probe":
        if self.at is None and not self.solid:
            raise ValueError(f"the probe {self.name!r} needs a place, at = [...], or a solid.")
        return self

    def vectors(self) -> list[tuple[str, tuple[float, ...]]]:
        """Name the place."""
        return [("at", self.at)] if self.at is not None else []


def check_probes(probes: list[Probe], solids: Mapping[str, Any], walls: Collection[str], *, has_grid: bool) -> None:
    """Raise `ValueError` for probes of a world without the pressure grid, and of none of the `solids` and `walls`."""
    if probes and not has_grid:
        raise ValueError(
            "probes read the pressure grid, which this world does not have; give it a tank, and grid_pressure above 0."
        )
    for number, probe in enumerate(probes):
        if probe.solid and probe.solid not in solids and (probe.at is not None or probe.solid not in walls):
            known = ", ".join([*sorted(solids), *(walls if probe.at is None else [])]) or "none"
            where = f"probes[{number}].solid = {probe.solid!r}"
            raise ValueError(f"{where} is not a solid of the scene; they are: {known}.")
        if probe.at is None and probe.solid in solids and solids[probe.solid].reach() >= ENDLESS:
            raise ValueError(
                f"probes[{number}].solid = {probe.solid!r} has no end, and so no force on it; give a place, at = [...]."
            )
