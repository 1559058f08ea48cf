"""Ice is seen as ice where particles are drawn, and in the water; the exporters' dyes are left alone."""

import numpy as np
import pytest

import wavetank as wt


@pytest.mark.parametrize("view", ["particles", "water", "slice", "foam"])
def test_ice_is_seen(view):
    scene = wt.Scene(
        spacing=0.05, tank=wt.Tank(size=(1.0, 0.6, 0.5)), fluids=[wt.Block(lower=(0, 0, 0), upper=(1, 0.3, 0.5))]
    )
    sim = wt.Simulation(scene)
    clear = wt.render(sim, 160, 120, view=view, supersample=1).astype(int)
    middle = np.array([0.5, 0.3, 0.25])
    sim.freeze_inside(middle, middle, 0.15)
    frozen = wt.render(sim, 160, 120, view=view, supersample=1).astype(int)
    changed = np.abs(frozen - clear).max(axis=2) > (12 if view == "water" else 40)
    assert 60 < changed.sum() < 0.3 * changed.size
    if view in ("particles", "slice"):
        assert frozen[changed].mean() > clear[changed].mean() + 40, "white"
    assert not sim.frame().dyes.any()
    sim.freeze_inside(middle, middle, 0.3, False)
    melted = wt.render(sim, 160, 120, view=view, supersample=1).astype(int)
    assert np.abs(melted - clear).mean() < 1.0
