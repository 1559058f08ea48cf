"""USD for Blender, Houdini, Omniverse, Maya: one animated stage, of which each frame is a clip in a file of its own.

    NAME.usda                 the stage: units, time codes, the list of clips
    NAME-usd/static.usdc      what does not change: prims, solids' shapes, tank, camera, light, materials
    NAME-usd/manifest.usda    which attributes clips hold
    NAME-usd/frame.NNNNNN.usdc

The stage is rewritten after each frame in one move, so that it can be opened at any time, and memory stays flat.
"Value Clips", openusd.org. Time codes count frames; `wavetank:time` of `/World` is the time of the water [s].
"""

from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.plan import Plan
from wavetank.formats.usd_static import build_static, names_of, up_axis
from wavetank.foundation.atomic_write import atomic_write, make_folder
from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import Scene
from wavetank.simulation.instant import in_space
from wavetank.simulation.state import State

SUFFIXES = (".usda", ".usd")
KIND = "series"
KINDS = {"spray": 1, "foam": 2, "bubbles": 3}  # of foam, by the names of their prims


def check(scene: Scene) -> None:
    """Raise `WavetankError` where the package that writes USD is missing."""
    try:
        import pxr  # noqa: F401
    except ImportError:
        raise WavetankError("USD files need usd-core; install it: pip install 'wavetank[usd]'.") from None


def _load() -> None:
    """Load all of USD that is needed, in the thread of the simulation.

    A library that is loaded in another thread while a kernel starts here waits for Python, and the kernel for the
    loader: neither goes on.
    """
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdLux, UsdShade, Vt

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Points.Define(stage, "/a").CreatePointsAttr(Vt.Vec3fArray(1, Gf.Vec3f(0.0)))
    UsdLux.DomeLight.Define(stage, "/b")
    UsdShade.Material.Define(stage, "/c")
    Sdf.Layer.CreateAnonymous(".usdc").TransferContent(stage.GetRootLayer())


class UsdSeries:
    """Writes a clip for each frame, then the stage that knows of it."""

    repeatable = True

    def __init__(self, plan: Plan) -> None:
        _load()
        self.plan, self.path = plan, plan.path(SUFFIXES[0])
        self.files = [str(self.path)]
        self.folder = make_folder(self.path.with_name(f"{plan.base.name}-usd"))
        self._solids: dict[str, str] = {}  # prims by the names of solids
        self._have_static = False

    def write(self, number: int, instant: State) -> None:
        """Write a frame."""
        if not self._have_static or any(one.name not in self._solids for one in instant.placed):
            self._solids = names_of([*self._solids, *(one.name for one in instant.placed)])
            build_static(self.plan, instant, self._solids, self.folder)
            self._have_static = True
        clip = _Clip(number)
        clip.set("/World", "wavetank:time", "double", instant.time)
        if "particles" in self.plan.parts:
            _put_particles(clip, instant)
        if "foam" in self.plan.parts:
            _put_foam(clip, instant)
        if "solids" in self.plan.parts:
            self._put_solids(clip, instant)
        if "surface" in self.plan.parts:
            _put_surfaces(clip, instant)
        clip.save(self.folder / f"frame.{number:06d}.usdc")
        self._write_stage(number)

    def close(self) -> None:
        """Do nothing: every frame is complete."""

    def _put_solids(self, clip: "_Clip", instant: State) -> None:
        present = {one.name: one for one in instant.placed}
        for name, prim in self._solids.items():
            one, path = present.get(name), f"/World/solids/{prim}"
            clip.set(path, "visibility", "token", "inherited" if one else "invisible")
            if one is not None:
                clip.set(path, "xformOp:translate", "double3", one.position.tolist())
                clip.set(path, "xformOp:orient", "quatd", one.rotation)
                clip.set(path, "wavetank:velocity", "vector3d", one.velocity.tolist())
                clip.set(path, "wavetank:angularVelocity", "vector3d", one.angular_velocity.tolist())

    def _write_stage(self, last: int) -> None:
        with atomic_write(self.path) as partial:
            partial.write_text(
                _STAGE
                % {
                    "last": last,
                    "fps": f"{self.plan.fps:g}",
                    "up": up_axis(self.plan.scene),
                    "folder": self.folder.name,
                    "title": self.plan.scene.title.replace("\\", "").replace('"', "'").replace("\n", " "),
                },
                encoding="utf-8",
            )


_STAGE = """#usda 1.0
(
    defaultPrim = "World"
    doc = "wavetank: %(title)s"
    endTimeCode = %(last)d
    framesPerSecond = %(fps)s
    metersPerUnit = 1
    startTimeCode = 0
    subLayers = [
        @./%(folder)s/static.usdc@
    ]
    timeCodesPerSecond = %(fps)s
    upAxis = "%(up)s"
)

over "World" (
    clips = {
        dictionary default = {
            asset manifestAssetPath = @./%(folder)s/manifest.usda@
            string primPath = "/World"
            string templateAssetPath = "./%(folder)s/frame.######.usdc"
            double templateEndTime = %(last)d
            double templateStartTime = 0
            double templateStride = 1
        }
    }
)
{
}
"""


