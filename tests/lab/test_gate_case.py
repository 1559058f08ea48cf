"""What `torricelli` and `gate` compare with."""

import math

import numpy as np
import pytest

from wavetank.lab.cases import gate, torricelli


def test_the_coefficient_is_read_from_a_fall_by_torricelli():
    times = np.linspace(0.0, 6.0, 61)
    depths = (math.sqrt(torricelli.DEEP) - 0.5 * 0.5 * math.sqrt(2.0) / torricelli.WIDE * times) ** 2
    assert torricelli.coefficient(times, depths) == pytest.approx(0.5)


def test_the_gate_stands_where_the_water_ends():
    world = gate.scene(2, 0.02, 2.0, 0.25)
    box = world.solids[0]
    assert box.center[0] - 0.5 * box.size[0] == pytest.approx(gate.LONG - gate.BEHIND + 0.005)
    assert world.particles()[0][:, 0].max() < gate.LONG - gate.BEHIND
