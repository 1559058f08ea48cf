"""The parts of an instant as VTK has them: points with data, and cells between them."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from wavetank.formats.plan import Plan
from wavetank.simulation.instant import in_space
from wavetank.simulation.state import State


@dataclasses.dataclass(frozen=True)
class Piece:
    """Points, all of them vertices or corners of triangles."""

    points: np.ndarray  # m, float32 [n, 3]
    data: dict[str, np.ndarray]  # of the points, [n] or [n, width]
    kind: str  # Vertices or Polygons
    cells: np.ndarray  # int [m, 1] or [m, 3]: numbers of points


def pieces_of(plan: Plan, instant: State) -> Iterator[tuple[str, Piece]]:
    """Yield the parts that are asked for: particles, foam, solids, surface; the same ones in every frame."""
    if "particles" in plan.parts:
        yield (
            "particles",
            _vertices(
                instant.positions,
                {
                    "velocity": in_space(instant.velocities),
                    "density": instant.densities,
                    "id": instant.ids,
                    "material": instant.materials,
                    "color": instant.colors,
                },
            ),
        )
    if "foam" in plan.parts and plan.scene.foam > 0.0:
        yield (
            "foam",
            _vertices(
                instant.foam_positions,
                {
                    "velocity": in_space(instant.foam_velocities),
                    "kind": instant.foam_kinds,
                    "age": instant.foam_ages,
                    "life": instant.foam_lives,
                    "id": instant.foam_ids,
                },
            ),
        )
    if "solids" in plan.parts and plan.scene.solids:
        yield "solids", _solids(plan, instant)
    if "surface" in plan.parts:
        parts = [
            (
                surface.vertices,
                surface.triangles,
                {
                    "velocity": surface.velocities,
                    "Normals": surface.normals,
                    "material": np.full(len(surface.vertices), surface.material, np.int32),
                },
            )
            for surface in instant.surfaces
        ]
        usual = {"velocity": ("f4", (3,)), "Normals": ("f4", (3,)), "material": ("i4", ())}
        yield "surface", _polygons(parts, usual)


def _vertices(positions: np.ndarray, data: dict[str, np.ndarray]) -> Piece:
    return Piece(in_space(positions), data, "Vertices", np.arange(len(positions))[:, None])


def _solids(plan: Plan, instant: State) -> Piece:
    """All solids as triangles; `solid` counts those of the instant, `velocity` is that of the point."""
    numbers = {one.name: number for number, one in enumerate(instant.placed)}
    parts = []
    for one, points, faces in plan.shapes.placed(instant):
        velocity = one.velocity + np.cross(one.angular_velocity, points - one.position)
        parts.append(
            (
                points,
                faces,
                {"solid": np.full(len(points), numbers[one.name], np.int32), "velocity": velocity.astype(np.float32)},
            )
        )
    return _polygons(parts, {"solid": ("i4", ()), "velocity": ("f4", (3,))})


def _polygons(
    parts: list[tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]], usual: dict[str, tuple[str, tuple[int, ...]]]
) -> Piece:
    firsts = np.cumsum([0, *(len(points) for points, _, _ in parts)])
    points = np.concatenate([np.zeros((0, 3), np.float32), *(points.astype(np.float32) for points, _, _ in parts)])
    faces = [faces + first for (_, faces, _), first in zip(parts, firsts, strict=False)]
    data = {
        name: np.concatenate([np.zeros((0, *width), kind), *(rows[name] for _, _, rows in parts)])
        for name, (kind, width) in usual.items()
    }
    return Piece(points, data, "Polygons", np.concatenate([np.zeros((0, 3), np.int64), *faces]))
