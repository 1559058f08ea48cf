"""Files of runs and of other programs that fell once, in their smallest form: one sentence, soon, and little memory."""

import gzip
import json
import struct

import numpy as np
import pytest
from attacks import bomb, nested, refused
from files import ROBOT, fresh, good_run, good_scenes, particle_file

import wavetank as wt
from wavetank.formats.bgeo import read_bgeo
from wavetank.formats.splishsplash import load_splishsplash
from wavetank.run.checkpoints import load_run
from wavetank.run.folder import RunFolder


@pytest.fixture(autouse=True)
def strict(monkeypatch):
    monkeypatch.setenv("WAVETANK_STRICT_INPUT", "1")


def test_a_run_reads_what_it_wrote():
    folder = RunFolder.open(fresh("whole", good_run()))
    rows = folder.stats()
    assert len(rows) == 3
    assert all(set(row) == set(rows[0]) for row in rows)
    assert [frame.count for frame in folder.instants()] == [rows[0]["count"]] * 3
    for line in (folder.path / "stats.jsonl").read_text().splitlines():
        json.loads(line, parse_constant=lambda name: pytest.fail(f"{name} is no JSON (RFC 8259, 6)"))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("x = " + "[" * 100_000, "nested"),
        ('format = 2\nwavetank = "9"', "format"),
        ("every = 0", "every"),
        ("fps = nan", "fps"),
        ("\0", "TOML"),
        ("name = " + "9" * 5000, "digits"),
    ],
)
def test_what_was_ordered(content, words):
    folder = fresh("ordered", good_run() | {"run.toml": content.encode()})
    refused(lambda: RunFolder.open(folder), words)


@pytest.mark.parametrize("line", ["{", "[" * 100_000, "[]", '{"time": "soon"}', '{"time": []}', "9" * 5000, "\u00e9"])
def test_figures_that_are_none_name_their_line(line):
    folder = RunFolder.open(fresh("figures", good_run()))
    with (folder.path / "stats.jsonl").open("a", encoding="utf-8") as file:
        file.write(line + "\n")
    refused(folder.stats, "stats.jsonl, line 4")


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("velocities", np.zeros((3, 2), "f4")),
        ("positions", np.zeros((5, 7), "f4")),
        ("materials", np.full(20, 99)),
        ("positions", np.full((20, 2), np.nan)),
        ("foam_kinds", np.zeros(4, "i4")),
        ("ids", np.zeros(0)),
        ("time", np.nan),
        ("solid_poses", np.full((1, 13), np.nan)),
        ("number", np.array("x")),
    ],
)
def test_frames_that_are_none_of_this_scene(name, array):
    folder = RunFolder.open(fresh("frames", {key: good for key, good in good_run().items() if not key.endswith(".h5")}))
    path = folder.path / "a-00001.npz"
    with np.load(path) as file:
        arrays = {key: file[key] for key in file.files}
    np.savez(path, **(arrays | {name: array}))
    if name == "ids":  # what is missing is empty or 0, as for files with some of the parts
        assert folder.instant_at(0.034).count == 0 or [*folder.instants()]
    else:
        assert "a-00001.npz" in refused(lambda: [*folder.instants()])


def test_frames_that_unpack_to_terabytes():
    folder = RunFolder.open(fresh("frames", {key: good for key, good in good_run().items() if not key.endswith(".h5")}))
    (folder.path / "a-00001.npz").write_bytes(bomb())
    refused(lambda: [*folder.instants()])


@pytest.mark.parametrize(
    "change",
    [
        lambda file: file["water/count"].__setitem__(1, 2**62),
        lambda file: file["water/first"].__setitem__(1, -5),
        lambda file: file["water/positions"].resize(2**40, axis=0) or file["water/count"].__setitem__(1, 2**40),
        lambda file: file.attrs.__setitem__("NFrames", "many"),
        lambda file: file.__delitem__("solids"),
        lambda file: file["water/positions"].__setitem__(30, np.nan),
        lambda file: (file.__delitem__("foam/count"), file.__setitem__("foam/count", np.full(3, np.inf))),
        lambda file: file.attrs.__setitem__("NFrames", 9),
    ],
)
def test_tables_that_say_something_else(change):
    h5py = pytest.importorskip("h5py")
    folder = RunFolder.open(fresh("tables", good_run()))
    with h5py.File(folder.path / "a.h5", "r+") as file:
        change(file)
    refused(lambda: [*folder.instants()], "a.h5")


