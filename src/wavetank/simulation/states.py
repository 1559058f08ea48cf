"""States of a running world: instants in memory, copies, files, and the one digest by which all are compared."""

import dataclasses
from abc import ABC, abstractmethod
from copy import deepcopy
from pathlib import Path
from typing import Any, Self

from wavetank.foundation.input_limits import explain_errors, printable
from wavetank.scene.forces import Force
from wavetank.scene.scene import Scene
from wavetank.scene.schedule import with_gravity
from wavetank.simulation import snapshot as snapshots
from wavetank.simulation.bodies import Bodies
from wavetank.simulation.contents import Contents
from wavetank.simulation.cost import check_cost
from wavetank.simulation.coupling import density_in
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.simulation.saved import read_snapshot, write_snapshot
from wavetank.simulation.snapshot import Snapshot
from wavetank.simulation.sources import Sources
from wavetank.solids.solid import Solid

#: Of a scene, what the water does not feel, or has left behind it.
UNFELT: Any = {
    **dict.fromkeys(("fluids", "title", "goal", "preset", "quality", "light", "film"), True),
    "materials": {"__all__": {"clarity", "glow"}},
}


class States(Contents, ABC):
    """How a world is kept and comes back. See `Simulation` for how it moves, and for what is abstract here."""

    arch: str | None
    solids: MovingSolids
    bodies: Bodies
    forces: list[Force]
    pushed: list[Force]
    gravity_by_hand: tuple[float, ...] | None

    @abstractmethod
    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        """Begin with what the scene says."""

    @abstractmethod
    def _fill(self, capacity: int) -> None:
        """Make an empty world with room for `capacity` particles."""

    @abstractmethod
    def _walls(self) -> list[Solid]:
        """Return the solids that the tank is."""

    @abstractmethod
    def _renew_solids(self, density: float = 0.0) -> None:
        """Put the solids as they are now on the device."""

    def become(self, other: Self) -> None:
        """Take over all that `other` is, which must not be used any more; who holds this object holds that world."""
        self.__dict__.clear()
        self.__dict__.update(other.__dict__)

    def snapshot(self) -> Snapshot:
        """Return this instant as host arrays, for `resume`."""
        taken = snapshots.take_snapshot(self.scene, self.world, self.solids, self.ledger)
        sources = self.sources.plain() if self.sources else {}
        return dataclasses.replace(taken, arrays=taken.arrays | self.bodies.state_arrays(), sources=sources)

    def resume(self, snapshot: Snapshot) -> None:
        """Go back (or on) to an instant; parameters and forces stay as they are now."""
        self.scene.assign("solids", snapshot.solids)
        self.solids = snapshots.restore_solids(self.scene, self._walls(), snapshot)
        if snapshot.ledger.capacity > self.ledger.capacity:
            self._fill(snapshot.ledger.capacity)
        self._renew_solids(density_in(snapshot.arrays))
        before, self.ledger, self.pushed = self.ledger, snapshot.ledger.copy(), []
        self.ledger.capacity = before.capacity
        self.ledger.next_id = max(self.ledger.next_id, before.next_id)
        snapshots.put_particles(snapshot, self.scene, self.world, self.ledger.capacity)
        self.bodies.restore(snapshot.arrays)
        self.sources = Sources(self.scene)
        self.sources.read(snapshot.sources)

    def clone(self) -> Self:
        """Return a world of its own that goes on from here to the same bits, with the same forces and parameters."""
        empty = self.scene.model_copy(update={"fluids": [], "solids": []})
        copy = type(self)(empty, self.arch or "cpu")
        copy.scene = self.scene.model_copy(deep=True)
        copy.resume(dataclasses.replace(self.snapshot(), solids=[*copy.scene.solids]))
        copy.forces, copy.pushed = deepcopy((self.forces, self.pushed))
        copy.gravity_by_hand = self.gravity_by_hand
        return copy

    def digest(self) -> str:
        """Return the hex SHA-256 of all that decides the future, to the last bit: `snapshot.digest` says of what.

        Equal digests go on to equal digests, on the same back end. Forces that a script added are not part of it.
        """
        return snapshots.digest(self.snapshot(), self._rules())

    def _rules(self) -> str:
        """Return the scene as it is now, but for what is of the past, or for people."""
        scene = self.scene if self.gravity_by_hand is None else with_gravity(self.scene, self.gravity_by_hand)
        return scene.model_dump_json(exclude=UNFELT)

    def save(self, path: str | Path, *, lasting: bool = False) -> None:
        """Write the whole state to an .npz file, replaced in one move; `restore` continues from it exactly.

        A `lasting` one is on the disk before this returns. Raises `WavetankError` for water that holds numbers which
        are none.
        """
        scene = self.scene if self.gravity_by_hand is None else with_gravity(self.scene, self.gravity_by_hand)
        write_snapshot(path, self.snapshot(), scene.model_dump_json(exclude={"fluids"}), lasting=lasting)

    @classmethod
    def restore(cls, path: str | Path, arch: str = "cpu") -> Self:
        """Continue from a file that `save` wrote, bit for bit on the same back end.

        Raises `WavetankError` for any other file, one that is damaged, and one that needs too much memory.
        """
        snapshot, scene = read_snapshot(path)
        with explain_errors(printable(path), "state"):
            check_cost(scene, snapshot.ledger.capacity)
            self = cls(scene, arch)
            self.resume(snapshot)
            self.bodies.check_poses(snapshot.poses)
        return self
