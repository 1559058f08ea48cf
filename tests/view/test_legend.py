import numpy as np
import pytest

from wavetank.view.colormaps import table, to_srgb
from wavetank.view.legend import draw_bar, draw_scale, ticks, write_time


@pytest.mark.parametrize("limits", [(0.0, 3.0), (950.0, 1050.0), (-1e-6, 3e-6), (0.0, 7e8), (-13.0, -2.0)])
def test_ticks_are_few_round_and_inside(limits):
    values = ticks(*limits)
    assert 2 <= len(values) <= 6
    assert limits[0] - 1e-9 * abs(limits[0]) <= values[0]
    assert values[-1] <= limits[1] * (1 + 1e-9) or limits[1] < 0
    assert all(len(f"{value:g}") <= 8 for value in values)
    assert np.ptp(np.diff(values)) < 1e-6 * (limits[1] - limits[0])


def test_the_bar_shows_the_map_from_left_to_right():
    picture = np.full((240, 320, 3), 200, np.uint8)
    draw_bar(picture, table("viridis"), (0.0, 1.0), "speed [m/s]")
    colors = (255 * to_srgb(table("viridis")) + 0.5).astype(int)
    rows = [row for row in range(240) if (np.abs(picture[row].astype(int) - colors[0]).sum(axis=1) < 4).any()]
    row = picture[rows[len(rows) // 2]].astype(int)
    first = np.argmin(np.abs(row - colors[0]).sum(axis=1))
    last = np.argmin(np.abs(row - colors[-1]).sum(axis=1))
    assert last - first > 60
    assert np.abs(row[(first + last) // 2] - colors[128]).max() < 12


def test_texts_are_written_where_there_is_room():
    large, small = np.full((240, 640, 3), 90, np.uint8), np.full((100, 150, 3), 90, np.uint8)
    for picture in (large, small):
        draw_bar(picture, table("water"), (0.0, 1.0), "speed")
        write_time(picture, 1.25, 1_000_000)
        draw_scale(picture, 100.0)
    assert (large != 90).any()
    assert (small == 90).all()


def test_the_scale_is_as_long_as_it_says():
    picture = np.full((240, 640, 3), 255, np.uint8)
    draw_scale(picture, 200.0)  # 3.2 m of world
    dark = (picture.sum(axis=2) < 300).sum(axis=1).max()
    assert dark == pytest.approx(50, abs=2)  # a quarter of a metre
