"""What counts as unrest: a particle that goes past those around it, and no wave."""

import numpy as np
import pytest

from wavetank.lab.cases import rest
from wavetank.lab.cases.rest import AROUND, fastest_past

D = 0.025


def test_a_wave_is_no_unrest_and_a_thrown_particle_is():
    """A standing wave as long as the tank, 0.1 m/s at most (Lamb 1932, art. 228); then one particle is thrown."""
    x = np.stack(np.meshgrid(*((np.arange(n) + 0.5) * D for n in (56, 14)), indexing="ij"), axis=-1).reshape(-1, 2)
    k = np.pi / 1.4
    v = 0.1 * np.stack(
        [np.sin(k * x[:, 0]) * np.cosh(k * x[:, 1]), -np.cos(k * x[:, 0]) * np.sinh(k * x[:, 1])], axis=1
    )
    v /= np.cosh(k * 14 * D)
    assert np.linalg.norm(v, axis=1).max() > 0.09
    assert fastest_past(x, v, AROUND * D) < 0.014
    v[405, 1] += 0.1
    assert 0.06 < fastest_past(x, v, AROUND * D) < 0.11


def test_a_drop_far_from_all_others_counts_in_full():
    x = np.array([[0.1, 0.1], [0.11, 0.1], [0.1, 0.11], [0.9, 0.9]])
    v = np.array([[0.3, 0.0], [0.3, 0.0], [0.3, 0.0], [0.0, 0.2]])
    assert fastest_past(x, v, 0.1) == 0.2


@pytest.mark.parametrize(("later", "within"), [(3.0, True), (6.7, False)])
def test_what_is_driven_gets_no_faster_with_time(later, within):
    """In its second minute `wave-machine-2d` had water at the speed limit between its paddle and the tank."""
    seen = rest.Rest("sluice", 0.02, driven=True)
    for second in range(1, 121):
        seen.time.append(float(second))
        seen.v_max.append(2.8 if second <= 60 else later)
        seen.past.append(0.1)
    (growth,) = (figure for figure in rest._figures(seen, 120.0) if "second half" in figure.name)
    assert growth.passed is within
