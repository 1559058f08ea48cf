"""Water around solids that cut the cells of the grid comes to rest: films, wedges, gaps, slopes, roofs, a mesh.

Reference: hydrostatics; nothing acts on water at rest. Each world is small, and its solids lie anywhere to the cells of
the pressure and to the rows of the water: by a share of a cell that is drawn for each start. What counts is the fastest
particle of two seconds, by its velocity and by its way from frame to frame, whichever is more. What is slower than
0.2 sqrt(g d) past a solid is slow (`coefficients.SLOW_AT_SOLIDS`); a particle that is thrown is faster.
"""

import dataclasses
import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import AnySolid, Box, Capsule, Cylinder, HalfSpace, Sphere

SIZE = {2: (1.0, 0.6), 3: (0.6, 0.45, 0.42)}  # m, of the tank
SPACING = {2: 0.02, 3: 0.03}  # m
DEPTH = {2: 0.4, 3: 0.3}  # m, before solids take their room
SECONDS, WATCHED = 10.0, 2.0
SLOW = 0.2  # of sqrt(g d)


def worlds(dim: int, start: int) -> dict[str, list[AnySolid]]:
    """Return the solids of all worlds of a dimension; each `start` moves and turns them by shares of a cell."""
    chance = np.random.default_rng([dim, start])
    d = SPACING[dim]

    def at(*place: float) -> tuple[float, ...]:
        return tuple(float(p + 2.0 * d * chance.uniform(-0.5, 0.5)) for p in place)

    def turned(angle: float) -> tuple[float, ...]:
        angle += chance.uniform(-0.05, 0.05)
        return (math.cos(angle / 2.0), 0.0, 0.0, math.sin(angle / 2.0))

    surface = DEPTH[dim]
    result: dict[str, list[AnySolid]] = {}
    if dim == 2:
        for layers in (1, 2, 3):
            x, top = at(0.5)[0], surface + 1.2 * d - layers * d
            result[f"film of {layers}"] = [Box(center=(x, top / 2.0), size=(0.2, top))]
        result["shelf"] = [Box(center=(0.15, 0.0), size=at(0.5, 0.3))]
        result["slope"] = [HalfSpace(point=at(0.5, 0.1), normal=(-math.sin(0.5), math.cos(0.5)))]
        result["beach"] = [HalfSpace(point=at(0.5, 0.3), normal=(-math.sin(0.2), math.cos(0.2)))]
        result["wedge"] = [Box(center=at(0.5, 0.12), size=(0.3, 0.15), rotation=turned(0.3))]
        result["disc"] = [Sphere(center=at(0.5, 0.2), radius=0.1)]
        result["disc on the floor"] = [Sphere(center=(at(0.5)[0], 0.1), radius=0.1)]
        result["gap"] = [Box(center=(at(0.5)[0], 0.08 + d * chance.uniform(0.8, 2.4)), size=(0.3, 0.16))]
        result["two boxes"] = [
            Box(center=(0.4, 0.1), size=(0.2, 0.2)),
            Box(center=(0.5 + 0.1 + d * chance.uniform(0.8, 2.4), 0.15), size=(0.2, 0.3)),
        ]
        # What breaks the surface, and is a roof over some of it.
        result["disc in the surface"] = [Sphere(center=at(0.5, surface + 0.06), radius=0.12)]
        result["box on a corner"] = [Box(center=at(0.5, surface), size=(0.2, 0.2), rotation=turned(math.pi / 4.0))]
        result["leaning slab"] = [Box(center=at(0.5, surface), size=(0.4, 0.07), rotation=turned(0.9))]
        result["lintel"] = [Box(center=at(0.5, surface + 0.1), size=(0.4, 0.2))]
        return result
    for layers in (1, 2):
        (x, z), top = at(0.3, 0.21), surface + 1.2 * d - layers * d
        result[f"film of {layers}"] = [Box(center=(x, top / 2.0, z), size=(0.2, top, 0.15))]
    result["slope"] = [HalfSpace(point=at(0.3, 0.1, 0.2), normal=(-math.sin(0.5), math.cos(0.5), 0.1))]
    result["beach"] = [HalfSpace(point=at(0.3, 0.22, 0.2), normal=(-math.sin(0.2), math.cos(0.2), 0.1))]
    result["wedge"] = [Box(center=at(0.3, 0.12, 0.21), size=(0.2, 0.1, 0.2), rotation=turned(0.3))]
    result["ball"] = [Sphere(center=at(0.3, 0.15, 0.21), radius=0.09)]
    x, z = at(0.3, 0.21)
    result["ball on the floor"] = [Sphere(center=(x, 0.1, z), radius=0.1)]
    result["gap"] = [Box(center=(x, 0.08 + d * chance.uniform(0.8, 2.4), z), size=(0.2, 0.16, 0.15))]
    result["pole"] = [Cylinder(start=(x, -0.05, z), end=(x, 0.5, z), radius=0.06)]
    result["capsule"] = [Capsule(start=at(0.2, 0.12, 0.2), end=at(0.4, 0.2, 0.24), radius=0.05)]
    result["knot"] = [Mesh(path="wavetank/knot.obj", center=at(0.3, 0.18, 0.21), size=0.3, rotation=turned(0.2))]
    result["ball in the surface"] = [Sphere(center=at(0.3, surface + 0.05, 0.21), radius=0.1)]
    x, y, z = at(0.3, surface, 0.21)
    result["leaning capsule"] = [Capsule(start=(x - 0.1, y - 0.08, z), end=(x + 0.1, y + 0.1, z), radius=0.06)]
    return result


