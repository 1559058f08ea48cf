"""A mesh as data: files, what is refused, and the ways through scenes, commands and caches."""

import numpy as np
import pytest
from surfaces import CUBE, ball, write_obj

import wavetank as wt
from wavetank.session.commands import LoadScene, command_of, table_of
from wavetank.session.session import Session
from wavetank.solids.meshes import files, grid, store

PLACE = {"center": (0.3, 0.3, 0.3), "size": 0.2}
SCENE = """
spacing = 0.05
[tank]
size = [0.6, 0.6, 0.6]
[[fluids]]
lower = [0, 0, 0]
upper = [0.2, 0.2, 0.2]
[[solids]]
name = "thing"
shape = "mesh"
path = "thing.obj"
center = [0.4, 0.3, 0.3]
size = 0.2
"""


@pytest.fixture
def scene_file(tmp_path):
    write_obj(tmp_path / "thing.obj", *CUBE)
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path / "scene.toml"


@pytest.mark.parametrize("suffix", files.SUFFIXES)
def test_every_format_is_the_same_solid(tmp_path, suffix):
    """Written by the library that reads it; STL knows no shared corners, PLY and GLB are binary."""
    import trimesh

    path = tmp_path / f"ball{suffix}"
    trimesh.Trimesh(*ball(16), process=False).export(path)
    found, expected = wt.Mesh(path=str(path), **PLACE), wt.Mesh.of(*ball(16), **PLACE)
    near = np.abs(expected.grid(0.05).distances) < 3.0 * 0.05
    np.testing.assert_allclose(found.grid(0.05).distances[near], expected.grid(0.05).distances[near], atol=2e-6)


def test_a_scene_of_several_parts_is_put_together(tmp_path):
    import trimesh

    scene = trimesh.Scene()
    for x in (0.0, 3.0):
        scene.add_geometry(trimesh.Trimesh(*CUBE), transform=trimesh.transformations.translation_matrix((x, 0, 0)))
    scene.export(tmp_path / "two.glb")
    edges = np.ptp(wt.Mesh(path=str(tmp_path / "two.glb"), **PLACE)._triangles().vertices, axis=0)
    np.testing.assert_allclose(edges, (1.0, 0.25, 0.25), atol=1e-6)


@pytest.mark.parametrize(
    "name, content, told",
    [
        (
            "none.obj",
            None,
            r"there is no mesh file .*none.obj; bundled models are: wavetank/bathtub.obj, wavetank/boat.obj",
        ),
        ("empty.obj", "", r"empty.obj"),
        ("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", r"points.obj has no faces"),
        ("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", r"nan.obj: vertex 0 is not finite"),
        ("dot.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", r"dot.obj has the size 0"),
        ("line.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n", r"line.obj has only faces without an area"),
        ("noise.stl", "certainly no mesh", r"noise.stl"),
        ("noise.glb", "certainly no mesh", r"noise.glb: this mesh cannot be read"),
        ("model.step", "ISO-10303-21;", r"meshes are read from .obj, .stl, .ply, .glb files"),
    ],
)
def test_a_wrong_file_is_one_sentence(tmp_path, name, content, told):
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(wt.WavetankError, match=told) as caught:
        wt.Mesh(path=str(tmp_path / name), **PLACE)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "change, told",
    [
        ({"vertices": [(0, 0)] * 3}, r"vertices have shape \[3, 2\]; they must be \[n, 3\]"),
        ({"faces": [(0, 1, 99)]}, r"its faces name the vertices 0 to 99; there are 0 to 7"),
        ({"faces": []}, r"has no faces"),
        ({"vertices": np.array(CUBE[0]) * np.inf}, r"is not finite"),
        ({"vertices": np.array(CUBE[0]) * 1e200}, r"has the size 1e\+200"),
        ({"size": 0}, r"size = 0 is not allowed; it must be a number greater than 0"),
        ({"size": (1, 0, 1)}, r"size\[1\] = 0 is not allowed"),
        ({"center": (0, 0)}, r"center\[2\] is missing"),
        ({"thickness": -1}, r"thickness = -1 is not allowed"),
        ({"up": "w"}, r"up = 'w' is not allowed; it must be one of 'x', 'y' or 'z'"),
    ],
)
def test_wrong_numbers_are_one_sentence(change, told):
    with pytest.raises(wt.WavetankError, match=told):
        wt.Mesh.of(**{"vertices": CUBE[0], "faces": CUBE[1], **PLACE, **change})


def test_what_cannot_be_a_solid_is_told_when_the_world_is_made():
    open_box = wt.Mesh.of(CUBE[0], CUBE[1][2:], name="crate", **PLACE)
    with pytest.raises(wt.WavetankError, match=r"crate is not closed.*or give thickness"):
        open_box.grid(0.02)
    assert wt.Mesh.of(CUBE[0], CUBE[1][2:], thickness=0.02, **PLACE).grid(0.02)
    turned = CUBE[1].copy()
    turned[0] = turned[0][::-1]
    with pytest.raises(wt.WavetankError, match=r"faces turned the wrong way"):
        wt.Mesh.of(CUBE[0], turned, **PLACE).grid(0.02)
    with pytest.raises(wt.WavetankError, match=r"of 50 x 50 x 50 m at spacing = 0.02 m needs a grid of 1.3e\+11 nodes"):
        wt.Mesh.of(*CUBE, center=(0, 0, 0), size=50.0).grid(0.02)
    sheet = wt.Mesh.of([(0, 0, 0), (1, 0, 0), (0, 0, 1)], [(0, 1, 2)], center=(0, 0, 0), size=(1, 1, 1))
    with pytest.raises(wt.WavetankError, match=r"is flat; a mesh without a depth needs size as one number"):
        sheet.grid(0.05)


