"""What of a USD stage does not change from frame to frame, and the list of what does; see `usd.py`."""

import itertools
import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.plan import Plan, Viewpoint
from wavetank.foundation.atomic_write import atomic_write
from wavetank.scene.scene import Scene
from wavetank.simulation.state import State

SOLID = (0.694, 0.361, 0.224)  # linear colour of solids
APERTURE = 24.0  # mm: height of a film
#: attributes that clips hold: kind of prim -> name, type, interpolation
POINTS = (
    ("points", "point3f[]", ""),
    ("velocities", "vector3f[]", ""),
    ("ids", "int64[]", ""),
    ("widths", "float[]", "vertex"),
    ("extent", "float3[]", ""),
    ("primvars:id", "int[]", "vertex"),
)
PARTICLES = (
    *POINTS,
    ("primvars:material", "int[]", "vertex"),
    ("primvars:density", "float[]", "vertex"),
    ("primvars:displayColor", "color3f[]", "vertex"),
)
FOAM = (*POINTS, ("primvars:age", "float[]", "vertex"), ("primvars:life", "float[]", "vertex"))
SURFACE = (
    ("points", "point3f[]", ""),
    ("normals", "normal3f[]", "vertex"),
    ("velocities", "vector3f[]", ""),
    ("faceVertexCounts", "int[]", ""),
    ("faceVertexIndices", "int[]", ""),
    ("extent", "float3[]", ""),
)
SOLIDS = (
    ("visibility", "token", ""),
    ("xformOp:translate", "double3", ""),
    ("xformOp:orient", "quatd", ""),
    ("wavetank:velocity", "vector3d", ""),
    ("wavetank:angularVelocity", "vector3d", ""),
)


def names_of(names: Sequence[str]) -> dict[str, str]:
    """Return a prim's name for each of these, no two the same: letters, digits and underscores."""
    found: dict[str, str] = {}
    for name in names:
        if name in found:
            continue
        plain = re.sub(r"\W", "_", name, flags=re.ASCII) or "_"
        plain = f"_{plain}" if plain[0].isdigit() else plain
        numbered = (f"{plain}_{number}" for number in itertools.count(2))
        found[name] = plain if plain not in found.values() else next(n for n in numbered if n not in found.values())
    return found


def up_axis(scene: Scene) -> str:
    """Return the axis that points up as USD names it, which knows Y and Z only."""
    return "Z" if scene.upward == "z" else "Y"


def build_static(plan: Plan, instant: State, solids: dict[str, str], folder: Path) -> None:
    """Write `static.usdc` and `manifest.usda` into `folder`; `solids` are prims by the names of solids."""
    from pxr import Usd, UsdGeom

    static, manifest = (Usd.Stage.CreateInMemory() for _ in range(2))
    for stage in (static, manifest):
        UsdGeom.SetStageUpAxis(stage, up_axis(plan.scene))
        UsdGeom.SetStageMetersPerUnit(stage, 1.0)
        stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/World").GetPrim())
        _define_prims(stage, _prims(plan, solids))
    _materials(static, plan)
    if "solids" in plan.parts:
        _solids(static, plan, instant, solids)
    _surroundings(static, plan)
    for stage, name in ((manifest, "manifest.usda"), (static, "static.usdc")):
        with atomic_write(folder / name, suffixed=True) as partial:
            stage.GetRootLayer().Export(str(partial))


def _prims(plan: Plan, solids: dict[str, str]) -> list[tuple[str, str, Any]]:
    """Return (path, type, attributes) of all prims that hold what a plan writes, in the order of the file."""
    prims: list[tuple[str, str, Any]] = []
    if "particles" in plan.parts:
        prims.append(("/World/particles", "Points", PARTICLES))
    if "foam" in plan.parts:
        prims += [(f"/World/foam/{name}", "Points", FOAM) for name in ("spray", "foam", "bubbles")]
    if "surface" in plan.parts:
        names = names_of([material.name for material in plan.scene.palette()])
        prims += [(f"/World/surface/{name}", "Mesh", SURFACE) for name in names.values()]
    if "solids" in plan.parts:
        prims += [(f"/World/solids/{name}", "Mesh", SOLIDS) for name in solids.values()]
    return [*prims, ("/World", "Xform", (("wavetank:time", "double", ""),))]


def _define_prims(stage: Any, prims: list[tuple[str, str, Any]]) -> None:
    """Define prims with their attributes, and before them the groups that hold them."""
    from pxr import Sdf, UsdGeom

    for group in sorted({path.rpartition("/")[0] for path, _, _ in prims if path.count("/") == 3}):
        UsdGeom.Xform.Define(stage, group)
    for path, kind, attributes in prims:
        prim = stage.DefinePrim(path, kind)
        for name, type_, interpolation in attributes:
            attribute = prim.CreateAttribute(name, Sdf.ValueTypeNames.Find(type_), name.startswith("wavetank:"))
            if interpolation:
                attribute.SetMetadata("interpolation", interpolation)


