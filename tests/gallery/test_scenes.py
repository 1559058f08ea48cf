"""Every bundled scene moves, keeps its water and makes a picture."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.page.about import scenes
from wavetank.scene.scene import bundled_levels
from wavetank.scene.summary import bundled_counts
from wavetank.simulation.simulation import Simulation


def within_tank(sim):
    """Say whether all water is in the tank."""
    lower, upper = np.float32(sim.scene.tank.box())
    return np.all((sim.positions >= lower) & (sim.positions <= upper))


@pytest.mark.parametrize("name", wt.bundled_scenes())
def test_scene_runs_and_shows(name):
    scene = wt.Scene.load(name)
    sim, dry = Simulation(scene), Simulation(scene.changed(fluids=[], emitters=[]))
    count = sim.count
    sim.advance(0.1)
    dry.advance(0.1)
    kept = sim.stats()
    assert sim.count - kept.get("emitted", 0) + kept.get("drained", 0) == count > 400
    assert within_tank(sim)
    assert sim.stats()["density_error_mean"] < 0.01
    image = wt.render(sim, width=192, height=108)
    assert image.shape == (108, 192, 3)
    assert image.std() > 10
    changed = np.abs(image.astype(int) - wt.render(dry, width=192, height=108)).max(axis=2) > 20
    assert 0.005 < changed.mean() < 0.9, "the fluids fill a fair part of the picture"


@pytest.mark.parametrize("name", [*wt.bundled_scenes(), *bundled_levels()])
def test_card_command_line_and_world_count_alike(name):
    """A new scene's count goes into scene/counts.json: {name: number}."""
    assert bundled_counts()[name] == Simulation(wt.Scene.load(name)).count
    assert next(card["count"] for card in scenes() if card["name"] == name) == bundled_counts()[name]


@pytest.mark.parametrize("name", wt.bundled_scenes())
def test_both_presets_hold(name):
    """The report's parameters are softer, but nothing is lost or leaves the tank."""
    sim = Simulation(wt.Scene.load(name).changed(preset="paper"))
    sim.advance(0.1)
    assert np.isfinite(sim.positions).all()
    assert within_tank(sim)