def test_too_many_triangles_are_refused(monkeypatch):
    from wavetank.solids.meshes import triangles

    monkeypatch.setattr(triangles, "MOST_TRIANGLES", 11)
    with pytest.raises(wt.WavetankError, match=r"has 12 triangles; at most 11 are allowed: simplify it"):
        wt.Mesh.of(*CUBE, **PLACE)


def test_a_flat_world_has_no_meshes():
    with pytest.raises(wt.WavetankError, match=r"solids\[0\] is \(or has\) a mesh, and a mesh needs a 3-D world"):
        wt.Scene(spacing=0.05, tank=wt.Tank(size=(1, 1)), solids=[wt.Mesh.of(*CUBE, **PLACE)])


def test_the_file_is_beside_the_scene_and_then_inside(scene_file, monkeypatch, tmp_path):
    """Read once, from the scene's folder, wherever one is; what is saved needs no file and does not follow it."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    scene = wt.Scene.load(scene_file)
    expected = scene.solids[0].grid(0.05).distances
    scene.save("copy.toml")
    write_obj(tmp_path / "thing.obj", *ball(8))
    again = wt.Scene.load("copy.toml")
    assert again == scene
    np.testing.assert_array_equal(again.solids[0].grid(0.05).distances, expected)
    assert wt.Scene.load(scene_file) != scene


def test_bundled_models_are_known_by_name():
    scene = wt.Scene.load("knot")
    assert scene.solids[0].path == "wavetank/knot.obj"
    assert scene.solids[0].data == "", "a name is enough, here and in a recording"
    assert wt.Scene.from_text(scene.text()) == scene


def test_commands_open_no_files(scene_file, monkeypatch):
    """A command may come from afar."""
    monkeypatch.chdir(scene_file.parent)
    session = Session(wt.Scene.load("weightless-drop").changed(spacing=0.003))
    with pytest.raises(
        wt.WavetankError, match=r"path = 'thing.obj' is not a bundled model \(wavetank/bathtub.obj, wavetank/boat.obj"
    ):
        session.apply(LoadScene(text=SCENE))
    solid = {"shape": "mesh", "path": "thing.obj", "center": (0.4, 0.4, 0.4), "size": 0.2}
    with pytest.raises(wt.WavetankError, match=r"no other file is opened from here"):
        command_of({"do": "add-solid", "solid": solid})
    command = command_of({"do": "add-solid", "solid": {**solid, "path": "wavetank/knot.obj"}})
    assert command_of(table_of(command)) == command
    session.apply(LoadScene(text=wt.Scene.load(scene_file).text()))
    assert session.sim.scene.solids[0].name == "thing"


def test_data_that_is_none_is_refused():
    for data in ("x", "AAAA", wt.Mesh.of(*CUBE, **PLACE).data[:-40]):
        with pytest.raises(wt.WavetankError, match=r"data is not a mesh that a saved scene holds; give path instead"):
            wt.Mesh(data=data, **PLACE)
    with pytest.raises(wt.WavetankError, match=r"a mesh needs path"):
        wt.Mesh(**PLACE)


def test_a_library_that_is_missing_is_one_sentence(scene_file, monkeypatch):
    from wavetank.solids.meshes.mesh import _triangles

    monkeypatch.setitem(__import__("sys").modules, "trimesh", None)
    told = r"read by trimesh; install it: pip install trimesh"
    with pytest.raises(wt.WavetankError, match=told):
        wt.Scene.load(scene_file)
    _triangles.cache_clear()
    with pytest.raises(wt.WavetankError, match=told):  # a bundled model is read by those who need it
        wt.Simulation(wt.Scene.load("knot"))


def test_grids_are_measured_once(cache, monkeypatch):
    """In memory, on disk, and again where the file in the cache is damaged or nothing can be written."""
    calls = []
    measure = grid.measure
    monkeypatch.setattr(grid, "measure", lambda *a: calls.append(a) or measure(*a))
    solid = wt.Mesh.of(*CUBE, **PLACE)
    first = solid.grid(0.05).distances
    solid.grid(0.05)
    assert len(calls) == 1
    store._grids.clear()
    np.testing.assert_array_equal(solid.grid(0.05).distances, first)
    assert len(calls) == 1
    solid.grid(0.04)
    wt.Mesh.of(*CUBE, **{**PLACE, "size": 0.21}).grid(0.05)
    assert len(calls) == 3
    for path in cache.iterdir():
        path.write_bytes(path.read_bytes()[:100])
    store._grids.clear()
    np.testing.assert_array_equal(solid.grid(0.05).distances, first)
    assert len(calls) == 4
    monkeypatch.setenv("WAVETANK_CACHE", "/dev/null/nowhere")
    store._grids.clear()
    np.testing.assert_array_equal(solid.grid(0.05).distances, first)