@dataclasses.dataclass
class Watched:
    """The fastest particle [m/s] of each frame, by its velocity and by its way."""

    velocity: list[float]
    way: list[float]

    @property
    def worst(self) -> float:
        """The fastest of all."""
        return max(*self.velocity, *self.way)


def watch(solids: list[AnySolid], dim: int, arch: str, **options: Any) -> Watched:
    """Let water around the `solids` settle, and watch its last seconds."""
    box = Block(lower=(0.0,) * dim, upper=tuple(DEPTH[dim] if k == 1 else edge for k, edge in enumerate(SIZE[dim])))
    tank = Tank(size=SIZE[dim])
    scene = Scene(spacing=SPACING[dim], tank=tank, fluids=[box], solids=solids, foam=0.0, **options)
    sim = Simulation(scene, arch)
    sim.advance(SECONDS - WATCHED)
    seen, before = Watched([], []), _places(sim)
    while sim.time < SECONDS - 1e-6:
        sim.step()
        now = _places(sim)
        seen.way.append(float(np.linalg.norm(now - before, axis=1).max() / scene.frame_time))
        seen.velocity.append(float(np.linalg.norm(sim.velocities.astype(float), axis=1).max()))
        before = now
    return seen


def _places(sim: Simulation) -> np.ndarray:
    return sim.positions.astype(float)


def run(quick: bool, arch: str) -> Outcome:
    """Let all worlds settle for 10 s, from three starts each (quick: those in a plane, from one)."""
    seen: dict[str, list[Watched]] = {}
    for dim in (2,) if quick else (2, 3):
        for start in range(1 if quick else 3):
            for name, solids in worlds(dim, start).items():
                seen.setdefault(f"{dim}-D, {name}", []).append(watch(solids, dim, arch))
    worst = {name: max(w.worst for w in starts) for name, starts in seen.items()}
    median = {name: max(float(np.median(w.velocity)) for w in starts) for name, starts in seen.items()}
    bounds = {f"{dim}-D": SLOW * math.sqrt(9.81 * d) for dim, d in SPACING.items()}
    figures = [
        Figure(f"{name}: fastest", value, "m/s", None, bounds[name[:3]], "0", "rest") for name, value in worst.items()
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        names = list(worst)
        axis.semilogx([worst[name] for name in names], names, "o", color=RED, ms=4, label="fastest of 2 s")
        axis.semilogx([median[name] for name in names], names, "o", color=BLUE, ms=4, label="of a usual frame")
        axis.set(xlabel="fastest particle [m/s]")
        axis.legend(frameon=False)
        tidy(axis)

    return Outcome(figures, {"worst": list(worst.values()), "median": list(median.values())}, draw)


CASE = Case("solids-at-rest", "Water around solids comes to rest", run)
