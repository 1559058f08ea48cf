"""Solids as pictures have them."""

import numpy as np
from scipy.ndimage import map_coordinates

from wavetank.device.compiler import download, qd, upload
from wavetank.view.rounding import rounded

EDGE, ACROSS = np.array([0.90, 0.37, 0.23]), np.array([0.2, 0.1, -0.9])


def wedge(points):
    """Distance [cells] to a quarter of space whose edge runs aslant to the axes."""
    along = EDGE / np.linalg.norm(EDGE)
    u = np.cross(along, ACROSS)
    u /= np.linalg.norm(u)
    a, b = points @ u, points @ np.cross(along, u)
    return np.where((a > 0) & (b > 0), np.hypot(a, b), np.maximum(a, b))


def test_an_edge_aslant_to_its_grid_has_no_teeth(cpu):
    """Trilinear distances along an edge differ from cell to cell: that is how high its teeth are."""
    nodes = np.moveaxis(np.mgrid[-12:13, -12:13, -12:13], 0, -1)[..., ::-1].reshape(-1, 3).astype(float)
    given = wedge(nodes)
    samples = qd.ndarray(qd.f32, shape=(1 + len(nodes),))
    upload(samples, np.concatenate([[1.0], given]).astype(np.float32))
    found = download(rounded(samples, [[0, 25, 25, 25]]))[1:]
    places = np.linspace(-10.0, 10.0, 401)[:, None] * EDGE / np.linalg.norm(EDGE)
    sharp, round_ = (
        map_coordinates(field.reshape(25, 25, 25), places[:, ::-1].T + 12.0, order=1) for field in (given, found)
    )
    assert sharp.std() > 0.05
    assert round_.std() < 0.5 * sharp.std()
    assert abs(round_.mean()) < 0.6
    far = np.linalg.norm(np.cross(nodes, EDGE), axis=1) > 3.0 * np.linalg.norm(EDGE)
    faces = far & (np.abs(given) < 1.0) & (np.abs(nodes).max(axis=1) < 12)
    assert faces.sum() > 100
    assert np.abs(found - given)[faces].max() < 0.02
