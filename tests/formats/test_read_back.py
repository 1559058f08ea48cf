"""Frames in each format, read back by the libraries of those who open them."""

import json
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

import wavetank as wt
from instants import FPS, FRAMES, instants, world
from wavetank.formats import hdf5, npz
from wavetank.formats.plan import Plan, Shapes, Viewpoint
from wavetank.formats.surface import surfaces_of
from wavetank.foundation.rotations import turned
from wavetank.run.outputs import Outputs
from wavetank.simulation.instant import FOAM, PARTICLES, PARTS

VIEW = Viewpoint((2.0, 1.0, 2.0), (0.6, 0.3, 0.3), 0.6)
NAMES = ("usd", "vtkhdf", "vtp", "h5", "npz", "ply")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """All formats with all parts."""
    pytest.importorskip("h5py")
    pytest.importorskip("pxr")
    path = tmp_path_factory.mktemp("out")
    with Outputs(path / "w", world(), NAMES, fps=FPS, only=PARTS, view=VIEW) as outputs:
        for number, instant in enumerate(instants()):
            outputs.write(number, instant)
    return path


def placed(instant):
    """The vertices of all solids in the world."""
    shapes = Shapes(instant.scene)
    shapes.learn(instant.placed)
    return np.concatenate([points for _, points, _ in shapes.placed(instant)])


def test_npz_and_hdf5_bring_everything_back(folder):
    from_hdf5 = list(hdf5.read(folder / "w.h5"))
    assert len(from_hdf5) == FRAMES
    for number, (instant, other) in enumerate(zip(instants(), from_hdf5, strict=True)):
        for back in (other, npz.read(folder / f"w-{number:05d}.npz", world())):
            assert (back.time, back.number) == (instant.time, instant.number)
            for name in (field.name for field in (*PARTICLES, *FOAM)):
                assert (getattr(back, name) == getattr(instant, name)).all(), name
                assert getattr(back, name).dtype == getattr(instant, name).dtype
            assert [one.name for one in back.placed] == ["crate 1", "solid 1"]
            for one, same in zip(instant.placed, back.placed, strict=True):
                for name in ("position", "rotation", "velocity", "angular_velocity"):
                    assert (getattr(one, name) == getattr(same, name)).all()
        for surface, same in zip(surfaces_of(instant), other.surfaces, strict=True):
            assert surface.name == same.name
            assert (surface.vertices == same.vertices).all()
            assert (surface.triangles == same.triangles).all()
            assert (surface.velocities == same.velocities).all()


def test_hdf5_is_read_with_h5py_alone(folder):
    import h5py

    with h5py.File(folder / "w.h5") as file:
        assert file.attrs["NFrames"] == FRAMES
        for number, instant in enumerate(instants()):
            first, count = file["water/first"][number], file["water/count"][number]
            assert (file["water/positions"][first : first + count] == instant.positions).all()
            assert file["frames/time"][number] == instant.time
    assert wt.Scene.from_text(bytes(h5py.File(folder / "w.h5")["scene"][()]).decode()) == world()


def test_usd_brings_everything_back(folder):
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(folder / "w.usda"))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, FRAMES - 1, FPS)
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    cache = UsdGeom.XformCache()

    def value(path, name, number):
        return np.array(stage.GetPrimAtPath(path).GetAttribute(name).Get(number))

    for number, instant in enumerate(instants()):
        cache.SetTime(number)
        water = "/World/particles"
        np.testing.assert_allclose(value(water, "points", number), instant.positions, atol=1e-6)
        np.testing.assert_allclose(value(water, "velocities", number), instant.velocities, atol=1e-6)
        assert (value(water, "ids", number) == instant.ids).all()
        assert (value(water, "primvars:id", number) == instant.ids).all()
        colors = value(water, "primvars:displayColor", number)
        back = np.where(colors <= 0.0031308, colors * 12.92, 1.055 * np.maximum(colors, 1e-9) ** (1 / 2.4) - 0.055)
        np.testing.assert_allclose(255.0 * back, instant.colors, atol=0.01)
        assert value("/World", "wavetank:time", number) == instant.time
        for name, kind in (("spray", 1), ("foam", 2), ("bubbles", 3)):
            own = instant.foam_kinds == kind
            points = value(f"/World/foam/{name}", "points", number).reshape(-1, 3)
            np.testing.assert_allclose(points, instant.foam_positions[own], atol=1e-6)
            assert (value(f"/World/foam/{name}", "ids", number) == instant.foam_ids[own]).all()
        for one, name in zip(instant.placed, ("crate_1", "solid_1"), strict=True):
            prim = stage.GetPrimAtPath(f"/World/solids/{name}")
            matrix = np.array(cache.GetLocalToWorldTransform(prim))
            points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get(number))
            world_points = np.column_stack([points, np.ones(len(points))]) @ matrix
            expected = turned(one.rotation, points.astype(float)) + one.position
            np.testing.assert_allclose(world_points[:, :3], expected, atol=4e-6)  # quaternions in single precision
        for surface, name in zip(surfaces_of(instant), ("water", "light_oil"), strict=True):
            path = f"/World/surface/{name}"
            np.testing.assert_allclose(value(path, "points", number), surface.vertices, atol=1e-6)
            np.testing.assert_allclose(value(path, "velocities", number), surface.velocities, atol=1e-6)
            assert (value(path, "faceVertexIndices", number).reshape(-1, 3) == surface.triangles).all()
    assert len({len(instant.ids) for instant in instants()}) > 1, "counts must change, or this shows nothing"


