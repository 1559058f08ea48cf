"""Figures of a whole run: means, worst values, the last frame."""

from typing import Any

from wavetank.foundation.errors import NotFiniteError
from wavetank.simulation.simulation import Simulation

WORST = ("density_error_mean", "density_error_p99", "speed_max")


class Summary:
    """Collects the figures of a run; of one that is resumed, `before` are its sums and `last` those of its last frame.

    What only a step leaves, such as its duration, is lost where a run is resumed: only `add` reads it.
    """

    def __init__(
        self, sim: Simulation, before: dict[str, Any] | None = None, last: dict[str, float] | None = None
    ) -> None:
        self.sim, self.interrupted = sim, False
        self.broken: NotFiniteError | None = None
        self.last = last or {}
        self._sums: dict[str, float] = {"frames": 0, "error": 0.0, "milliseconds": 0.0, "begin": sim.time}
        self._sums |= {f"worst {name}": 0.0 for name in WORST} | {"rise": 0.0}
        for name, value in (before or {}).items():
            if (name in (*self._sums, "energy_start", "energy") or name.startswith("power ")) and isinstance(
                value, int | float
            ):
                self._sums[name] = value

    def plain(self) -> dict[str, float]:
        """Return the sums so far, for a checkpoint."""
        return {**self._sums}

    def add(self) -> None:
        """Add the figures of the current frame."""
        row, sums = self.sim.stats(), self._sums
        energy = row["kinetic_energy"] + row["potential_energy"]
        if sums["frames"]:
            sums["milliseconds"] += row["milliseconds_per_frame"]
            sums["rise"] = max(sums["rise"], energy - sums["energy"])
        else:
            sums["energy_start"] = energy
        for name in WORST:
            sums[f"worst {name}"] = max(sums[f"worst {name}"], row[name])
        for name in self.sim.joints.motors:  # joints in a ring have no power of their own
            sums[f"power {name}"] = sums.get(f"power {name}", 0.0) + row.get(f"joints.{name}.power", 0.0)
        sums["error"] += row["density_error_mean"]
        sums["frames"], sums["energy"], self.last = sums["frames"] + 1, energy, row

    def figures(self) -> dict[str, Any]:
        """Return means, worst values and the last frame's figures."""
        if not self._sums["frames"] and self.broken is None:
            self.add()
        sums, frames = self._sums, int(self._sums["frames"])
        joints = {name.removeprefix("power "): total for name, total in sums.items() if name.startswith("power ")}
        return {
            "scene": self.sim.scene.title,
            "arch": self.sim.arch,
            "interrupted": self.interrupted,
            **({"broken": str(self.broken)} if self.broken is not None else {}),
            **({"notes": [*self.sim.notes]} if self.sim.notes else {}),
            "seconds_of_water": self.sim.time - sums["begin"],
            "energy_start": sums.get("energy_start", 0.0),
            "worst": {name: sums[f"worst {name}"] for name in WORST} | {"energy_rise": sums["rise"]},
            "mean": {
                "density_error_mean": sums["error"] / max(frames, 1),
                "milliseconds_per_frame": sums["milliseconds"] / (frames - 1) if frames > 1 else None,
                **({"power": {name: total / max(frames - 1, 1) for name, total in joints.items()}} if joints else {}),
            },
            "last": self.last,
            **({} if self.broken is not None else {"digest": self.sim.digest()}),
        }
