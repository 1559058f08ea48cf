import pytest

from wavetank.solids.meshes import store


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """An empty cache folder, and nothing in memory."""
    monkeypatch.setenv("WAVETANK_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(store, "_grids", {})
    return tmp_path / "cache" / "meshes"
