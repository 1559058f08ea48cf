import numpy as np
import pytest
from scipy import integrate

import wavetank as wt
from wavetank.device.compiler import qd
from wavetank.physics import smoothing
from wavetank.physics.coefficients import coefficients, relaxations
from wavetank.physics.smoothing import KERNELS, NAMES, SLOPES, kernel_shape, rest_lattice, sigma

SINGLE = [name for name, (a, b) in NAMES.items() if a == b]


@qd.kernel
def evaluate(q: qd.types.ndarray(), out: qd.types.ndarray(), method: qd.template()):
    for i in range(q.shape[0]):
        pair = smoothing.kernel(method, q[i] * q[i])
        out[i] = qd.Vector([pair[0], pair[1] * q[i]])


def on_device(name: str, q: np.ndarray) -> np.ndarray:
    """(w, w') at `q`; a kernel gives w' over q and its factor in SLOPES."""
    points, pairs = qd.ndarray(qd.f32, shape=(len(q),)), qd.ndarray(qd.types.vector(2, qd.f32), shape=(len(q),))
    points.from_numpy(q.astype(np.float32))
    evaluate(points, pairs, list(NAMES).index(name))
    return pairs.to_numpy() * np.array([1.0, SLOPES[NAMES[name][1]]], np.float32)


def shell(q: np.ndarray, dim: int) -> np.ndarray:
    return 2 * np.pi * q if dim == 2 else 4 * np.pi * q**2


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", SINGLE)
def test_integral_is_one(name, dim):
    total, _ = integrate.quad(
        lambda q: sigma(name, dim) * kernel_shape(name, np.array(q))[0] * shell(q, dim), 0, 1, points=[0.5]
    )
    assert total == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", SINGLE)
def test_integral_of_the_device_kernel_is_one(name, dim):
    nodes, weights = np.polynomial.legendre.leggauss(32)
    q = np.concatenate([0.25 * (nodes + 1), 0.5 + 0.25 * (nodes + 1)])
    w = np.concatenate([weights, weights]) * 0.25
    values = on_device(name, q)[:, 0].astype(np.float64)
    assert sigma(name, dim) * np.sum(w * values * shell(q, dim)) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize("name", SINGLE)
def test_gradient_is_the_central_difference(name):
    q, step = np.linspace(0.02, 0.98, 97), 1e-5
    w, slope = kernel_shape(name, q)
    difference = (kernel_shape(name, q + step)[0] - kernel_shape(name, q - step)[0]) / (2 * step)
    np.testing.assert_allclose(slope, difference, atol=1e-6 * np.abs(slope).max() + 1e-9)
    np.testing.assert_allclose(on_device(name, q), np.stack([w, slope], 1), atol=1e-5 * np.abs(slope).max())


@pytest.mark.parametrize("number", range(len(KERNELS)))
def test_nothing_beyond_the_support(number):
    assert np.all(on_device(list(NAMES)[number], np.array([1.0, 1.5, 40.0])) == 0.0)


def density(name: str, dim: int, ratio: float) -> float:
    """Density of the rest lattice in units of m / d^dim, 1 for a perfect kernel: sigma (h = d) times the sum of w."""
    return sigma(name, dim) / ratio**dim / rest_lattice(name, dim, ratio).density_scale


def test_lattice_densities():
    """Poly6 over the unit lattice at h / d = 2, in units of m / d^dim."""
    assert density("poly6", 3, 2.0) == pytest.approx(1.00978, abs=1e-5)
    assert density("poly6", 2, 2.0) == pytest.approx(1.01461, abs=1e-5)
    assert density("spiky", 3, 2.0) == pytest.approx(1.2359, abs=1e-4)


def test_the_reports_units():
    """With h = 1.1, m = 1 the lattice of density 3 has d = 0.682, and eps = 100 is 73.5 times S_0."""
    from wavetank.foundation.params import PAPER_S0, PAPER_SPACING, PRESETS

    ratio = 1.1 / PAPER_SPACING
    assert density("poly6", 3, ratio) / PAPER_SPACING**3 == pytest.approx(3.0, abs=1e-4)
    s_0 = rest_lattice("poly6-spiky", 3, ratio).squared_gradients / 1.1**2
    assert s_0 == pytest.approx(PAPER_S0, rel=1e-5)
    assert PRESETS["paper"]["force_mixing"] * s_0 == pytest.approx(100.0, rel=1e-5)
    paper = wt.Scene(spacing=PAPER_SPACING, preset="paper", rest_density=3.0)
    assert relaxations(paper) == [(pytest.approx(1.0, rel=1e-3), 0.0)] * 5
    c = coefficients(paper, 1 / 60)
    assert c.h == pytest.approx(1.1)
    assert c.eps == pytest.approx(100.0, rel=1e-4)
    assert paper.particle_mass == pytest.approx(1.0, rel=0.06)  # 3 d^3; m = 1 divided by the lattice sum
    assert c.density_scale * sigma("spiky", 3) / sigma("poly6", 3) == pytest.approx(
        rest_lattice("poly6-spiky", 3, ratio).gradient_scale
    )


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("name", list(NAMES))
@pytest.mark.parametrize("ratio", [1.6, 2.0, 2.5])
def test_a_wall_completes_the_rest_lattice(name, dim, ratio):
    """Half a spacing from a wall, water at rest reads rho_0: lattice on one side, half-space table on the other."""
    points = smoothing._lattice(dim, ratio)
    w, _ = kernel_shape(NAMES[name][0], np.linalg.norm(points, axis=1))
    here = points[:, 0] > -0.25 / ratio
    scale = rest_lattice(name, dim, ratio).density_scale
    half = scale * (w[here].sum() + kernel_shape(NAMES[name][0], np.zeros(1))[0][0])
    share = smoothing.half_space(name, dim, ratio, np.array([0.5 / ratio]))[0]
    assert half + share == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_half_space_integral(dim):
    assert smoothing.half_space_integral("poly6", dim, 0.0) == pytest.approx(0.5, abs=1e-9)
    assert smoothing.half_space_integral("poly6", dim, -1.0) == pytest.approx(1.0)
    assert smoothing.half_space_integral("poly6", dim, 0.999) == pytest.approx(0.0, abs=1e-6)


def test_spiky_half_space_closed_form():
    """I(s) of Spiky in 3-D, with tau = h - s: 30/h^6 (h tau^5 / 20 - tau^6 / 30)."""
    for s in (0.1, 0.4, 0.8):
        tau = 1.0 - s
        assert smoothing.half_space_integral("spiky", 3, s) == pytest.approx(30 * (tau**5 / 20 - tau**6 / 30), rel=1e-9)


@pytest.mark.parametrize("name", ["spiky", "cubic", "poly6-spiky"])
@pytest.mark.parametrize("ratio", [1.6, 2.0, 2.5])
def test_stiffest_mode_bounds_every_plane_wave(name, ratio):
    """Eigenvalue of D^-1 grad C grad C^T for exp(i k x) on the lattice: |sum_j g_j sin(k r_j)|^2 / sum_j |g_j|^2."""
    points = smoothing._lattice(3, ratio)
    distance = np.linalg.norm(points, axis=1)
    g = (kernel_shape(NAMES[name][1], distance)[1] / distance)[:, None] * points
    k = np.random.default_rng(0).uniform(-np.pi, np.pi, (5000, 3)) * ratio
    values = np.sum((np.sin(k @ points.T) @ g) ** 2, axis=1) / np.sum(g**2)
    stiffest = rest_lattice(name, 3, ratio).stiffest_mode
    assert 0.97 * stiffest < values.max() <= 1.001 * stiffest
