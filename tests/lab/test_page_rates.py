"""`wavetank bench --page`: its figures come out of a real browser; none of them is judged here."""

import os

import pytest

from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench import page
from wavetank.lab.bench.chromium import executable
from wavetank.lab.bench.run import Order, perform


def order(**options) -> Order:
    return Order(
        **{
            "scenes": [],
            "sizes": "",
            "seconds": None,
            "repeats": 1,
            "threads": None,
            "peers": False,
            "their_scenes": False,
            "pictures": None,
            "roofline": False,
            "search": False,
            "bodies": False,
            "page": True,
            "start_up": False,
            "compare": None,
            "arch": "cpu",
            **options,
        }
    )


def test_pictures_and_delays_are_counted(monkeypatch):
    if executable() is None:
        if os.environ.get("CI") == "true":
            pytest.fail("no Chromium here; .ci/run installs it with apt-get")
        pytest.skip("no Chromium here: apt-get install chromium")
    monkeypatch.setattr(page, "CLICKS", 2)
    result, tables = perform(order(scenes=["drop-2d"], sizes="300", seconds=1.0), print)
    assert 200 < result["particles"] < 450
    assert abs(result["stage"][0] - 960) <= 12
    assert result["stage"][1] == 540
    for state in ("paused", "moving"):
        assert result[state]["pictures_per_second"] > 0.5
        assert 0.3 < result[state]["sharpness"] <= 1.01
    assert result["moving"]["water_per_second"] > 0.0
    assert result["clicks"] == 2
    assert 1.0 < result["click_ms"]["median"] < 10_000.0
    assert tables[0].row_count == 3


@pytest.mark.parametrize("wrong", [{"scenes": ["drop", "knot"]}, {"sizes": "1,2"}, {"threads": 2}, {"search": True}])
def test_a_wrong_order_says_what_is_allowed(wrong):
    with pytest.raises(WavetankError, match="one"):
        perform(order(**wrong), print)
