"""What is in a running world: arrays by particle id, an instant as a frame, figures."""

from typing import Any

import numpy as np

from wavetank.device.state import KINDS
from wavetank.physics import measure, population
from wavetank.physics.measure import neighbor_numbers, update_densities
from wavetank.physics.world import World
from wavetank.scene.scene import Scene
from wavetank.simulation.arrays import check_crowd, check_rows, largest_norm, put_by_id
from wavetank.simulation.bodies import Bodies
from wavetank.simulation.frame import Frame
from wavetank.simulation.instant import Standing
from wavetank.simulation.ledger import Ledger
from wavetank.simulation.moving_solids import MovingSolids
from wavetank.simulation.sources import Sources


class Contents:
    """What can be read of a world, and written where it has a setter. See `Simulation` for how it moves."""

    scene: Scene
    arch: str | None
    world: World
    ledger: Ledger
    sources: Sources
    solids: MovingSolids
    bodies: Bodies
    time_steps: int  # of the last frame
    seconds_per_frame: float  # that the last frame took to compute
    _outdated: bool  # whether the water moved since its densities were measured

    def __repr__(self) -> str:
        """Say what a person would: which scene, how far it has come, how much water."""
        bodies = f", {len(self.bodies)} bod{'y' if len(self.bodies) == 1 else 'ies'}" if self.bodies else ""
        title = self.scene.title or "without title"
        return (
            f"<Simulation {title!r}: t = {self.time:.3f} s, {self.count:,} particles of {self.scene.spacing:g} m in "
            f"{self.scene.dim}-D{bodies}, on {self.arch}>"
        )

    @property
    def time(self) -> float:
        """Seconds of water since the start [s]."""
        return self.ledger.time

    @property
    def frame_number(self) -> int:
        """Frames since the start."""
        return self.ledger.frame_number

    @property
    def count(self) -> int:
        """Number of particles."""
        return self.world.count

    @property
    def positions(self) -> np.ndarray:
        """Positions [m], float32 [count, dim], ordered by particle id."""
        return self.frame().positions

    @positions.setter
    def positions(self, values: Any) -> None:
        x = check_rows("positions", values, (self.count, self.scene.dim))
        x = self.scene.tank.within(x) if self.scene.tank else x
        check_crowd("positions", x, self.scene.spacing)
        if not np.array_equal(x, self.positions):
            population.clear_forces(self.world.particles, self.count)  # what pressed them was elsewhere
            put_by_id(self.world.particles, self.count, "x", x)
            self._outdated = True

    @property
    def velocities(self) -> np.ndarray:
        """Velocities [m/s], float32 [count, dim], ordered by particle id."""
        return self.frame().velocities

    @velocities.setter
    def velocities(self, values: Any) -> None:
        v = check_rows("velocities", values, (self.count, self.scene.dim))
        if not np.array_equal(v, self.velocities):
            put_by_id(self.world.particles, self.count, "v", v)
            self.ledger.fastest_start = max(self.ledger.fastest_start, largest_norm(v))

    @property
    def densities(self) -> np.ndarray:
        """Densities [kg/m^3], float32 [count], ordered by particle id; walls count as water of rest density."""
        return self.frame().densities

    @property
    def foam_positions(self) -> np.ndarray:
        """Positions [m] of spray, foam and bubbles, float32 [n, dim], in the order of their birth."""
        return self.frame().foam_positions

    @property
    def foam_kinds(self) -> np.ndarray:
        """What they are, int32 [n]: 1 spray, 2 foam, 3 bubble."""
        return self.frame().foam_kinds

    @property
    def foam_ages(self) -> np.ndarray:
        """Time since their birth [s], float32 [n]."""
        return self.frame().foam_ages

    def frame(self, measured: bool = True) -> Frame:
        """Return this instant for a viewer or an exporter; valid until the water moves on.

        Without `measured` its densities are those of some moment before, and no time is spent on them.
        """
        if measured:
            self._measure()
        world = self.world
        return Frame(
            scene=self.scene,
            number=self.frame_number,
            time=self.time,
            count=world.count,
            x=world.particles.x,
            v=world.particles.v,
            rho=world.temporaries.rho,
            id=world.particles.id,
            material=world.particles.material,
            solids=world.solids,
            diffuse=world.pool.now if world.pool else None,
            foam_count=world.pool.count if world.pool else 0,
            frozen=world.particles.frozen,
            frozen_count=world.frozen,
            dye=world.particles.dye,
            stand=self.standing,
        )

    def standing(self) -> tuple[Standing, ...]:
        """Return the solids but for the walls of the tank, where they stand."""
        solids, bodies = self.solids, {body.number: body for body in self.bodies.values()}
        found = []
        for number in range(solids.tank_count, len(solids.members)):
            (position, rotation), body = solids.poses[number], bodies.get(number)
            velocity, spin = np.split(np.zeros(6) if body is None else self.bodies.coupling.velocity[body.row], 2)
            if body is not None:
                velocity = velocity + np.cross(spin, position - body.center)
            pose = (position.copy(), rotation.copy(), velocity.copy(), spin.copy())
            found.append(Standing(solids.names[number], solids.members[number], *pose))
        return tuple(found)

    def stats(self) -> dict[str, float]:
        """Measure this instant; see `physics.measure.statistics` and `Bodies.figures` for the keys.

        Foam is in numbers of particles.
        """
        frame = self.frame()
        numbers = neighbor_numbers(self.world, self.scene)
        figures = measure.statistics(
            frame.positions, frame.velocities, frame.densities, numbers, self.scene, frame.rest_densities
        )
        return {
            "time": self.time,
            "frame": self.frame_number,
            **figures,
            **{KINDS[kind]: int(np.sum(frame.foam_kinds == kind)) for kind in (1, 2, 3)},
            "foaming": int(frame.foaming.sum()),
            **(self.sources.figures() if self.sources else {}),
            **self.bodies.figures(),
            "substeps": self.time_steps,
            "milliseconds_per_frame": 1e3 * self.seconds_per_frame,
        }

    def _measure(self) -> None:
        """Renew neighbours and densities for the positions as they are."""
        if self._outdated and self.count:
            update_densities(self.world, self.scene)
        self._outdated = False