def test_usd_passes_its_own_checker(folder):
    from pxr import Usd, UsdGeom, UsdValidation

    stage = Usd.Stage.Open(str(folder / "w.usda"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 20
    found = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [error.GetErrorAsString() for error in found] == []
    for prim in stage.Traverse():
        mesh = UsdGeom.Mesh(prim)
        if mesh and prim.GetName() != "fluid":
            for number in range(FRAMES):
                ok, why = UsdGeom.Mesh.ValidateTopology(
                    mesh.GetFaceVertexIndicesAttr().Get(number),
                    mesh.GetFaceVertexCountsAttr().Get(number),
                    len(mesh.GetPointsAttr().Get(number)),
                )
                assert ok, why
    assert stage.GetPrimAtPath("/World/camera").GetTypeName() == "Camera"


def arrays_of(poly):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = poly.GetPointData()
    found = {data.GetArrayName(k): vtk_to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}
    points = poly.GetPoints()
    found["points"] = vtk_to_numpy(points.GetData()) if points else np.zeros((0, 3), np.float32)
    return found


def check_piece(part, instant, poly):
    """Compare what VTK read of a part with the instant."""
    back = arrays_of(poly)
    if part == "particles":
        np.testing.assert_allclose(back["points"], instant.positions, atol=1e-6)
        assert (back["velocity"] == instant.velocities).all()
        assert (back["id"] == instant.ids).all()
        assert (back["density"] == instant.densities).all()
        assert (back["material"] == instant.materials).all()
        assert (back["color"] == instant.colors).all()
        assert poly.GetNumberOfVerts() == instant.count
    elif part == "foam":
        np.testing.assert_allclose(back["points"], instant.foam_positions, atol=1e-6)
        if len(instant.foam_ids):
            assert (back["kind"] == instant.foam_kinds).all()
            assert (back["id"] == instant.foam_ids).all()
    elif part == "solids":
        np.testing.assert_allclose(back["points"], placed(instant), atol=1e-6)
        assert poly.GetNumberOfPolys() > 0
    else:
        surfaces = surfaces_of(instant)
        np.testing.assert_allclose(back["points"], np.concatenate([s.vertices for s in surfaces]), atol=1e-6)
        assert poly.GetNumberOfPolys() == sum(len(s.triangles) for s in surfaces)
        assert (back["velocity"] == np.concatenate([s.velocities for s in surfaces])).all()


@pytest.mark.parametrize("part", PARTS)
def test_vtk_reads_the_vtkhdf_files(folder, part):
    vtk = pytest.importorskip("vtk", reason="vtk is large and comes with pyvista: pip install pyvista")
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(folder / ("w.vtkhdf" if part == "particles" else f"w-{part}.vtkhdf")))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == FRAMES
    for number, instant in enumerate(instants()):
        reader.SetStep(number)
        reader.Update()
        check_piece(part, instant, reader.GetOutputDataObject(0))
        assert reader.GetTimeValue() == instant.time


@pytest.mark.parametrize("part", PARTS)
def test_vtk_reads_the_vtp_files(folder, part):
    vtk = pytest.importorskip("vtk", reason="vtk is large and comes with pyvista: pip install pyvista")
    listed = json.loads((folder / ("w.vtp.series" if part == "particles" else f"w-{part}.vtp.series")).read_text())
    assert [entry["time"] for entry in listed["files"]] == [instant.time for instant in instants()]
    for entry, instant in zip(listed["files"], instants(), strict=True):
        reader = vtk.vtkXMLPolyDataReader()
        reader.SetFileName(str(folder / entry["name"]))
        reader.Update()
        check_piece(part, instant, reader.GetOutput())


def test_trimesh_reads_the_ply_files(folder):
    import trimesh

    for number, instant in enumerate(instants()):
        cloud = trimesh.load(folder / f"w-{number:05d}.ply", process=False)
        np.testing.assert_allclose(cloud.vertices, instant.positions, atol=1e-6)
        data = cloud.metadata["_ply_raw"]["vertex"]["data"]
        assert (data["id"] == instant.ids).all()
        assert (np.stack([data[name] for name in ("red", "green", "blue")], axis=1) == instant.colors).all()
        mesh = trimesh.load(folder / f"w-surface-{number:05d}.ply", process=False)
        assert mesh.is_watertight
        assert len(mesh.faces) == sum(len(s.triangles) for s in surfaces_of(instant))
        assert (
            f"comment solid solid_1 {instant.placed[1].position[0]:.9g}".encode()
            in (folder / f"w-{number:05d}.ply").read_bytes()
        )


# --- parts, two dimensions, resumed and killed runs ---


def test_only_the_parts_that_are_asked_for(tmp_path):
    with Outputs(tmp_path / "w", world(), ("vtp", "ply"), fps=FPS, only=["surface", "foam"]) as outputs:
        outputs.write(0, instants()[5])
    names = {path.name for path in tmp_path.iterdir()}
    assert {name for name in names if name.endswith(".series")} == {"w-surface.vtp.series", "w-foam.vtp.series"}
    assert {"w-00000.ply", "w-surface-00000.ply"} <= names
    assert b"element vertex 0\n" in (tmp_path / "w-00000.ply").read_bytes()
    with pytest.raises(wt.WavetankError, match="--only water is not allowed; a frame has the parts particles, foam"):
        Outputs(tmp_path / "w", world(), ("vtp",), fps=FPS, only=["water"])


def test_two_dimensional_worlds(tmp_path):
    vtk = pytest.importorskip("vtk", reason="vtk is large and comes with pyvista: pip install pyvista")
    from pxr import Usd

    sim = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.05))
    with Outputs(tmp_path / "w", sim.scene, ("usd", "vtkhdf", "h5"), fps=FPS) as outputs:
        outputs.write(0, sim.frame())
    assert (next(hdf5.read(tmp_path / "w.h5")).positions == sim.positions).all()
    stage = Usd.Stage.Open(str(tmp_path / "w.usda"))
    points = stage.GetPrimAtPath("/World/particles").GetAttribute("points").Get(0)
    assert (np.array(points)[:, :2] == sim.positions).all()
    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(tmp_path / "w.vtkhdf"))
    reader.Update()
    assert (arrays_of(reader.GetOutputDataObject(0))["points"][:, :2] == sim.positions).all()
    with pytest.raises(wt.WavetankError, match="2-D world has no surface"):
        Outputs(tmp_path / "w", sim.scene, ("usd",), fps=FPS, only=["surface"])


