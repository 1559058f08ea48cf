"""High scores: the best is kept, in the user's folder, whole or not at all."""

import json

import pytest

import wavetank as wt
from wavetank.scene.scene import bundled_levels
from wavetank.session.scores import keep_score, key_of, scores


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("WAVETANK_DATA", str(tmp_path / "data"))
    return tmp_path / "data"


def test_the_best_is_kept(folder):
    assert scores() == {}
    assert keep_score("spill", 2, 9.5)
    assert not keep_score("spill", 1, 3.0)
    assert not keep_score("spill", 2, 9.5)
    assert keep_score("spill", 2, 9.0)
    assert keep_score("spill", 3, 20.0)
    assert keep_score("surf", 1, 4.0)
    assert scores() == {"spill": {"stars": 3, "mark": 20.0}, "surf": {"stars": 1, "mark": 4.0}}
    assert [path.name for path in folder.iterdir()] == ["scores.json"]


@pytest.mark.parametrize(
    "text", ["", "[]", "{", '{"spill": 3}', '{"spill": {"stars": 9, "mark": 1}}', '{"spill": {"stars": []}}']
)
def test_a_broken_file_counts_as_none(folder, text):
    folder.mkdir()
    (folder / "scores.json").write_text(text)
    assert scores() == {}
    assert keep_score("spill", 1, 5.0)
    assert json.loads((folder / "scores.json").read_text()) == {"spill": {"stars": 1, "mark": 5.0}}


def test_a_changed_level_is_another_one():
    level = wt.Scene.load("spill")
    assert key_of(level) == "spill"
    assert key_of(level.changed(viscosity=0.5)) != "spill"
    assert len({key_of(wt.Scene.load(name)) for name in bundled_levels()}) == len(bundled_levels())
