"""The surface of each fluid as triangles, made by splashsurf.

Marching cubes over the particles' smoothed volume, cleaned up (Moore and Warren 1992), and smoothed with weights that
keep the volume (Löschner et al. 2023, "Weighted Laplacian Smoothing for Surface Reconstruction of Particle-based
Fluids", 10.2312/vmv.20231245). Water against the tank ends where the tank does, and what remains is
moved along its normals until it encloses the volume of the particles, d^3 each. The same particles make the same bytes.
"""

import dataclasses
import functools
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.state import State
from wavetank.solids.meshes.triangles import volume_within

#: What splashsurf's authors recommend but for the cubes, theirs are 0.5 wide: smoothed, nobody sees a difference, at
#: less than half of the triangles, bytes and seconds. Lengths in particle radii, half a spacing.
SMOOTHING_LENGTH, CUBE_SIZE, THRESHOLD = 2.0, 0.75, 0.6
MESH_SMOOTHING, NORMAL_SMOOTHING = 25, 3  # iterations; ten turned normals of drops inside out
#: What ends so near to a wall of the tank [spacings] and faces it, not at all to fully [cosine], ends at the wall.
NEAR, FACING = 0.35, (0.3, 0.8)
FARTHEST = 0.3  # spacings that a vertex is moved for the sake of the volume


@dataclasses.dataclass(frozen=True)
class WaterSurface:
    """The surface of one fluid."""

    name: str  # of its material
    material: int  # its number, see `Scene.palette`
    color: str  # '#rrggbb'
    vertices: np.ndarray  # m, float32 [n, 3]
    normals: np.ndarray  # unit vectors to the outside, float32 [n, 3]
    velocities: np.ndarray  # m/s, float32 [n, 3]
    triangles: np.ndarray  # int32 [m, 3], counter-clockwise from outside

    @property
    def volume(self) -> float:
        """Volume that it encloses [m^3]."""
        return volume_within(self.vertices, self.triangles)


def check_surface(scene: Scene) -> None:
    """Raise `WavetankError` where `scene` has no surface in space, or what reconstructs it is missing."""
    if scene.dim != 3:
        raise WavetankError("a 2-D world has no surface to write; export its particles, or take a 3-D scene.")
    try:
        import pysplashsurf  # noqa: F401
    except ImportError:
        raise WavetankError("surfaces are made by pysplashsurf; install it: pip install 'wavetank[surface]'.") from None


def surfaces_of(instant: Any) -> tuple[WaterSurface, ...]:
    """Return the surfaces of the fluids of an `Instant` or a `Frame`, in the order of their materials.

    Raises `WavetankError` for a 2-D world and where the extra `surface` is not installed.
    """
    check_surface(instant.scene)
    known: tuple[WaterSurface, ...] = getattr(instant, "surfaces", ())
    return known or tuple(
        _surface(instant, number, material)
        for number, material in enumerate(instant.scene.palette())
        if (instant.materials == number).any()
    )


def with_surfaces(instant: State) -> State:
    """Return the instant with the surfaces of its fluids."""
    return dataclasses.replace(instant, surfaces=surfaces_of(instant))


def _surface(instant: Any, number: int, material: Any) -> WaterSurface:
    own = instant.materials == number
    mesh = reconstruct(instant.positions[own], instant.velocities[own], instant.scene)
    return WaterSurface(material.name, number, str(material.color), *mesh)


def reconstruct(
    positions: np.ndarray, velocities: np.ndarray, scene: Scene
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices [m], normals, velocities [m/s], float32 [vertices, 3], and triangles, int32 [triangles, 3]."""
    mesh, _ = _pipeline()(
        np.ascontiguousarray(positions, np.float32),
        particle_radius=0.5 * scene.spacing,
        attributes_to_interpolate={"velocity": np.ascontiguousarray(velocities, np.float32)},
        smoothing_length=SMOOTHING_LENGTH,
        cube_size=CUBE_SIZE,
        iso_surface_threshold=THRESHOLD,
        mesh_cleanup=True,
        mesh_smoothing_iters=MESH_SMOOTHING,
        compute_normals=True,
        normals_smoothing_iters=NORMAL_SMOOTHING,
    )
    triangles = mesh.mesh.triangles.astype(np.int32)
    vertices = mesh.mesh.vertices.astype(np.float64)
    normals = np.nan_to_num(mesh.point_attributes["normals"].astype(np.float64))  # NaN for tiny components
    normals[~normals.any(axis=1)] = (0.0, 1.0, 0.0)
    _fit_volume(vertices, normals, triangles, len(positions) * scene.spacing**3, scene)
    velocity = mesh.point_attributes["velocity"].astype(np.float32)
    return vertices.astype(np.float32), normals.astype(np.float32), velocity, triangles


@functools.cache
def _pipeline() -> Callable[..., Any]:
    """Return the function that reconstructs, on one thread: on several it sums in an order of its own each time."""
    before = os.environ.get("RAYON_NUM_THREADS")
    os.environ["RAYON_NUM_THREADS"] = "1"
    try:
        import pysplashsurf

        some = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]], np.float32)  # its threads begin with the first work
        pysplashsurf.reconstruction_pipeline(some, particle_radius=0.5, smoothing_length=2.0, cube_size=0.5)
    finally:
        if before is None:
            del os.environ["RAYON_NUM_THREADS"]
        else:
            os.environ["RAYON_NUM_THREADS"] = before
    run: Callable[..., Any] = pysplashsurf.reconstruction_pipeline
    return run


def _fit_volume(vertices: np.ndarray, normals: np.ndarray, triangles: np.ndarray, volume: float, scene: Scene) -> None:
    """Move vertices in place: those at the walls of the tank onto these, the others until all enclose `volume` [m^3].

    These go along their normals, all by the same way, found by Newton's method: dV / ds is the area.
    """
    held = np.zeros(vertices.shape)  # share to which a coordinate is that of a wall
    if scene.tank is not None:
        near = NEAR * scene.spacing
        for side, corner in zip((-1.0, 1.0), scene.tank.box(), strict=True):
            beyond = side * (vertices - corner)
            facing = np.clip((side * normals - FACING[0]) / (FACING[1] - FACING[0]), 0.0, 1.0)
            share = np.where(beyond > 0.0, 1.0, np.where(beyond > -near, facing, 0.0))
            vertices += share * (corner - vertices)
            normals[share == 1.0] = side
            held = np.maximum(held, share)
        flat = (held == 1.0).any(axis=1)
        normals[flat] *= held[flat] == 1.0
        normals[flat] /= np.linalg.norm(normals[flat], axis=1, keepdims=True)
    loose = 1.0 - held.max(axis=1)
    way, most = 0.0, FARTHEST * scene.spacing
    for _ in range(3):
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        crosses = np.cross(b - a, c - a)
        area = 0.5 * float(np.linalg.norm(crosses, axis=1) @ loose[triangles].mean(axis=1))
        missing = volume - float(np.einsum("ij,ij->", a, crosses)) / 6.0
        step = np.clip(way + missing / area, -most, most) - way if area > 0.0 else 0.0
        way += step
        vertices += step * loose[:, None] * normals
    if scene.tank is not None:
        np.clip(vertices, *scene.tank.box(), out=vertices)
