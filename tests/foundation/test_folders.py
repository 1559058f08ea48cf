"""Where files of a user are: where the system says, and where they were before."""

from pathlib import Path

import pytest

from wavetank.foundation.folders import cache_folder, data_folder


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path) -> Path:
    for name in ("WAVETANK_DATA", "WAVETANK_CACHE", "XDG_DATA_HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


def test_the_folders_are_the_users(monkeypatch, home):
    assert data_folder() == home / ".local" / "share" / "wavetank"
    assert cache_folder() == home / ".cache" / "wavetank"
    monkeypatch.setenv("XDG_DATA_HOME", str(home / "data"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(home / "cache"))
    assert (data_folder(), cache_folder()) == (home / "data" / "wavetank", home / "cache" / "wavetank")
    monkeypatch.setenv("XDG_DATA_HOME", "relative")
    assert data_folder().parts[-3:] == (".local", "share", "wavetank")
    monkeypatch.setenv("WAVETANK_DATA", "/here")
    monkeypatch.setenv("WAVETANK_CACHE", "/there")
    assert (data_folder(), cache_folder()) == (Path("/here"), Path("/there"))


def test_files_stay_where_they_were(home):
    """Earlier versions kept them in one place on macOS; scores that are there are not lost."""
    earlier = home / "Library" / "Application Support" / "wavetank"
    earlier.mkdir(parents=True)
    assert data_folder() == earlier
    (home / ".local" / "share" / "wavetank").mkdir(parents=True)
    assert data_folder() == home / ".local" / "share" / "wavetank"


def test_asking_makes_no_folder(home):
    data_folder(), cache_folder()
    assert [*home.iterdir()] == []
