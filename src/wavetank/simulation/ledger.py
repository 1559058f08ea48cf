"""What a running world remembers besides its particles and solids."""

import dataclasses
from typing import Any

import numpy as np


@dataclasses.dataclass
class Ledger:
    """Plain numbers; `plain` and `read` are their way to a file and back."""

    time: float = 0.0  # s of water since the start
    frame_number: int = 0  # frames since the start
    capacity: int = 0  # particles that there is room for
    owed: float = 0.0  # s that `advance` was asked for and has not computed yet
    next_id: int = 0  # of the particle that comes next
    fastest_start: float = 0.0  # m/s, of any particle when it came
    fastest_solid: float = 0.0  # m/s, of any solid so far
    fastest_force: float = 0.0  # m/s that forces can have given
    steepest: float = 0.0  # m^2/s^2: half the square of the speed of the longest fall that gravity gave so far
    start_box: tuple[np.ndarray, np.ndarray] = dataclasses.field(
        default_factory=lambda: (np.zeros(3), np.zeros(3))
    )  # m, lower and upper corner of the particles at the start

    def copy(self) -> "Ledger":
        """Return another one with the same numbers."""
        return dataclasses.replace(self)

    def plain(self) -> dict[str, Any]:
        """Return the numbers by their names, as JSON has them."""
        numbers = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        return {**numbers, "start_box": [corner.tolist() for corner in self.start_box]}

    @classmethod
    def read(cls, numbers: dict[str, Any]) -> "Ledger":
        """Return what `plain` wrote; raises `KeyError` where a number is missing."""
        lower, upper = numbers["start_box"]
        known = {field.name: numbers[field.name] for field in dataclasses.fields(cls) if field.name != "steepest"}
        known["steepest"] = numbers.get("steepest", 0.0)  # states of before have none
        return cls(**{**known, "start_box": (np.array(lower), np.array(upper))})
