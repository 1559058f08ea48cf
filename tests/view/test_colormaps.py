import numpy as np
import pytest

from wavetank.foundation.errors import WavetankError
from wavetank.view.colormaps import COLORMAPS, ENTRIES, oklab, rgb_of, table, to_linear, to_srgb
from wavetank.view.quantities import QUANTITIES


@pytest.mark.parametrize("name", ["water", "viridis", "ember"])
def test_lightness_of_sequential_maps_only_rises(name):
    lightness = oklab(table(name).astype(float))[:, 0]
    assert (np.diff(lightness) > 0.0).all()
    assert lightness[-1] - lightness[0] > 0.3


def test_diverging_map_is_lightest_in_the_middle_and_even_on_both_sides():
    lightness = oklab(table("balance").astype(float))[:, 0]
    middle = ENTRIES // 2
    assert (np.diff(lightness[:middle]) > 0.0).all()
    assert (np.diff(lightness[middle:]) < 0.0).all()
    assert np.abs(lightness - lightness[::-1]).max() < 0.06


@pytest.mark.parametrize("name", COLORMAPS)
def test_maps_begin_and_end_with_their_colours(name):
    colors = table(name)
    assert colors.shape == (ENTRIES, 3)
    assert colors.min() >= 0.0
    assert colors.max() <= 1.0
    for entry, color in ((0, COLORMAPS[name][0]), (-1, COLORMAPS[name][-1])):
        assert to_srgb(colors[entry]) == pytest.approx(rgb_of(color), abs=2e-3)


def test_srgb_is_undone_by_linear():
    values = np.linspace(0.0, 1.0, 101)
    assert to_srgb(to_linear(values)) == pytest.approx(values, abs=1e-6)
    assert to_linear(np.array(0.5)) == pytest.approx(0.21404, abs=1e-5)


def test_unknown_names_and_colours_are_refused():
    with pytest.raises(WavetankError, match="viridis"):
        table("jet")
    for wrong in ("#12345", "#12345g", "123456", "#1234567"):
        with pytest.raises(WavetankError, match="rrggbb"):
            rgb_of(wrong)


def test_every_quantity_has_a_known_map():
    assert {quantity.colormap for quantity in QUANTITIES.values()} <= set(COLORMAPS)
