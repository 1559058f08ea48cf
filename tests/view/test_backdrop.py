"""What lies behind the water, in the light that this leaves of the sun."""

import dataclasses

import numpy as np
import pytest

from wavetank import Camera, Scene, Simulation
from wavetank.view.passes import backdrop
from wavetank.view.renderer import Renderer

SIZE = (160, 96)
EYES = [None, Camera(eye=(-1.0, 1.4, 2.0), target=(0.5, 0.2, 0.3))]


@pytest.mark.parametrize("samples", [1, 2, 3])
@pytest.mark.parametrize("scene", ["dam-break", "oil-and-water"])
def test_moving_water_leaves_no_trace_behind(samples, scene):
    """With an eye that rests only that is found anew from which water takes light, or took: it is as if all were."""
    sim, kept = Simulation(Scene.load(scene).changed(spacing=0.07)), Renderer(*SIZE, samples)
    left = []
    for eye in (None, None, None, EYES[1], EYES[1]):
        sim.advance(0.15)
        kept.render(sim.frame(), eye, view="water")
        fresh = Renderer(*SIZE, samples)
        fresh.render(sim.frame(), eye, view="water")
        shown, anew = (r.buffers.water.backdrop.behind.to_numpy() for r in (kept, fresh))
        np.testing.assert_array_equal(shown, anew)
        left.append((kept.buffers.water.backdrop.known.to_numpy() >> 30 & 1).mean())
    assert left[0] == 0.0 and 0.3 < left[1] < 0.95 and left[3] == 0.0  # what was not found anew


@pytest.mark.parametrize("samples", [1, 2])
@pytest.mark.parametrize("eye", [0, 1])
def test_pixels_together_get_what_each_gets_alone(monkeypatch, samples, eye):
    sim, renderer, light = (
        Simulation(Scene.load("obstacle-tank").changed(spacing=0.06)),
        Renderer(*SIZE, samples),
        backdrop.light_backdrop,
    )
    sim.advance(0.5)
    seen = []
    for alone in (False, True):
        with monkeypatch.context() as patch:
            if alone:
                patch.setattr(
                    backdrop,
                    "light_backdrop",
                    lambda *a: light(*a[:-1], dataclasses.replace(a[-1], lanes=1, rest=True)),
                )
            renderer._stages.forget()
            renderer.render(sim.frame(), EYES[eye], view="water")
            seen.append(renderer.buffers.water.backdrop.behind.to_numpy())
    dimmed = np.abs(
        seen[0] - renderer.buffers.water.backdrop.in_sun.to_numpy() - renderer.buffers.water.backdrop.in_sky.to_numpy()
    )
    assert (dimmed.max(axis=2) > 0.05).mean() > 0.05  # there is a shadow to speak of
    np.testing.assert_allclose(seen[0], seen[1], atol=3e-5)