def bytes_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_resumed_run_ends_with_the_same_bytes(folder, tmp_path):
    names = ("usd", "vtkhdf", "vtp", "h5", "npz", "ply")
    with Outputs(tmp_path / "w", world(), names, fps=FPS, only=PARTS, view=VIEW) as outputs:
        for number, instant in enumerate(instants()[:7]):  # farther than the checkpoint
            outputs.write(number, instant)
    with Outputs(tmp_path / "w", world(), names, fps=FPS, only=PARTS, view=VIEW, kept=4) as outputs:
        for number in range(4, FRAMES):
            outputs.write(number, instants()[number])
    whole, resumed = bytes_of(folder), bytes_of(tmp_path)
    assert whole.keys() == resumed.keys()
    assert [name for name in whole if whole[name] != resumed[name]] == []


KILLED = """
import sys, pathlib, time
sys.path.insert(0, {tests!r})
from instants import instants, world
from wavetank.run.outputs import Outputs
outputs = Outputs(pathlib.Path({out!r}) / "w", world(), ("usd", "vtkhdf", "h5", "vtp", "npz"), fps=25.0)
print("ready", flush=True)
for number in range(100_000):
    outputs.write(number, instants()[number % 10])
"""


@pytest.mark.parametrize("delay", [0.11, 0.37, 0.73])
def test_a_killed_run_opens(tmp_path, delay):
    """What is there is whole: no frame that is counted lacks anything."""
    import h5py
    from pxr import Usd

    script = KILLED.format(tests=str(__import__("pathlib").Path(__file__).parents[1]), out=str(tmp_path))
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while process.stdout.readline() not in (b"ready\n", b""):
        pass
    while not (tmp_path / "w.vtp.series").exists():
        time.sleep(0.02)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close(), process.stderr.close()
    back = list(hdf5.read(tmp_path / "w.h5"))
    assert back
    for number, instant in enumerate(back):
        assert (instant.positions == instants()[number % 10].positions).all()
    stage = Usd.Stage.Open(str(tmp_path / "w.usda"))
    last = int(stage.GetEndTimeCode())
    points = stage.GetPrimAtPath("/World/particles").GetAttribute("points")
    assert len(points.Get(last)) == instants()[last % 10].count
    with h5py.File(tmp_path / "w.vtkhdf") as file:
        steps = int(file["VTKHDF/Steps"].attrs["NSteps"])
        first = file["VTKHDF/Steps/PointOffsets"][steps - 1]
        expected = instants()[(steps - 1) % 10].positions
        assert (file["VTKHDF/Points"][first : first + len(expected)] == expected).all()
    for path in sorted(tmp_path.glob("w-*.npz")):
        npz.read(path, world())


def test_plan_knows_where_files_go(tmp_path):
    plan = Plan(tmp_path / "w", world(), FPS, frozenset(PARTS), Shapes(world()))
    assert plan.path(".vtp", "foam").name == "w-foam.vtp"
    assert plan.path(".vtp").name == "w.vtp"
