"""What a scene may say of axes that repeat."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.scene.scene import Scene


def scene(size=(1.0, 0.6), periodic=("x",), **changes):
    return wt.Scene(**{"spacing": 0.02, "tank": wt.Tank(size=size, periodic=[*periodic]), **changes})


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: wt.Tank(size=(1, 1), periodic=["z"]), "names the axis z, which a 2-D world does not have"),
        (lambda: wt.Tank(size=(1, 1), periodic=["x", "x"]), "names an axis twice"),
        (lambda: wt.Tank(size=(1, 1), periodic=["x"], open=["+x"]), "leaves out a wall along x"),
        (lambda: wt.Tank(size=(1, 1), periodic=["y"], open=["top"]), "leaves out a wall along y"),
        (lambda: wt.Tank(size=(1, 1), periodic=["w"]), "periodic"),
        (lambda: scene(size=(0.15, 1)), r"0.15 m long along x, which is periodic; it must be at least 0.152 m"),
        (lambda: scene(periodic=["y"]), "water would fall along y without end"),
        (lambda: scene(gravity=(9.0, -3.0)), "water would fall along x without end"),
        (
            lambda: scene(solids=[wt.Sphere(name="ball", center=(0.5, 0.3), radius=0.1, density=500)]),
            "'ball' is a body, whose contacts do not reach over a seam",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_sentence(wrong, said):
    with pytest.raises(wt.WavetankError, match=said) as report:
        wrong()
    assert "\n" not in str(report.value)


def test_gravity_along_a_periodic_axis_is_refused_later_too():
    sim = wt.Simulation(scene(gravity=(0, 0), periodic=["y"]))
    with pytest.raises(wt.WavetankError, match="without end"):
        sim.gravity = (0, -9.81)
    assert sim.gravity == (0, 0)


def test_a_periodic_axis_has_no_walls():
    names = [wall.name for wall in wt.Tank(size=(1, 1, 1), periodic=["z", "x"]).walls()]
    assert names == ["tank y lower", "tank y upper"]
    assert not wt.Tank(size=(1, 1), periodic=["x", "y"]).walls()


def test_a_scene_says_it_in_its_file_and_reads_it_back(tmp_path):
    scene().save(tmp_path / "a.toml")
    assert 'periodic = [\n    "x",\n]' in (tmp_path / "a.toml").read_text()
    again = Scene.load(tmp_path / "a.toml")
    assert again == scene()
    assert again.scaled(2.0).tank.periodic == ["x"]


def test_other_worlds_are_written_as_they_were():
    """Digests of what does not repeat are those of versions before there was such a thing."""
    assert "periodic" not in wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1))).model_dump_json()
    assert '"periodic":["x"]' in scene().model_dump_json()


def test_a_block_from_end_to_end_has_even_rows_across_the_seam():
    x, _ = scene(size=(1.01, 0.6), fluids=[wt.Block(lower=(0, 0), upper=(1.01, 0.1))]).particles()
    row = np.sort(x[x[:, 1] < 0.02][:, 0])
    assert len(row) == 50
    np.testing.assert_allclose(np.diff([*row, row[0] + 1.01]), 1.01 / 50, rtol=1e-5)
    # One that ends before keeps its spacing.
    x, _ = scene(size=(1.01, 0.6), fluids=[wt.Block(lower=(0, 0), upper=(0.8, 0.1))]).particles()
    assert np.diff(np.unique(x[:, 0])) == pytest.approx(0.02, rel=1e-4)
