"""An instant of a world on the device, for pictures: borrowed from a simulation, or uploaded from a `State`.

The device arrays of a simulation's frame are not copied: they are valid until the simulation moves on. Host copies are
made when they are first asked for, ordered by particle id, and stay valid.
"""

import dataclasses
import functools
from collections.abc import Callable
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device import compiler
from wavetank.device.compiler import download, upload
from wavetank.device.state import MARGIN, Diffuse, integers, new_diffuse, scalars, vectors
from wavetank.device.turns import TURN, one_at_a_time
from wavetank.foundation.errors import NotFiniteError, WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import FOAM, PARTICLES, Field, Instant, PlacedSolid, non_finite_rows
from wavetank.simulation.solids import Solids, solids_of
from wavetank.simulation.state import State
from wavetank.solids.distance import SolidSet


@dataclasses.dataclass(frozen=True)
class Frame(Instant):
    """One instant of a world on the device."""

    scene: Scene
    number: int  # frames since the start
    time: float  # s of water since the start
    count: int  # particles; the arrays may be longer
    x: Any  # device ndarray of vectors [capacity], m, in device order
    v: Any  # device ndarray of vectors [capacity], m/s
    rho: Any  # device ndarray f32 [capacity], kg/m^3
    id: Any  # device ndarray i32 [capacity]: particle id at each place of the device order
    dye: Any  # device ndarray i32 [capacity]: 0 or strength << 24 | red << 16 | green << 8 | blue, see `state.py`
    material: Any  # device ndarray i32 [capacity]: number of the material, see `Scene.palette`
    solids: SolidSet
    frozen: Any = None  # device ndarray i32 [capacity]: 1 where a particle is ice
    frozen_count: int = 0  # of them
    diffuse: Diffuse | None = None  # spray, foam and bubbles in device arrays, packed at the front
    foam_count: int = 0  # of them
    read_placed: Callable[[], tuple[PlacedSolid, ...]] = tuple  # reads `placed` of the simulation
    read_pressure: Callable[[], Any] | None = None  # reads `pressure` of the simulation

    @functools.cached_property
    def placed(self) -> tuple[PlacedSolid, ...]:
        """The solids at their poses, without the walls of the tank."""
        return self.read_placed()

    @functools.cached_property
    def pressure(self) -> Any:
        """The pressure at each particle [Pa], a device ndarray f32 in device order; 0 where none is known.

        Raises `WavetankError` in a frame of a file.
        """
        if self.read_pressure is None:
            raise WavetankError("this instant is from a file, which holds no pressures; look at it as it is computed.")
        return self.read_pressure()

    def check_finite(self) -> None:
        """Raise `NotFiniteError` where a position or a velocity is not finite."""
        bad = non_finite_rows(self.positions, self.velocities)
        if bad.any():
            row = int(np.argmax(bad))
            raise NotFiniteError(
                f"particle {self.ids[row]} at {self.positions[row].tolist()} m has the velocity "
                f"{self.velocities[row].tolist()} m/s at t = {self.time:.6g} s, which is not finite; neither are "
                f"{int(bad.sum()) - 1:,} others. Try shorter steps (substeps) or weaker forces."
            )

    def state(self) -> State:
        """Return a copy of this instant on the host, which stays valid, for writers that work beside the simulation."""
        return State(
            scene=self.scene,
            number=self.number,
            time=self.time,
            arrays={field.column: getattr(self, field.name) for field in PARTICLES}
            | {field.name: getattr(self, field.name) for field in FOAM},
            placed=self.placed,
        )

    @property
    def frozen_by_id(self) -> np.ndarray:
        """Whether each particle is ice, int32 [count], ordered by particle id."""
        return self._by_id("frozen")

    @property
    def pressure_by_id(self) -> np.ndarray:
        """The pressure at each particle [Pa], float32 [count], ordered by particle id; see `pressure`."""
        return self._by_id("pressure")

    @functools.cached_property
    def _order(self) -> np.ndarray:
        return np.argsort(download(self.id)[: self.count], kind="stable")

    @override
    @TURN
    def _by_id(self, column: str) -> np.ndarray:
        ordered: np.ndarray = download(getattr(self, column))[: self.count][self._order]
        return ordered

    @override
    @TURN
    def _of_foam(self, field: Field) -> np.ndarray:
        if self.diffuse is None:
            return field.zeros(0, self.dim)
        host: np.ndarray = download(getattr(self.diffuse, field.column))[: self.foam_count].copy()
        return host


@one_at_a_time()
class FrameBuffer:
    """Device arrays that hold one `State` at a time, for pictures of instants without their simulation."""

    def __init__(self, scene: Scene, arch: str = "cpu") -> None:
        compiler.start(arch)
        self.scene, self.arch = scene, compiler.current_backend()
        self._capacity, self._foam_capacity = -1, -1
        self._solids: Solids | None = None
        self._names: list[str] = []

    def frame(self, state: State) -> Frame:
        """Upload a state and return its frame, valid until the next one is asked for."""
        foam_count = len(state.foam_ids)
        self._allocate(state.count, foam_count)
        for field in PARTICLES:
            upload(self._water[field.column], getattr(state, field.name))
        for field in FOAM:
            upload(getattr(self._foam, field.column), getattr(state, field.name))
        return Frame(
            scene=self.scene,
            number=state.number,
            time=state.time,
            count=state.count,
            solids=self._place(state).device,
            diffuse=self._foam,
            foam_count=foam_count,
            read_placed=lambda: state.placed,
            **self._water,
        )

    def _allocate(self, count: int, foam: int) -> None:
        dim = self.scene.dim
        if count > self._capacity:
            rows, self._capacity = count + MARGIN, count
            x, v, rho = vectors(dim, rows), vectors(dim, rows), scalars(rows)
            ids, dye, material = (integers(rows) for _ in range(3))
            self._water = {"x": x, "v": v, "rho": rho, "id": ids, "dye": dye, "material": material}
        if foam > self._foam_capacity:
            self._foam, self._foam_capacity = new_diffuse(dim, foam), foam

    def _place(self, state: State) -> Solids:
        """Return the solids of a state on the device, at their poses."""
        names = [one.name for one in state.placed]
        if self._solids is None or names != self._names:
            walls = self.scene.tank.walls() if self.scene.tank else []
            self._solids = solids_of(self.scene, walls, [one.solid for one in state.placed])
            self._names = names
        solids = self._solids
        solids.targets.clear()
        for number, one in enumerate(state.placed, solids.tank_count):
            solids.targets[number] = (np.asarray(one.position, float), np.asarray(one.rotation, float))
        solids.arrive()
        solids.move_to(0.0, 0.0)
        return solids