class _Clip:
    """A layer with values at one time code."""

    def __init__(self, number: int) -> None:
        from pxr import Sdf

        self.sdf, self.number = Sdf, number
        self.layer = Sdf.Layer.CreateAnonymous(".usdc")

    def set(self, path: str, name: str, kind: str, value: Any) -> None:
        """Give an attribute a value; `kind` is the name of its type."""
        sdf = self.sdf
        prim = self.layer.GetPrimAtPath(path) or sdf.CreatePrimInLayer(self.layer, path)
        spec = sdf.AttributeSpec(prim, name, sdf.ValueTypeNames.Find(kind))
        self.layer.SetTimeSample(spec.path, float(self.number), _value(kind, value))

    def save(self, path: Path) -> None:
        """Write the layer; a file of that name is replaced in one move."""
        with atomic_write(path, suffixed=True) as partial:
            try:
                self.layer.Export(str(partial))
            except Exception as error:
                raise WavetankError(f"{str(path)!r} cannot be written: {str(error).splitlines()[-1]}.") from error


def _value(kind: str, value: Any) -> Any:
    from pxr import Gf, Vt

    arrays = {
        "point3f[]": Vt.Vec3fArray,
        "vector3f[]": Vt.Vec3fArray,
        "normal3f[]": Vt.Vec3fArray,
        "color3f[]": Vt.Vec3fArray,
        "float3[]": Vt.Vec3fArray,
        "float[]": Vt.FloatArray,
        "int[]": Vt.IntArray,
        "int64[]": Vt.Int64Array,
    }
    if kind in arrays:
        dtype = {"int[]": np.int32, "int64[]": np.int64}.get(kind, np.float32)
        return arrays[kind].FromNumpy(np.ascontiguousarray(value, dtype))
    if kind in ("double3", "vector3d"):
        return Gf.Vec3d(*value)
    if kind == "quatd":
        return Gf.Quatd(float(value[0]), *map(float, value[1:]))
    return value


def linear_of(colors: np.ndarray) -> np.ndarray:
    """Return sRGB colours of 0 to 255 as linear ones of 0 to 1, float32 (IEC 61966-2-1)."""
    share = np.asarray(colors, np.float32) / np.float32(255.0)
    return np.where(share <= 0.04045, share / 12.92, ((share + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _extent(points: np.ndarray, margin: float) -> np.ndarray:
    if not len(points):
        return np.zeros((2, 3), np.float32)
    return np.stack([points.min(axis=0) - margin, points.max(axis=0) + margin])


def _put_particles(clip: _Clip, instant: State) -> None:
    path, points = "/World/particles", in_space(instant.positions)
    clip.set(path, "points", "point3f[]", points)
    clip.set(path, "velocities", "vector3f[]", in_space(instant.velocities))
    clip.set(path, "ids", "int64[]", instant.ids)
    clip.set(path, "primvars:id", "int[]", instant.ids)
    clip.set(path, "primvars:material", "int[]", instant.materials)
    clip.set(path, "primvars:density", "float[]", instant.densities)
    clip.set(path, "primvars:displayColor", "color3f[]", linear_of(instant.colors))
    clip.set(path, "widths", "float[]", np.full(len(points), instant.scene.spacing, np.float32))
    clip.set(path, "extent", "float3[]", _extent(points, 0.5 * instant.scene.spacing))


def _put_foam(clip: _Clip, instant: State) -> None:
    for name, kind in KINDS.items():
        own, path = instant.foam_kinds == kind, f"/World/foam/{name}"
        points = in_space(instant.foam_positions[own])
        clip.set(path, "points", "point3f[]", points)
        clip.set(path, "velocities", "vector3f[]", in_space(instant.foam_velocities[own]))
        clip.set(path, "ids", "int64[]", instant.foam_ids[own])
        clip.set(path, "primvars:id", "int[]", instant.foam_ids[own])
        clip.set(path, "primvars:age", "float[]", instant.foam_ages[own])
        clip.set(path, "primvars:life", "float[]", instant.foam_lives[own])
        clip.set(path, "widths", "float[]", np.full(len(points), 0.25 * instant.scene.spacing, np.float32))
        clip.set(path, "extent", "float3[]", _extent(points, 0.125 * instant.scene.spacing))


def _put_surfaces(clip: _Clip, instant: State) -> None:
    names = names_of([material.name for material in instant.scene.palette()])
    present = {surface.material: surface for surface in instant.surfaces}
    none = np.zeros((0, 3), np.float32)
    for number, prim in enumerate(names.values()):
        surface, path = present.get(number), f"/World/surface/{prim}"
        points = none if surface is None else surface.vertices
        triangles = none.astype(np.int32) if surface is None else surface.triangles
        clip.set(path, "points", "point3f[]", points)
        clip.set(path, "normals", "normal3f[]", none if surface is None else surface.normals)
        clip.set(path, "velocities", "vector3f[]", none if surface is None else surface.velocities)
        clip.set(path, "faceVertexCounts", "int[]", np.full(len(triangles), 3))
        clip.set(path, "faceVertexIndices", "int[]", triangles.reshape(-1))
        clip.set(path, "extent", "float3[]", _extent(points, 0.0))


write = UsdSeries
