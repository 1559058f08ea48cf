"""What came out raw once: escapes on a terminal, errors of libraries, files that are not files, sparse meshes."""

import json
import os
import re
import stat
import sys
import time
from pathlib import Path

import pytest
from attacks import POOL, refused

import wavetank as wt
from wavetank.cli import main
from wavetank.foundation import atomic_write
from wavetank.run.options import RunOptions

TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
BODY = {"id": "\u001b[2J", "geometryFile": "b.obj", "translation": [0, 0, 0], "isAnimated": True}


def peer_scene(folder: Path, **more: object) -> Path:
    (folder / "b.obj").write_text(TETRAHEDRON)
    (folder / "empty.obj").write_text("# nothing\n")
    block = {"start": [0, 0, 0], "end": [1, 1, 1]}
    table = {"Configuration": {"particleRadius": 0.05}, "RigidBodies": [BODY | more], "FluidBlocks": [block]}
    path = folder / "scene.json"
    path.write_text(json.dumps(table))
    return path


def test_notes_of_an_import_do_not_command_a_terminal(tmp_path, monkeypatch, capsys):
    pytest.importorskip("trimesh")
    path = peer_scene(tmp_path)
    monkeypatch.setattr(sys, "argv", ["wavetank", "import", str(path), "-o", str(tmp_path / "o.toml")])
    with pytest.raises(SystemExit):
        main()
    said = capsys.readouterr().out
    assert "\\x1b[2J" in said and "\x1b" not in said


def case(commands: str) -> str:
    return (
        '<case><casedef><geometry><definition dp="0.1"><pointmin x="0" y="0" z="0"/><pointmax x="1" y="1" z="1"/>'
        f'</definition><commands><mainlist><setmkfluid mk="0"/>{commands}</mainlist></commands></geometry></casedef></case>'
    )


@pytest.mark.parametrize(
    "commands", ["<drawprism/>", "<drawbox/>", '<drawsphere radius="1"/>', "<drawfigure/>", "<drawpyramid/>"]
)
def test_an_import_is_refused_in_plain_words(commands, tmp_path):
    path = tmp_path / "C_Def.xml"
    path.write_text(case(commands))
    text = refused(lambda: wt.load_dualsphysics(path), re.match(r"<\w+", commands)[0])
    assert not re.search(r"Error\b|matmul|index|array", text), text


def test_a_body_without_faces_is_refused_in_plain_words(tmp_path):
    pytest.importorskip("trimesh")
    assert "Error" not in refused(
        lambda: wt.load_splishsplash(peer_scene(tmp_path, geometryFile="empty.obj")), "no faces"
    )
    assert "KeyError" not in refused(lambda: wt.load_splishsplash(peer_scene(tmp_path, geometryFile=None)))


def test_only_files_are_replaced(tmp_path):
    """As root a device or a pipe would be gone."""
    sim = wt.Simulation(wt.Scene.from_text(POOL))
    pipe = tmp_path / "pipe.npz"
    os.mkfifo(pipe)
    refused(lambda: sim.save(pipe), "a pipe")
    refused(lambda: sim.scene.save(pipe), "a pipe")
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    refused(lambda: sim.save("/dev/null"), "a device")
    refused(lambda: sim.save(tmp_path), "a folder")


def test_a_disk_that_became_read_only_is_one_sentence(tmp_path, monkeypatch):
    sim = wt.Simulation(wt.Scene.from_text(POOL))

    def read_only(*arguments: object, **more: object) -> None:
        raise OSError(30, "Read-only file system", str(tmp_path / ".x.partial"))

    monkeypatch.setattr(atomic_write.Path, "unlink", read_only)
    monkeypatch.setattr(atomic_write.Path, "open", read_only)
    text = refused(lambda: sim.save(tmp_path / "x.npz"), "Read-only")
    assert ".partial" not in text


@pytest.mark.parametrize("name", ["a\udcff", "a\nb", "\x1b[2J", "../a", ""])
def test_names_of_runs_are_printable(name, tmp_path):
    refused(lambda: RunOptions(tmp_path, 1.0, name=name), "--name")


@pytest.mark.parametrize("kind", ["ply", "stl", "obj", "glb"])
def test_a_mesh_begins_as_its_kind_does(kind, tmp_path):
    """400 MB of zeros were read as text, in 3 GB."""
    path = tmp_path / f"zeros.{kind}"
    with path.open("wb") as file:
        file.truncate(400_000_000)
    began = time.process_time()
    refused(lambda: wt.Mesh(path=str(path), center=(0, 0, 0), size=1.0), "begin")
    assert time.process_time() - began < 0.5


def test_a_mesh_opens_no_other_file(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    text = trimesh.creation.box().export(file_type="ply", encoding="ascii").decode()
    path = tmp_path / "a.ply"
    path.write_text(text.replace("ascii 1.0\n", "ascii 1.0\ncomment TextureFile missing.png\n", 1))
    assert len(wt.Mesh(path=str(path), center=(0, 0, 0), size=1.0).corners()) == 12
