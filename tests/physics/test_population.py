"""What happens to each array of particles: no new one is forgotten where particles are sorted, made or moved."""

import dataclasses

import numpy as np
import pytest

from wavetank.device import compiler
from wavetank.device.compiler import download, upload
from wavetank.device.state import KINDS, LASTING, Diffuse, Particles, bubble, foam, new_particles, spray, with_viscosity
from wavetank.physics.foam.pool import ROWS
from wavetank.physics.neighbors import new_grid
from wavetank.physics.population import append, at_capacity
from wavetank.physics.sorting import sort_particles

NAMES = tuple(field.name for field in dataclasses.fields(Particles))
COUNT = 5


def particles(dim: int, capacity: int = 2 * COUNT) -> Particles:
    """Particles of which every array has numbers of its own."""
    made = with_viscosity(new_particles(dim, capacity))
    for k, name in enumerate(NAMES):
        array = getattr(made, name)
        rows = np.arange(100 * k + 1, 100 * k + 1 + array.shape[0])
        width = getattr(array, "element_shape", ())
        upload(array, np.multiply.outer(rows, np.arange(1, 1 + width[0])) if width else rows)
    return made


def used(dim: int) -> tuple[str, ...]:
    return tuple(name for name in NAMES if dim == 3 or name != "pz")


@pytest.mark.parametrize("dim", [2, 3])
def test_every_array_is_sorted(dim):
    compiler.start("cpu")
    now, spare = particles(dim), with_viscosity(new_particles(dim, 2 * COUNT))
    grid = new_grid(dim, 2 * COUNT, (1.0,) * dim, 0.1, 32)
    upload(grid.cell, [3, 1, 4, 0, 2])
    sort_particles(now, spare, grid, COUNT)
    for name in used(dim):
        before, after = (download(getattr(each, name))[:COUNT] for each in (now, spare))
        np.testing.assert_array_equal(after, before[[3, 1, 4, 0, 2]], err_msg=name)


@pytest.mark.parametrize("dim", [2, 3])
def test_every_array_but_predictions_is_written_for_new_particles(dim):
    compiler.start("cpu")
    now = particles(dim)
    x, v = np.full((2, dim), 0.25, np.float32), np.full((2, dim), -1.5, np.float32)
    append(now, COUNT, x, v, np.array([7, 8]), np.array([1, 2]), 40)
    found = {name: download(getattr(now, name))[COUNT : COUNT + 2].tolist() for name in NAMES}
    given = {"x": x.tolist(), "v": v.tolist(), "dye": [7, 8], "material": [1, 2], "id": [40, 41]}
    none = {"a": np.zeros((2, dim)).tolist(), "viscous": np.zeros((2, dim)).tolist(), "near": [0, 0], "frozen": [0, 0]}
    assert {name: found[name] for name in NAMES if name not in ("px", "py", "pz")} == given | none


def test_what_lasts_moves_to_larger_arrays():
    compiler.start("cpu")
    now = particles(3)
    larger = at_capacity(now, 3, 3 * COUNT)
    for name in (*LASTING, "viscous"):
        before, after = (download(getattr(each, name))[:COUNT] for each in (now, larger))
        np.testing.assert_array_equal(after, before, err_msg=name)
    assert {*LASTING} | {"px", "py", "pz", "near", "viscous"} == {*NAMES}, "what is new lasts, or follows from the rest"


def test_all_of_foam_is_saved_and_kinds_have_their_numbers():
    assert {*ROWS.values()} == {field.name for field in dataclasses.fields(Diffuse)}
    assert [KINDS[kind.fn()] for kind in (spray, foam, bubble)] == ["spray", "foam", "bubble"]
