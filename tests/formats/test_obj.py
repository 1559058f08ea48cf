import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank import cli
from wavetank.formats.obj import write_obj
from wavetank.foundation.materials import Material
from wavetank.solids.meshes.files import read_file

D = 0.05


@pytest.fixture(scope="module")
def pool() -> wt.Simulation:
    """Two fluids side by side in a tank, each a block of 8 x 6 x 8 particles against three walls."""
    blocks = [
        wt.Block(lower=(0.4 * k, 0.0, 0.0), upper=(0.4 * k + 0.4, 0.3, 0.4), material=name)
        for k, name in enumerate(("water", "light oil"))
    ]
    materials = [Material(name="water"), Material(name="light oil", density=900.0)]
    tank = wt.Tank(size=(0.8, 0.6, 0.4))
    return wt.Simulation(wt.Scene(spacing=D, tank=tank, materials=materials, fluids=blocks))


def test_a_surface_is_closed_lies_in_the_tank_and_holds_the_water(pool, tmp_path):
    write_obj(tmp_path / "a.obj", pool.frame())
    read_file(tmp_path / "a.obj")  # as a solid, for which it must be closed
    lines = [line.split() for line in (tmp_path / "a.obj").read_text().splitlines()]
    vertices = np.array([line[1:] for line in lines if line[0] == "v"], float)
    faces = np.array([[corner.split("//")[0] for corner in line[1:]] for line in lines if line[0] == "f"], int) - 1
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.sum(np.cross(a, b) * c) / 6.0  # positive where triangles run round the outside (divergence theorem)
    assert volume == pytest.approx(pool.count * D**3, rel=0.02)
    assert (vertices >= 0.0).all()
    assert (vertices <= (0.8, 0.6, 0.4)).all()
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_each_fluid_is_an_object_of_its_name(pool, tmp_path):
    write_obj(tmp_path / "a.obj", pool.frame())
    lines = (tmp_path / "a.obj").read_text().splitlines()
    assert [line for line in lines if line.startswith("o ")] == ["o water", "o light_oil"]
    assert sum(line.startswith("v ") for line in lines) == sum(line.startswith("vn ") for line in lines)
    normals = np.array([line.split()[1:] for line in lines if line.startswith("vn ")], float)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=2e-3)


def test_worlds_without_a_surface_and_without_the_package_are_told_before_anything_is_written(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.setitem(sys.modules, "pysplashsurf", None)
    for name, words in (("drop-2d", "2-D world has no surface"), ("drop", "pip install 'wavetank[surface]'")):
        options = ["--export", "obj", "--seconds", "0", "--out", str(tmp_path / "out")]
        monkeypatch.setattr("sys.argv", ["wavetank", "run", name, *options])
        with pytest.raises(SystemExit) as end:
            cli.main()
        assert end.value.code == 1
        assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
