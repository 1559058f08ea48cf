"""Meshes as CAD makes them: scale, units and places of the file, several files of one assembly."""

import numpy as np
import pytest
import trimesh

import wavetank as wt


@pytest.fixture
def parts(tmp_path):
    """Two files of one assembly in mm, z up: a vessel about the origin and a baffle beside it."""
    vessel = trimesh.creation.annulus(r_min=180, r_max=200, height=300)
    baffle = trimesh.creation.box((20, 340, 200))
    baffle.apply_translation((90, 0, -30))
    for name, mesh in (("vessel", vessel), ("baffle", baffle)):
        mesh.export(tmp_path / f"{name}.stl")
    return tmp_path


def corners(solid: wt.Mesh) -> np.ndarray:
    points = solid.vertices() + solid.center
    return np.array([points.min(axis=0), points.max(axis=0)])


@pytest.mark.parametrize("keys", [{"units": "mm"}, {"scale": 0.001}, {"scale": 0.1, "units": "cm"}])
@pytest.mark.parametrize("up", ["y", "z"])
def test_an_assembly_is_where_its_files_say(parts, keys, up):
    boxes = {"vessel": [(-0.2, -0.2, -0.15), (0.2, 0.2, 0.15)], "baffle": [(0.08, -0.17, -0.13), (0.1, 0.17, 0.07)]}
    for name, box in boxes.items():
        if up == "z":  # their z is our y, their y our -z
            box = np.sort([(x, z, -y) for x, y, z in box], axis=0)
        solid = wt.Mesh(path=str(parts / f"{name}.stl"), up=up, **keys)
        np.testing.assert_allclose(corners(solid), box, atol=2e-6)


def test_a_center_moves_it_and_arrays_and_files_agree(parts):
    solid = wt.Mesh(path=str(parts / "baffle.stl"), units="mm", center=(1, 2, 3))
    np.testing.assert_allclose(corners(solid).mean(axis=0), (1, 2, 3), atol=1e-6)
    whole = trimesh.load(parts / "baffle.stl")
    again = wt.Mesh.of(whole.vertices, whole.faces, units="mm")
    np.testing.assert_allclose(corners(again), whole.bounds / 1000, atol=2e-6)


def test_a_scene_keeps_size_and_place_without_the_file(parts):
    (parts / "scene.toml").write_text(
        "spacing = 0.02\n[tank]\nsize = [0.5, 0.5, 0.5]\nlower = [-0.25, -0.25, -0.25]\n"
        '[[solids]]\nshape = "mesh"\npath = "vessel.stl"\nunits = "mm"\nup = "z"\n'
    )
    scene = wt.Scene.load(parts / "scene.toml")
    (parts / "vessel.stl").unlink()
    again = wt.Scene.parse(scene.table())
    assert again == scene and scene.solids[0].scale is None and scene.solids[0].size == pytest.approx(0.4)
    assert "scale" not in scene.model_dump_json(), "digests of other scenes with meshes stay"
    assert wt.Scene.checked(scene).scaled(2.0).solids[0].size == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"units": "mm", "size": 0.4}, "exclude each other"),
        ({"units": "furlong"}, "it must be one of mm, cm, m, in, ft"),
        ({"scale": 0}, "must be more than 0"),
        ({"scale": "big"}, "scale = 'big' is not allowed"),
        ({"scale": 1e30}, "at most 1e\\+09"),
        ({}, "a mesh needs size, its longest edge"),
        ({"size": 0.4}, "center is missing"),
        ({"units": "mm", "path": "none.stl"}, "there is no mesh file"),
    ],
)
def test_what_does_not_fit_is_one_sentence(parts, keys, words):
    with pytest.raises(wt.WavetankError, match=words):
        wt.Mesh(**{"path": str(parts / "vessel.stl"), **keys})


def test_water_stands_in_an_assembly(parts):
    solids = [wt.Mesh(name=name, path=str(parts / f"{name}.stl"), up="z", units="mm") for name in ("vessel", "baffle")]
    tank = wt.Tank(size=(0.5, 0.4, 0.5), lower=(-0.25, -0.15, -0.25))
    block = wt.Block(lower=(-0.14, -0.15, -0.14), upper=(0.14, 0.05, 0.14))
    sim = wt.Simulation(wt.Scene(spacing=0.025, tank=tank, fluids=[block], solids=solids, foam=0))
    sim.advance(0.1)
    assert np.hypot(*sim.positions[:, [0, 2]].T).max() < 0.18 and sim.count > 500
