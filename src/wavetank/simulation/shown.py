"""Instants that were kept, on the device again, where pictures are made of them."""

from typing import Any

import numpy as np

from wavetank.device import compiler
from wavetank.device.compiler import upload
from wavetank.device.state import MARGIN, integers, new_diffuse, scalars, vectors
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame
from wavetank.simulation.instant import Instant
from wavetank.simulation.moving_solids import MovingSolids, solids_of

FOAM_ROWS = {
    "foam_positions": "x",
    "foam_velocities": "v",
    "foam_kinds": "kind",
    "foam_ages": "age",
    "foam_lives": "life",
    "foam_ids": "id",
}


class Shown:
    """Room on the device for one instant at a time of a scene; nothing of it moves."""

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.scene, self.arch = scene, compiler.current_backend()
        self._room, self._foam_room = -1, -1
        self._solids: MovingSolids | None = None
        self._names: list[str] = []

    def frame(self, instant: Instant) -> Frame:
        """Return a frame of an instant for a renderer, valid until the next one is asked for."""
        self._make_room(instant.count, len(instant.foam_ids))
        arrays: dict[str, Any] = {
            "x": instant.positions,
            "v": instant.velocities,
            "rho": instant.densities,
            "id": instant.ids,
            "dye": instant.dyes,
            "material": instant.materials,
        }
        for name, values in arrays.items():
            upload(self._water[name], values)
        for name, row in FOAM_ROWS.items():
            upload(getattr(self._foam, row), getattr(instant, name))
        return Frame(
            scene=self.scene,
            number=instant.number,
            time=instant.time,
            count=instant.count,
            solids=self._place(instant).device,
            diffuse=self._foam,
            foam_count=len(instant.foam_ids),
            stand=lambda: instant.standing,
            **self._water,
        )

    def _make_room(self, count: int, foam: int) -> None:
        dim = self.scene.dim
        if count > self._room:
            rows, self._room = count + MARGIN, count
            x, v, rho = vectors(dim, rows), vectors(dim, rows), scalars(rows)
            ids, dye, material = (integers(rows) for _ in range(3))
            self._water = {"x": x, "v": v, "rho": rho, "id": ids, "dye": dye, "material": material}
        if foam > self._foam_room:
            self._foam, self._foam_room = new_diffuse(dim, foam), foam

    def _place(self, instant: Instant) -> MovingSolids:
        """Put the solids where they stood."""
        names = [one.name for one in instant.standing]
        if self._solids is None or names != self._names:
            walls = self.scene.tank.walls() if self.scene.tank else []
            others = [one.solid for one in instant.standing]
            self._solids = solids_of(self.scene, walls, others)
            self._names = names
        solids = self._solids
        solids.targets.clear()
        for number, one in enumerate(instant.standing, solids.tank_count):
            solids.targets[number] = (np.asarray(one.position, float), np.asarray(one.rotation, float))
        solids.arrive()
        solids.move_to(0.0, 0.0)
        return solids
