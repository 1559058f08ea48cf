"""Where solids are reaches the device alike: array by array, and as one table that a kernel deals out."""

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.simulation.simulation import Simulation
from wavetank.solids import placing


@pytest.mark.parametrize("shares", [True, False])
def test_each_array_has_its_columns(monkeypatch, shares):
    monkeypatch.setattr(placing, "shares_memory", lambda: shares)
    tank = wt.Tank(size=(1.0, 0.5, 0.5))
    sim = Simulation(wt.Scene(spacing=0.1, tank=tank, solids=[wt.Box(center=(0.5, 0.2, 0.2), size=(0.2, 0.1, 0.1))]))
    device, count = sim.solids.device, len(sim.solids.members)
    numbers = np.random.default_rng(1)
    rows = {name: numbers.normal(size=(count, width)).astype(np.float32) for name, width in placing.PLACED.items()}
    rows["plane"] = rows["plane"][: sim.solids.tank_count]
    placing.Placing(device, count).write(*rows.values())
    for name, expected in rows.items():
        found = download(getattr(device, name))[:count]
        np.testing.assert_array_equal(found[: len(expected)], expected, err_msg=name)
        assert not found[len(expected) :].any()
