"""The neighbour search beside a k-d tree."""

import numpy as np
import pytest

from wavetank.foundation.errors import WavetankError
from wavetank.lab.bench.run import Order, perform
from wavetank.lab.bench.search import SPACING, places, search, search_table


def test_grid_and_tree_find_the_same_pairs():
    result = search([3000], repeats=1)
    assert [row["layout"] for row in result["search"]] == ["block", "sheet"]
    for row in result["search"]:
        assert 2500 < row["particles"] < 3600
        assert row["pairs"] > 5 * row["particles"]
        assert row["pairs"] == pytest.approx(row["tree_pairs"], rel=1e-4)  # a pair at h to the last digit may differ
        assert row["grid_seconds"] > 0 < row["tree_seconds"]
    assert search_table(result).row_count == 2


def test_a_sheet_takes_much_room_and_a_block_none():
    block, sheet = (np.ptp(places(4000, layout), axis=0) / SPACING for layout in ("block", "sheet"))
    assert block.prod() < 5000
    assert sheet.prod() > 50 * 4000


@pytest.mark.parametrize(
    ("scenes", "sizes", "said"), [(["drop"], "", "no scene"), ([], "10", "1,000"), ([], "x", "whole")]
)
def test_a_wrong_order_says_what_is_allowed(scenes, sizes, said):
    order = Order(
        scenes=scenes,
        sizes=sizes,
        seconds=None,
        repeats=1,
        threads=None,
        roofline=False,
        search=True,
        bodies=False,
        start_up=False,
        compare=None,
        arch="cpu",
    )
    with pytest.raises(WavetankError, match=said):
        perform(order, print)
