"""Icons: paths become lines that end where they should."""

import math

import pytest

from wavetank.page.window.icons import lines
from wavetank.session.tools import TOOLS


def test_lines_curves_and_arcs_end_where_they_say():
    assert lines("M1 2h3v4l-1-1z") == (((1, 2), (4, 2), (4, 6), (3, 5), (1, 2)),)
    (curve,) = lines("M0 0c0 4 4 4 4 0s4-4 4 0")
    assert curve[10] == pytest.approx((4, 0)) and curve[-1] == pytest.approx((8, 0))
    assert curve[5] == pytest.approx((2, 3)) and curve[15] == pytest.approx((6, -3))


def test_an_arc_is_a_circle_and_goes_the_way_its_flags_say():
    (arc,) = lines("M9 6a3 3 0 0 1 6 0")
    assert all(math.dist(point, (12, 6)) == pytest.approx(3) for point in arc)
    assert min(y for _, y in arc) == pytest.approx(3), "sweep 1 turns with the clock: over the top"
    (other,) = lines("M9 6a3 3 0 0 0 6 0")
    assert max(y for _, y in other) == pytest.approx(9)
    (large,) = lines("M12 9a3 3 0 1 1 3 3")
    assert len(large) > len(lines("M12 9a3 3 0 0 1 3 3")[0])


@pytest.mark.parametrize("tool", TOOLS, ids=lambda tool: tool.name)
def test_every_tool_has_an_icon_inside_its_square(tool):
    points = [point for line in lines(tool.icon) for point in line]
    assert len(points) > 4 and all(-0.5 <= part <= 24.5 for point in points for part in point)