def _materials(stage: Any, plan: Plan) -> None:
    """Give fluids a surface of their own colour, water as clear as water, and foam a white one."""
    from pxr import Gf, Sdf, UsdGeom, UsdShade

    def material(name: str, values: dict[str, tuple[str, Any]]) -> Any:
        made = UsdShade.Material.Define(stage, f"/World/Looks/{name}")
        shader = UsdShade.Shader.Define(stage, f"/World/Looks/{name}/Surface")
        shader.CreateIdAttr("UsdPreviewSurface")
        for key, (kind, value) in values.items():
            shader.CreateInput(key, Sdf.ValueTypeNames.Find(kind)).Set(value)
        made.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        return made

    def bind(path: str, made: Any) -> None:
        prim = stage.GetPrimAtPath(path)
        if prim:
            UsdShade.MaterialBindingAPI.Apply(prim).Bind(made)

    UsdGeom.Scope.Define(stage, "/World/Looks")
    palette = plan.scene.palette()
    for fluid, name in zip(palette, names_of([fluid.name for fluid in palette]).values(), strict=True):
        color = Gf.Vec3f(*_linear(str(fluid.color)))
        look = {
            "diffuseColor": ("color3f", color),
            "roughness": ("float", 0.05),
            "ior": ("float", 1.333),
            "opacity": ("float", 0.35),
            "metallic": ("float", 0.0),
        }
        bind(f"/World/surface/{name}", material(name, look))
        if stage.GetPrimAtPath(f"/World/surface/{name}"):
            UsdGeom.Mesh.Get(stage, f"/World/surface/{name}").CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
    white = material("white_foam", {"diffuseColor": ("color3f", Gf.Vec3f(0.9)), "roughness": ("float", 0.9)})
    for name in ("spray", "foam", "bubbles"):
        bind(f"/World/foam/{name}", white)
    solid = material("solid", {"diffuseColor": ("color3f", Gf.Vec3f(*SOLID)), "roughness": ("float", 0.6)})
    bind("/World/solids", solid)


def _linear(color: str) -> list[float]:
    shares = [int(color[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    return [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]


def _solids(stage: Any, plan: Plan, instant: State, solids: dict[str, str]) -> None:
    """Shapes of solids in their own frames, which clips move; one without a surface is an empty mesh."""
    from pxr import Gf, UsdGeom, Vt

    for one in instant.placed:
        points, faces = plan.shapes.own(one)
        mesh = UsdGeom.Mesh.Get(stage, f"/World/solids/{solids[one.name]}")
        mesh.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(points, np.float32).reshape(-1, 3)))
        mesh.GetFaceVertexCountsAttr().Set(Vt.IntArray.FromNumpy(np.full(len(faces), 3, np.int32)))
        mesh.GetFaceVertexIndicesAttr().Set(Vt.IntArray.FromNumpy(np.ascontiguousarray(faces, np.int32).reshape(-1)))
        mesh.CreateSubdivisionSchemeAttr(UsdGeom.Tokens.none)
        mesh.CreateDisplayColorAttr([Gf.Vec3f(*SOLID)])
        if len(points):
            mesh.CreateExtentAttr([Gf.Vec3f(*map(float, side)) for side in (points.min(axis=0), points.max(axis=0))])
        mesh.SetXformOpOrder([mesh.AddTranslateOp(), mesh.AddOrientOp(UsdGeom.XformOp.PrecisionDouble)])
        mesh.GetPrim().SetDisplayName(one.name)


def _surroundings(stage: Any, plan: Plan) -> None:
    """Tank, camera and light."""
    from pxr import Gf, UsdGeom, UsdLux, Vt

    if plan.scene.tank is not None:
        lower, upper = (np.array([*corner, 0.0][:3]) for corner in plan.scene.tank.box())
        corners = np.array([*itertools.product(*zip(lower, upper, strict=True))])
        edges = [(a, b) for a, b in itertools.combinations(range(8), 2) if (a ^ b).bit_count() == 1]
        ends = corners[np.array(edges)].reshape(-1, 3).astype(np.float32)
        tank = UsdGeom.BasisCurves.Define(stage, "/World/tank")
        tank.CreateTypeAttr(UsdGeom.Tokens.linear)
        tank.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(ends))
        tank.CreateCurveVertexCountsAttr([2] * len(edges))
        tank.CreateWidthsAttr([0.1 * plan.scene.spacing])
        tank.SetWidthsInterpolation(UsdGeom.Tokens.constant)
        tank.CreateExtentAttr([Gf.Vec3f(*map(float, side)) for side in (lower, upper)])
        tank.CreateDisplayColorAttr([Gf.Vec3f(0.1, 0.13, 0.17)])
    if plan.view is not None:
        _camera(UsdGeom.Camera.Define(stage, "/World/camera"), plan.view)
    sun = UsdLux.DistantLight.Define(stage, "/World/sun")
    sun.CreateIntensityAttr(3.0)
    sun.CreateAngleAttr(1.0)
    sun.AddRotateXYZOp().Set(Gf.Vec3f(-52.0, -40.0, 0.0))
    UsdLux.DomeLight.Define(stage, "/World/sky").CreateIntensityAttr(0.7)


def _camera(camera: Any, view: Viewpoint) -> None:
    from pxr import Gf, UsdGeom

    matrix = Gf.Matrix4d(1.0).SetLookAt(Gf.Vec3d(*view.eye), Gf.Vec3d(*view.target), Gf.Vec3d(*view.up)).GetInverse()
    camera.AddTransformOp().Set(matrix)
    distance = float(np.linalg.norm(np.subtract(view.eye, view.target)))
    camera.CreateClippingRangeAttr(Gf.Vec2f(0.01 * distance, 100.0 * distance))
    camera.CreateFocusDistanceAttr(distance)
    camera.CreateVerticalApertureAttr(APERTURE)
    camera.CreateHorizontalApertureAttr(APERTURE * 16.0 / 9.0)
    if view.height is None:
        camera.CreateFocalLengthAttr(0.5 * APERTURE / math.tan(0.5 * view.field_of_view))
        return
    camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)  # apertures are tenths of a unit of the stage then
    camera.CreateVerticalApertureAttr(10.0 * view.height)
    camera.CreateHorizontalApertureAttr(10.0 * view.height * 16.0 / 9.0)
