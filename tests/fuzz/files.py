"""The readers of files that runs write and other programs bring: checkpoints, folders of runs, robots, scenes, particles."""

import atexit
import functools
import gzip
import io
import json
import shutil
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from attacks import taken_or_refused
from hypothesis import strategies as st
from strategies import mutated, toml_of, torn

import wavetank as wt
from wavetank.formats.bgeo import read_bgeo
from wavetank.formats.splishsplash import load_splishsplash
from wavetank.foundation.input_limits import parse_toml
from wavetank.run.checkpoints import Checkpoints, load_run
from wavetank.run.folder import Run, RunFolder

#: of this process: two that share one write over each other
FOLDER = Path(tempfile.mkdtemp(prefix="wavetank-fuzz-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
SMALL = """
spacing = 0.1
tank.size = [1.0, 0.6]
materials = [{ name = "oil", density = 900.0 }]
fluids = [{ lower = [0, 0], upper = [0.5, 0.4] }]
solids = [{ name = "ball", shape = "sphere", center = [0.7, 0.2], radius = 0.1, motion = { rotation = "t" } }]
"""
Files = dict[str, bytes]


def fresh(name: str, files: Files) -> Path:
    """Return a folder with these files and no others."""
    folder = FOLDER / name
    shutil.rmtree(folder, ignore_errors=True)
    for path, content in files.items():
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        (folder / path).write_bytes(content)
    return folder


def _read(folder: Path) -> Files:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@functools.cache
def good_run() -> Files:
    """A run of three frames with figures, both kinds of frames, and a checkpoint."""
    from wavetank.run.outputs import Outputs

    folder = fresh("made", {})
    scene = wt.Scene.from_text(SMALL)
    sim = wt.Simulation(scene)
    run = RunFolder.create(folder, Run(name="a", exports=["npz", "h5"], seconds=0.1), scene)
    kept = Checkpoints(folder, 0.03, 0.0, {"seconds": 0.1})
    with Outputs(run.base, scene, ("npz", "h5"), fps=30.0) as outputs:
        for number in range(3):
            outputs.write(number, sim.frame())
            run.add_stats(sim.stats())
            sim.step()
        outputs.drain()
        kept.write(sim, 2, {"frames": 3}, [])
    return _read(folder)


@st.composite
def runs(draw: Any) -> Files:
    """That run with one or two of its files changed, torn or gone."""
    files = dict(good_run())
    for _ in range(draw(st.integers(1, 2))):
        name = draw(st.sampled_from(sorted(files)))
        content = files[name]
        if name.endswith(".toml") and content == good_run()[name] and draw(st.booleans()):
            files[name] = toml_of(draw(mutated(st.just(parse_toml(content.decode(), name))))).encode()
        elif name.endswith("run.json") and content == good_run()[name] and draw(st.booleans()):
            files[name] = json.dumps(draw(mutated(st.just(json.loads(content))))).encode()
        elif name == "a.h5" and content == good_run()[name] and draw(st.booleans()):
            files[name] = draw(tables_of(content))
        elif draw(st.integers(0, 5)):
            files[name] = draw(torn(st.just(content)))
        else:
            del files[name]
    return files


@st.composite
def tables_of(draw: Any, content: bytes) -> bytes:
    """HDF5 that is whole and says something else."""
    h5py = __import__("h5py")
    whole = io.BytesIO(content)
    with h5py.File(whole, "r+") as file:
        names: list[str] = []
        file.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
        name = draw(st.sampled_from([*names, "attribute"]))
        value = draw(st.sampled_from([0, 1, -1, 7, 10**6, 2**31, 2**62, np.nan, np.inf]))
        what = draw(st.sampled_from(["value"] * 4 + ["external", "virtual", "link", "zeros"]))
        if what != "value" and name != "attribute":
            _elsewhere(file, name, what)
        elif name == "attribute":
            file.attrs[draw(st.sampled_from(sorted(file.attrs)))] = draw(st.sampled_from([value, "x", [1, 2]]))
        elif draw(st.integers(0, 2)) or file[name].shape == ():
            del file[name]
            if draw(st.booleans()):
                file[name] = draw(st.sampled_from([value, "x", [value] * 3, [[value] * 2] * 20]))
        elif draw(st.booleans()) and file[name].maxshape[0] is None:
            file[name].resize(draw(st.sampled_from([0, 1, 5, 10**6, 2**40])), axis=0)
        elif len(file[name]) and file[name].dtype.kind in "fi":
            limits = np.iinfo(file[name].dtype) if file[name].dtype.kind == "i" else None
            if limits is not None:
                value = int(np.clip(np.nan_to_num(value), limits.min, limits.max))
            file[name][draw(st.integers(0, len(file[name]) - 1))] = value
    return whole.getvalue()


def _elsewhere(file: Any, name: str, what: str) -> None:
    """Put the data of a table into another file, or make it stand for far more than the file holds."""
    h5py = __import__("h5py")
    shape, kind = file[name].shape or (10,), file[name].dtype
    del file[name]
    if what == "external":
        file.create_dataset(name, shape=shape, dtype=kind, external=[("/etc/passwd", 0, h5py.h5f.UNLIMITED)])
    elif what == "virtual":
        layout = h5py.VirtualLayout(shape=shape, dtype=kind)
        layout[...] = h5py.VirtualSource("/etc/passwd", "x", shape=shape)
        file.create_virtual_dataset(name, layout)
    elif what == "link":
        file[name] = h5py.ExternalLink("/etc/passwd", "/x")
    else:
        file.create_dataset(name, shape=(2**32, *shape[1:]), dtype=kind, chunks=(2**16, *shape[1:]), compression="gzip")


def try_checkpoint(files: Files) -> None:
    folder = fresh("checkpoint", files)
    kept = taken_or_refused(lambda: load_run(folder))
    if kept is not None:
        taken_or_refused(kept.sim.step)
        assert np.isfinite(kept.sim.positions).all()


def try_run(files: Files) -> None:
    folder = fresh("run", files)
    run = taken_or_refused(lambda: RunFolder.open(folder))
    if run is None:
        return

    def read() -> None:
        for row in run.stats():
            assert all(isinstance(value, int | float) for value in row.values())
        run.has_instants()
        for frame in run.instants():
            assert np.isfinite(frame.positions).all()
            assert len(frame.ids) == len(frame.positions) == len(frame.velocities)

    taken_or_refused(read)
    taken_or_refused(lambda: run.instant_at(0.05))


ROBOT = """<?xml version="1.0"?>
<robot name="arm">
  <material name="orange"><color rgba="1 0.5 0 1"/></material>
  <link name="post"><collision>
    <origin xyz="0 0 0.1"/><geometry><cylinder radius="0.1" length="0.2"/></geometry></collision></link>
  <link name="upper"><inertial><mass value="2"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.1"/></geometry><material name="orange"/></visual>
    <collision><origin xyz="0 0 0.2"/><geometry><box size="0.08 0.06 0.4"/></geometry></collision></link>
  <link name="cup"><collision><geometry><sphere radius="0.06"/></geometry></collision></link>
  <link name="tool"><visual><geometry><mesh filename="package://a/b.stl" scale="1 1 1"/></geometry></visual></link>
  <joint name="shoulder" type="revolute"><parent link="post"/><child link="upper"/>
    <origin xyz="0 0 0.2" rpy="0 0 1.5707963"/><axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="90"/></joint>
  <joint name="grip" type="fixed"><parent link="upper"/><child link="cup"/><origin xyz="0.3 0 0"/></joint>
  <joint name="tip" type="prismatic"><parent link="cup"/><child link="tool"/><axis xyz="0 0 1"/></joint>
</robot>"""
NUMBERS = (
    "0",
    "1e12",
    "-1",
    "1e308",
    "nan",
    "inf",
    "1e-300",
    "",
    "a",
    "1 2",
    "0 0 0",
    "1e30 0 0",
    "nan nan nan",
    "0.1 0.2 0.3",
)


CASE = """<case><casedef><constantsdef><gravity x="0" y="0" z="-9.81"/><rhop0 value="1000"/></constantsdef>
<geometry><predefinition><newvarcte wide="0.5"/></predefinition>
<definition dp="0.05"><pointmin x="0" y="0" z="0"/><pointmax x="2" y="1" z="1"/></definition><commands>
<list name="more"><drawsphere radius="0.06"><point x="0.7" y="0.2" z="0.5"/></drawsphere></list><mainlist>
<setmkfluid mk="0"/><drawbox><boxfill>solid</boxfill><point x="0" y="0" z="0"/><size x="#wide" y="0.4" z="0.3"/></drawbox>
<setmkbound mk="0"/><drawbox><boxfill>bottom|left|right|front|back</boxfill><point x="0" y="0" z="0"/>
<endpoint x="1" y="0.4" z="0.5"/></drawbox><setmkvoid/><drawbox><boxfill>solid</boxfill><point x="0.1" y="0" z="0.1"/>
<size x="0.1" y="0.1" z="0.1"/></drawbox><setmkbound mk="1"/><runlist name="more" times="1"/><move x="0.1" y="0" z="0"/>
<setmkbound mk="2"/><rotate ang="20" x="0" y="0" z="1"/><drawbox><boxfill>all</boxfill><point x="0.75" y="0" z="0.1"/>
<size x="0.1" y="0.1" z="0.1"/></drawbox><drawprism><point x="0.6" y="0" z="0"/><point x="0.7" y="0" z="0"/>
<point x="0.6" y="0.1" z="0"/><point x="0.6" y="0" z="0.2"/><point x="0.7" y="0" z="0.2"/><point x="0.6" y="0.1" z="0.2"/>
</drawprism><drawcylinder radius="0.05"><point x="0.9" y="0" z="0"/><point x="0.9" y="0" z="0.1"/></drawcylinder>
<fillbox x="0" y="0" z="0"><modefill>void</modefill><point x="0" y="0" z="0"/><size x="0.9" y="0.4" z="0.1"/></fillbox>
</mainlist></commands></geometry><initials><velocity mkfluid="0" x="0.1" y="0" z="0"/></initials>
<floatings><floating mkbound="1" rhopbody="500"><linearvelini x="0" y="0" z="0.1"/></floating></floatings>
<motion><objreal ref="2"><begin mov="1" start="0.1"/><mvrot id="1" duration="0.5" next="2"><vel ang="30"/>
<axisp1 x="0" y="0" z="0"/><axisp2 x="0" y="0" z="1"/></mvrot><wait id="2" duration="0.1"/></objreal></motion></casedef>
<execution><special><wavepaddles><piston><mkbound value="2"/><depth value="0.3"/><waveheight value="0.05"/>
<waveperiod value="1"/></piston></wavepaddles></special><parameters><parameter key="TimeMax" value="1"/></parameters>
</execution></case>"""


def spoiled(draw: Any, root: Any, names: list[str]) -> bytes:
    """Return XML with other attributes, elements that are gone, twice, or in the wrong place; or torn."""
    from xml.etree import ElementTree

    for _ in range(draw(st.integers(1, 4))):
        rows = [row for row in root.iter() if row is not root]
        row, other = draw(st.sampled_from(rows)), draw(st.sampled_from(rows))
        what = draw(st.sampled_from(["value", "value", "value", "drop", "twice", "into", "tag"]))
        if what == "value" and row.attrib:
            row.set(draw(st.sampled_from(sorted(row.attrib))), draw(st.sampled_from([*NUMBERS, *names])))
        elif what == "drop":
            for parent in root.iter():
                if row in [*parent]:
                    parent.remove(row)
                    break
        elif what == "twice":
            root.append(ElementTree.fromstring(ElementTree.tostring(row)))
        elif what == "into":
            row.append(ElementTree.fromstring(ElementTree.tostring(other)))
        else:
            row.tag = other.tag
    content = ElementTree.tostring(root)
    return draw(torn(st.just(content))) if not draw(st.integers(0, 3)) else content


@st.composite
def robots(draw: Any) -> bytes:
    """A robot with damages."""
    from xml.etree import ElementTree

    root = ElementTree.fromstring(
        ROBOT.replace("package://a/", "").replace(
            '<mesh filename="b.stl" scale="1 1 1"/>',
            '<sphere radius="0.1"/>' if draw(st.booleans()) else '<mesh filename="b.stl" scale="1 1 1"/>',
        )
    )
    return spoiled(draw, root, ["post", "upper", "cup"])


@st.composite
def cases(draw: Any) -> bytes:
    """A case of DualSPHysics with damages."""
    from xml.etree import ElementTree

    return spoiled(draw, ElementTree.fromstring(CASE), ["bound", "#Dp*2", "#wide", "#1/0", "left|top", "1-9999999"])


def try_robot(content: bytes) -> None:
    path = fresh("robot", {"arm.urdf": content}) / "arm.urdf"
    robot = taken_or_refused(lambda: wt.load_urdf(path, (0.5, 0.1, 0.5)))
    if robot is not None:
        pool = wt.Scene.from_text(
            "spacing = 0.1\ntank.size = [1, 1, 1]\nfluids = [{lower = [0, 0, 0], upper = [1, 0.2, 1]}]"
        )
        joined = taken_or_refused(lambda: robot.joined(pool))
        if joined is not None:
            assert wt.Scene.from_text(joined.text()) is not None


def particle_file(
    count: int = 40, attributes: tuple[tuple[str, int, int], ...] = (("id", 1, 1), ("velocity", 3, 5))
) -> bytes:
    """Points of Houdini's classic format, as Partio writes them."""
    parts = [b"BgeoV" + struct.pack(">9I", 5, count, 1, 0, 0, len(attributes), 0, 1, 0)]
    for name, size, kind in attributes:
        parts.append(struct.pack(">H", len(name)) + name.encode() + struct.pack(">HI", size, kind) + bytes(4 * size))
    width = 4 + sum(size for _, size, _ in attributes)
    rows = np.random.default_rng(1).uniform(0.1, 0.4, (count, width)).astype(">f4")
    rows[:, 3] = 1.0
    return b"".join([*parts, rows.tobytes(), bytes([0, 255])])


@functools.cache
def good_scenes() -> list[tuple[dict[str, Any], Files]]:
    """Scenes of SPlisHSPlasH as its manual describes them, with their particles."""
    wall = {
        "id": 1,
        "geometryFile": "UnitBox.obj",
        "translation": [0, 1, 0],
        "scale": [2, 2, 2],
        "isDynamic": False,
        "isWall": True,
        "mapInvert": True,
    }
    first = {
        "Configuration": {"particleRadius": 0.05, "gravitation": [0, -9.81, 0], "timeStepSize": 0.001},
        "Materials": [
            {
                "id": "Fluid",
                "density0": 1000,
                "viscosityMethod": 6,
                "maxEmitterParticles": 1000,
                "Weiler et al. 2018": {"viscosity": 0.01},
                "surfaceTensionMethod": 5,
                "Zorilla, Ritter, et al. 2020": {"surfaceTension": 0.07},
            }
        ],
        "RigidBodies": [
            wall,
            {
                "id": 2,
                "geometryFile": "UnitBox.obj",
                "translation": [0.3, 0.5, 0],
                "scale": [0.2, 0.2, 0.2],
                "isDynamic": True,
                "density": 500,
                "rotationAxis": [1, 0, 0],
                "rotationAngle": 0.3,
            },
        ],
        "FluidBlocks": [{"start": [-0.9, 0.1, -0.9], "end": [0, 0.9, 0], "translation": [0, 0, 0], "scale": [1, 1, 1]}],
        "Emitters": [
            {
                "id": "Fluid",
                "width": 5,
                "height": 5,
                "translation": [-0.5, 1.5, 0],
                "velocity": 2,
                "rotationAxis": [0, 0, 1],
                "rotationAngle": 0,
                "emitEndTime": 4,
                "type": 1,
            }
        ],
        "HingeJoints": [{"bodyID1": 2, "bodyID2": 1, "position": [0.3, 0.5, 0], "axis": [0, 0, 1]}],
    }
    plane = {
        "Configuration": {"particleRadius": 0.05, "sim2D": True},
        "RigidBodies": [wall],
        "FluidModels": [
            {
                "particleFile": "a.bgeo",
                "translation": [0.1, 0, 0],
                "rotationAxis": [0, 0, 1],
                "rotationAngle": 0.5,
                "initialVelocity": [1, 0, 0],
            }
        ],
    }
    import trimesh

    box = trimesh.creation.box().export(file_type="obj").encode()
    return [(first, {"UnitBox.obj": box}), (plane, {"UnitBox.obj": box, "a.bgeo": particle_file()})]


@st.composite
def others(draw: Any) -> Files:
    """Scenes of SPlisHSPlasH with values of other kinds, torn, or with damaged files beside them."""
    plain, files = draw(st.deferred(lambda: st.sampled_from(good_scenes())))
    files = dict(files)
    content = json.dumps(draw(mutated(st.just(plain)))).encode()
    if not draw(st.integers(0, 4)):
        content = draw(torn(st.just(json.dumps(plain).encode())))
    if not draw(st.integers(0, 4)):
        name = draw(st.sampled_from(sorted(files)))
        files[name] = draw(torn(st.just(files[name])))
    return {**files, "scene.json": content}


def try_other(files: Files) -> None:
    path = fresh("other", files) / "scene.json"
    begin(taken_or_refused(lambda: load_splishsplash(path)))


def try_case(content: bytes) -> None:
    path = fresh("case", {"a_Def.xml": content}) / "a_Def.xml"
    begin(taken_or_refused(lambda: wt.load_dualsphysics(path)))


def begin(found: Any) -> None:
    """Compute a frame of an imported scene that is small."""
    if found is not None:
        assert all("\n" not in note for note in found.notes)
        count = sum(fluid.estimate(found.scene.spacing) for fluid in found.scene.fluids)
        if count < 3000:
            taken_or_refused(lambda: wt.Simulation(found.scene).step())


particles = st.tuples(torn(st.deferred(lambda: st.just(particle_file()))), st.booleans()).map(
    lambda pair: gzip.compress(pair[0], 1) if pair[1] else pair[0]
)


def try_particles(content: bytes) -> None:
    path = fresh("particles", {"a.bgeo": content}) / "a.bgeo"
    rows = taken_or_refused(lambda: read_bgeo(path))
    assert rows is None or (rows.shape[1:] == (3,) and not np.isnan(rows).any())


@st.composite
def inclusions(draw: Any) -> Files:
    """Models of MuJoCo that include each other, and themselves, again and again."""
    number = draw(st.integers(1, 12))
    files = {}
    for k in range(number):
        rows = "".join(
            f'<include file="{other}.xml"/>' for other in draw(st.lists(st.integers(0, number), max_size=12))
        )
        geom = f'<worldbody><body name="b{k}"><geom size="0.1"/></body></worldbody>'
        files[f"{k}.xml"] = f"<mujoco>{rows}{geom}</mujoco>".encode()
    return files


def try_inclusions(files: Files) -> None:
    folder = fresh("inclusions", files)
    taken_or_refused(lambda: wt.load_robot(folder / "0.xml"))


FILES: dict[str, tuple[st.SearchStrategy[Any], Any]] = {
    "checkpoint": (runs(), try_checkpoint),
    "run": (runs(), try_run),
    "robot": (robots(), try_robot),
    "inclusion": (inclusions(), try_inclusions),
    "other": (others(), try_other),
    "case": (cases(), try_case),
    "particles": (particles, try_particles),
}