def test_checkpoints():
    pytest.importorskip("h5py")
    assert load_run(fresh("checkpoint", good_run())).checkpoint.frame == 2
    for content, words in (
        (b"{", "JSON"),
        (b"[]", "format"),
        (b'{"format": 1}', "order"),
        (b'{"format": 3}', "format"),
    ):
        folder = fresh("checkpoint", good_run() | {"states/run.json": content})
        refused(lambda folder=folder: load_run(folder), words)


# --- of other programs ---


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('xyz="0 0 0.2"', 'xyz="0"', "3 numbers"),
        ('xyz="0 0 0.2"', 'xyz="0 0 nan"', "3 numbers"),
        ('rpy="0 0 1.5707963"', 'rpy="1e400 0 0"', "3 numbers"),
        ('size="0.08 0.06 0.4"', 'size="1"', "3 numbers"),
        ('value="2"', 'value="heavy"', "heavy"),
        ('<child link="tool"/>', "", "child"),
        ("b.stl", "b" * 5000 + ".stl", ""),
        ("b.stl", "a\0.stl".replace("\0", "&#9;"), ""),
        ('<?xml version="1.0"?>', '<!DOCTYPE a [<!ENTITY b "c">]>', "document"),
        ('<link name="cup">', "<link>" * 90_000, "XML"),
        ('radius="0.06"', 'radius="1e308"', ""),
    ],
)
def test_robots(old, new, words):
    assert old in ROBOT
    path = fresh("robot", {"arm.urdf": ROBOT.replace(old, new).encode()}) / "arm.urdf"
    assert str(path) in refused(lambda: wt.load_urdf(path), words)


def test_a_robot_of_very_many_joints_costs_little():
    joints = '<joint name="a" type="fixed"><parent link="post"/><child link="upper"/></joint>' * 100_000
    path = fresh("robot", {"arm.urdf": f'<robot><link name="post"/><link name="upper"/>{joints}</robot>'.encode()})
    refused(lambda: wt.load_urdf(path / "arm.urdf"), "300")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('{"Configuration": {}, "x": ' + nested("[", "]", 50_000) + "}", "nested"),
        ('{"Configuration": NaN}', "finite"),
        ('{"Configuration": {"particleRadius": ' + "9" * 4000 + "}}", ""),
        ('{"Configuration": []}', "Configuration"),
        ('{"Configuration": {}, "RigidBodies": [{"geometryFile": "' + "a" * 5000 + '"}]}', "scene.json"),
        ("\0", "JSON"),
    ],
)
def test_scenes_of_another_program(content, words):
    path = fresh("other", {"scene.json": content.encode()}) / "scene.json"
    refused(lambda: load_splishsplash(path), words)


def test_meshes_beside_such_a_scene_are_counted_first():
    plain, files = good_scenes()[0]
    many = b"\0" * 80 + struct.pack("<I", 60_000_000) + bytes(5000)
    plain = json.loads(json.dumps(plain).replace("UnitBox.obj", "many.stl"))
    path = fresh("other", {**files, "many.stl": many, "scene.json": json.dumps(plain).encode()}) / "scene.json"
    refused(lambda: load_splishsplash(path), "triangles")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (particle_file()[:60], "bgeo"),
        (gzip.compress(particle_file())[:-30], ""),
        (b"BgeoV", "bgeo"),
        (gzip.compress(particle_file()[:5] + struct.pack(">9I", 5, 2**31, 1, 0, 0, 0, 0, 1, 0) + bytes(10**7)), "take"),
        (particle_file()[:5] + struct.pack(">9I", 5, 1, 1, 0, 0, 2**31, 0, 1, 0) + bytes(10**6), "attributes"),
        (b"\x1f\x8b" + bytes(50), "particles"),
    ],
)
def test_particles_of_houdini(content, words):
    path = fresh("particles", {"a.bgeo": content}) / "a.bgeo"
    refused(lambda: read_bgeo(path), words)


def test_particles_of_houdini_that_are_whole():
    for content in (particle_file(), gzip.compress(particle_file())):
        rows = read_bgeo(fresh("particles", {"a.bgeo": content}) / "a.bgeo")
        assert rows.shape == (40, 3)
        assert 0.1 < rows.min() < rows.max() < 0.4
