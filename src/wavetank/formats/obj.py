"""The surface of the water as a mesh of triangles, an OBJ file an instant: for Blender, Houdini, Unity and their like.

splashsurf reconstructs it: marching cubes over the particles' smoothed volume, cleaned up (Moore and Warren 1992), and
smoothed with weights that keep the volume (Löschner et al. 2023, "Weighted Laplacian Smoothing for Surface
Reconstruction of Particle-based Fluids", 10.2312/vmv.20231245). Water against the tank ends where the tank does.
"""

import io
from pathlib import Path

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.replacing import replacing
from wavetank.scene.scene import Scene
from wavetank.simulation.frame import Frame

SUFFIXES = (".obj",)
KIND = "surface"

#: What splashsurf's authors recommend; lengths in particle radii, half a spacing.
SMOOTHING_LENGTH, CUBE_SIZE, THRESHOLD = 2.0, 0.5, 0.6
MESH_SMOOTHING, NORMAL_SMOOTHING = 25, 10  # iterations


def check(scene: Scene) -> None:
    """Raise `WavetankError` where `scene` has no surface in space, or what reconstructs it is missing."""
    if scene.dim != 3:
        raise WavetankError("a 2-D world has no surface to write as OBJ; export npz, csv or ply, or take a 3-D scene.")
    try:
        import pysplashsurf  # noqa: F401
    except ImportError:
        raise WavetankError("surfaces are made by pysplashsurf; install it: pip install 'wavetank[surface]'.") from None


def surface(positions: np.ndarray, scene: Scene) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices [m], normals (float32 [vertices, 3]) and triangles (int [triangles, 3], outside on the left)."""
    import pysplashsurf

    mesh, _ = pysplashsurf.reconstruction_pipeline(
        np.ascontiguousarray(positions, np.float32), particle_radius=0.5 * scene.spacing,
        smoothing_length=SMOOTHING_LENGTH, cube_size=CUBE_SIZE, iso_surface_threshold=THRESHOLD, mesh_cleanup=True,
        mesh_smoothing_iters=MESH_SMOOTHING, compute_normals=True, normals_smoothing_iters=NORMAL_SMOOTHING,
    )  # fmt: skip
    vertices, normals = mesh.mesh.vertices, mesh.point_attributes["normals"]
    if scene.tank is not None:
        lower, upper = scene.tank.box()
        inside = np.clip(vertices, lower.astype(np.float32), upper.astype(np.float32))
        outward = vertices - inside
        beyond = np.linalg.norm(outward, axis=1) > 0.0
        normals[beyond] = outward[beyond] / np.linalg.norm(outward[beyond], axis=1, keepdims=True)
        vertices = inside
    return vertices, normals, mesh.mesh.triangles


def write_obj(path: str | Path, frame: Frame) -> None:
    """Write the surface of each fluid as an object of its material's name, with normals, in m.

    Raises `WavetankError` for a 2-D world and where the extra `surface` is not installed.
    """
    check(frame.scene)
    text, first = io.StringIO(), 1
    text.write(f"# wavetank, SI units, t = {frame.time:.6g} s\n")
    for number, material in enumerate(frame.scene.palette()):
        positions = frame.positions[frame.materials == number]
        if len(positions):
            vertices, normals, triangles = surface(positions, frame.scene)
            text.write(f"o {'_'.join(material.name.split())}\n")
            np.savetxt(text, vertices, "v %.6g %.6g %.6g")
            np.savetxt(text, normals, "vn %.3f %.3f %.3f")
            np.savetxt(text, np.repeat(triangles.astype(np.int64) + first, 2, axis=1), "f %d//%d %d//%d %d//%d")
            first += len(vertices)
    with replacing(path) as partial:
        partial.write_text(text.getvalue(), encoding="ascii", errors="replace")


write = write_obj
