"""The benchmark of the page: its figures come out of a real browser; none of them is judged here."""

import os

import pytest

from benchmarks.browser import page
from benchmarks.browser.chromium import executable


def test_pictures_and_delays_are_counted(monkeypatch):
    if executable() is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no Chromium here; .ci/run installs it with apt-get")
        pytest.skip("no Chromium here: apt-get install chromium")
    monkeypatch.setattr(page, "CLICKS", 2)
    result = page.measure("drop-2d", 300, seconds=1.0, say=print)
    assert 200 < result["particles"] < 450
    assert abs(result["stage"][0] - 960) <= 12
    assert result["stage"][1] == 540
    for state in ("paused", "moving"):
        assert result[state]["pictures_per_second"] > 0.5
        assert 0.3 < result[state]["sharpness"] <= 1.01
    assert result["moving"]["water_per_second"] > 0.0
    assert result["clicks"] == 2
    assert 1.0 < result["click_ms"]["median"] < 10_000.0
    assert page.page_table(result).row_count == 3
