import json

import pytest

from wavetank.cli import experiments
from wavetank.foundation.errors import WavetankError
from wavetank.lab import backends


def test_two_sides_that_are_the_same_differ_in_nothing(capsys, monkeypatch):
    """Both are processes of their own; `--compare vulkan` does the same, and needs a driver."""
    monkeypatch.setattr(backends.compare, "__defaults__", (("particles",), 0.05))
    experiments._compare_backends("cpu", as_json=True)
    result = json.loads(capsys.readouterr().out)
    assert result["particles"] == 5184
    assert result["views"] == {"particles": {"close": 1.0, "largest": 0}}
    for name, (ours, theirs) in {**result["figures"], "height": result["height"]}.items():
        assert ours == theirs > 0.0, name
    monkeypatch.setattr(backends, "compare", lambda arch: result)
    experiments._compare_backends("cpu", as_json=False)
    table = capsys.readouterr().out
    assert "100.000 %" in table
    assert all(name in table for name in result["figures"])


def test_a_side_that_fails_is_one_sentence():
    with pytest.raises(WavetankError, match="side of nonsense failed: arch = 'nonsense' is not a back end"):
        backends.compare("nonsense", ("particles",), 0.0)


def test_a_pixel_that_differs_is_seen():
    a = backends.np.zeros((4, 5, 3), "uint8")
    b = a.copy()
    b[1, 2, 0] = 7
    assert backends._difference(a, b) == {"close": 19 / 20, "largest": 7}
