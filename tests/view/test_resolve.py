"""Pixels are shaded once where all of their samples show the same, and nobody can tell."""

import dataclasses

import numpy as np
import pytest
from test_drops import ABOVE, SIZE, pool

from wavetank import Camera, Scene, Simulation
from wavetank.view.passes import water
from wavetank.view.renderer import Renderer

BESIDE = Camera(eye=(0.5, 0.7, 3.0), target=(0.5, 0.3, 0.5))


@pytest.fixture
def both(monkeypatch):
    """Pictures of 2 x 2 samples, as they are, and with every sample shaded and the ray of every pixel followed."""

    def pictures(frame, camera=None, **style):
        renderer, shade, optics_of = Renderer(*SIZE, 2), water.shade_water, water.optics_of
        shown = renderer.render(frame, camera, view="water", legend=False, **style).astype(int)
        with monkeypatch.context() as patch:
            patch.setattr(
                water,
                "shade_water",
                lambda *known: shade(*known[:-1], dataclasses.replace(known[-1], supersampled=False)),
            )
            patch.setattr(water, "optics_of", lambda *known: dataclasses.replace(optics_of(*known), apart=0.0))
            resolved = renderer.render(frame, camera, view="water", legend=False, **style).astype(int)
        return shown, resolved

    return pictures


@pytest.mark.parametrize("scene", ["above", "beside", "breaking"])
def test_what_is_shaded_once_looks_as_if_it_were_resolved(both, scene):
    """Few pixels differ, by little, and the mean of the picture by next to nothing; but something was shaded once."""
    camera, frames = {"above": ABOVE, "beside": BESIDE}.get(scene), [pool((0.5, 0.9, 0.5))]
    if scene == "breaking":
        sim = Simulation(Scene.load("obstacle-tank").changed(spacing=0.05))
        frames = []
        for seconds in (0.4, 0.2, 0.2):
            sim.advance(seconds)
            frames.append(sim.frame())
    pairs = [both(frame, camera) for frame in frames]
    shown, resolved = (np.concatenate(pictures) for pictures in zip(*pairs, strict=True))
    change = np.abs(shown - resolved).max(axis=2)
    assert 0.1 < change.mean() < 1.5
    assert np.percentile(change, 99) < 14 and (change > 20).mean() < 0.006
    assert np.abs(shown.mean(axis=(0, 1)) - resolved.mean(axis=(0, 1))).max() < 0.12
