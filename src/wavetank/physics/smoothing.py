"""Smoothing kernels, and what follows from them alone: rest-lattice sums and half-space integrals.

A kernel is written as W(r, h) = sigma / h^dim * w(q) with q = r / h and the support radius h, where w vanishes for
q >= 1. The solver works with w and lattice sums only, so that nothing depends on the unit of length.

    code     symbol     meaning                                                unit
    q        r / h      distance in support radii                              1
    w        w          shape of the kernel; w' is its derivative              1
    square   q^2        what the device asks kernels for, see `kernel`         1
    sigma               makes the integral of W one                            1
    ratio    h / d      support radius in particle spacings                    1

Sources: Spiky and Poly6: Müller, Charypar, Gross 2003 (10.2312/SCA03/154-159); cubic spline: Monaghan 1992
(10.1146/annurev.aa.30.090192.002551); Wendland C2: Wendland 1995 (10.1007/BF02123482), in the form of Dehnen and Aly
2012 (10.1111/j.1365-2966.2012.21439.x).
"""

import dataclasses
import functools
import itertools
import math

import numpy as np

from wavetank.device.compiler import qd

WALL_STIFFENING = 0.5  # by how much a wall's layers move with a particle half a spacing away; see `half_space`
TABLE_SIZE = 256  # samples of the half-space integrals over s/h in [-1, 1]


@qd.func
def spiky(square):
    """Pair (w, -w'/q / 3) of Spiky."""
    q = qd.sqrt(square)
    t = qd.max(1.0 - q, 0.0)
    return qd.Vector([t * t * t, t * t / qd.max(q, 1e-6)])


@qd.func
def poly6(square):
    """Pair (w, -w'/q / 6) of Poly6."""
    t = qd.max(1.0 - square, 0.0)
    return qd.Vector([t * t * t, t * t])


@qd.func
def cubic(square):
    """Pair (w, -w'/q / 6) of the cubic spline."""
    q = qd.sqrt(square)
    a = qd.max(1.0 - q, 0.0)
    b = qd.max(0.5 - q, 0.0)
    return qd.Vector([2.0 * a * a * a - 8.0 * b * b * b, (a * a - 4.0 * b * b) / qd.max(q, 1e-6)])


@qd.func
def wendland(square):
    """Pair (w, -w'/q / 20) of Wendland C2."""
    q = qd.sqrt(square)
    t = qd.max(1.0 - q, 0.0)
    return qd.Vector([t * t * t * t * (1.0 + 4.0 * q), t * t * t])


@qd.func
def poly6_spiky(square):
    """Pair (w of Poly6, -w'/q / 3 of Spiky): the choice of Macklin and Müller 2013 and of the report.

    The second is scaled to the integral of the first, sigma(spiky) / sigma(poly6), by `RestLattice.gradient_scale`.
    """
    return qd.Vector([poly6(square)[0], spiky(square)[1]])


#: Append only: compiled kernels are kept between runs under a kernel's number, and do not see what the tuple holds.
KERNELS = (spiky, poly6, cubic, wendland, poly6_spiky)
#: By what the second of each pair is multiplied to be w'/q: once for a particle, not for each of its pairs.
SLOPES = {"spiky": -3.0, "poly6": -6.0, "cubic": -6.0, "wendland": -20.0}
#: For each of KERNELS, the kernel of the density and the kernel of the gradient.
NAMES = {
    "spiky": ("spiky", "spiky"),
    "poly6": ("poly6", "poly6"),
    "cubic": ("cubic", "cubic"),
    "wendland": ("wendland", "wendland"),
    "poly6-spiky": ("poly6", "spiky"),
}

_SIGMA = {
    "spiky": {2: 10.0 / math.pi, 3: 15.0 / math.pi},
    "poly6": {2: 4.0 / math.pi, 3: 315.0 / (64.0 * math.pi)},
    "cubic": {2: 40.0 / (7.0 * math.pi), 3: 8.0 / math.pi},
    "wendland": {2: 7.0 / math.pi, 3: 21.0 / (2.0 * math.pi)},
}


@qd.func
def kernel(method: qd.template(), square):
    """Pair (w, w'/q over the factor in SLOPES) at `square` = q^2 of the kernel with that number in KERNELS.

    It is chosen when the caller is compiled. A gradient is grad_i w = w'/q r_ij / h^2: a kernel that is a polynomial of
    q^2 needs neither root nor division. `Coefficients.gradient_scale` has the factor.
    Pairs nearer than 1e-6 h are pushed less, and not without bound.
    """
    return qd.static(KERNELS[method])(square)


@qd.func
def interpolated(table: qd.template(), share):
    """What a table of numbers says at that `share` of its length, 0 to 1, linear between its entries."""
    last = table.shape[0] - 1
    t = qd.min(qd.max(share, 0.0), 1.0) * last
    k = qd.min(qd.cast(t, qd.i32), last - 1)
    return table[k] + (table[k + 1] - table[k]) * (t - k)


# --- on the host, in double precision ---


def sigma(name: str, dim: int) -> float:
    """Return the normalisation of kernel `name` in `dim` dimensions."""
    return _SIGMA[name][dim]


def kernel_shape(name: str, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (w, dw/dq) of kernel `name` at the distances `q`, float64."""
    q = np.asarray(q, float)
    t = np.maximum(1.0 - q, 0.0)
    if name == "spiky":
        return t**3, -3.0 * t**2
    if name == "poly6":
        s = np.maximum(1.0 - q**2, 0.0)
        return s**3, -6.0 * q * s**2
    if name == "cubic":
        b = np.maximum(0.5 - q, 0.0)
        return 2.0 * t**3 - 8.0 * b**3, -6.0 * t**2 + 24.0 * b**2
    return t**4 * (1.0 + 4.0 * q), -20.0 * q * t**3


def _lattice(dim: int, ratio: float) -> np.ndarray:
    """Points of the unit square or cubic lattice within the support, in units of h, without the origin."""
    reach = int(ratio)
    points = np.array([p for p in itertools.product(range(-reach, reach + 1), repeat=dim) if any(p)], float) / ratio
    return points[np.linalg.norm(points, axis=1) < 1.0]


def rest_points(dim: int, ratio: float) -> np.ndarray:
    """Return the neighbours of a particle in the rest lattice within h = `ratio` d, [n, dim] in spacings."""
    return _lattice(dim, ratio) * ratio


def _lattice_sum(name: str, dim: int, ratio: float) -> float:
    w, _ = kernel_shape(name, np.linalg.norm(_lattice(dim, ratio), axis=1))
    return float(kernel_shape(name, np.zeros(1))[0][0] + w.sum())


@dataclasses.dataclass(frozen=True)
class RestLattice:
    """Constants of a pair of kernels on the rest lattice, lengths in units of h."""

    density_scale: float  # rho / rho_0 = density_scale * sum_j w(q_ij), own particle included
    gradient_scale: float  # h grad(rho / rho_0) = gradient_scale * sum_j w'(q_ij) r_ij / |r_ij|
    squared_gradients: float  # h^2 S_0 = h^2 sum_k |grad_k C|^2
    stiffness: float  # a field of multipliers moves particles by stiffness * grad lambda
    stiffest_mode: float  # largest eigenvalue of the Jacobi matrix D^-1 grad C grad C^T


@functools.cache
def rest_lattice(name: str, dim: int, ratio: float) -> RestLattice:
    """Return the constants of the kernel `name` (a key of NAMES) at h / d = `ratio`."""
    density_kernel, gradient_kernel = NAMES[name]
    density_scale = 1.0 / _lattice_sum(density_kernel, dim, ratio)
    gradient_scale = density_scale * sigma(gradient_kernel, dim) / sigma(density_kernel, dim)
    points = _lattice(dim, ratio)
    distance = np.linalg.norm(points, axis=1)
    _, slope = kernel_shape(gradient_kernel, distance)
    squares = float(np.sum((gradient_scale * slope) ** 2))
    stiffness = -gradient_scale * float(np.sum(slope * distance)) / dim
    # Plane waves exp(i k x) are the eigenvectors on a lattice; grad C is odd, so only sines stay. Waves along the axes
    # and diagonals of the Brillouin zone hold the extremes.
    waves = np.linspace(0.0, math.pi * ratio, 65)[:, None, None] * np.array(
        [p for p in itertools.product((0.0, 0.5, 1.0), repeat=dim) if any(p)]
    )
    symbol = np.sin(waves.reshape(-1, dim) @ points.T) @ (points * (slope / distance)[:, None])
    stiffest = float(np.max(np.sum(symbol**2, axis=1)) / np.sum(slope**2))
    return RestLattice(density_scale, gradient_scale, squares, stiffness, stiffest)


@functools.cache
def half_space_table(name: str, dim: int, ratio: float) -> np.ndarray:
    """Sample what a flat wall adds to the density, float32 [TABLE_SIZE + 1, 2], at s / h from -1 to 1.

    Columns: I(s), the share of rho_0 that the wall contributes at the distance s, and A(s) = -h dI/ds.
    """
    s = np.linspace(-1.0, 1.0, TABLE_SIZE + 1)
    value = half_space(name, dim, ratio, s)
    step = 1e-5
    slope = (half_space(name, dim, ratio, s - step) - half_space(name, dim, ratio, s + step)) / (2.0 * step)
    return np.stack([value, slope], axis=1).astype(np.float32)


def half_space(name: str, dim: int, ratio: float, s: np.ndarray) -> np.ndarray:
    """Return the share of rho_0 that a wall at the distance s h contributes: half a rest lattice that ends there.

    Its layers stand at s + d/2, s + 3d/2, ... from the particle, in register with it, so that half a spacing from
    the wall the sum is that of the rest lattice to the last digit. The integral of W over the half-space
    (`half_space_integral`) does not do that, because the lattice sum of a pointed kernel such as Spiky is far from it.

    In the bulk a pair pushes with both multipliers, at a wall there is only the particle's own. Layers that kept their
    place in the wall would push with half the force, and particles would settle on the wall. Layers that mirrored the
    particle would balance it, and are too stiff for the solver. These move half as far: WALL_STIFFENING is measured
    (notebook/walls.md).
    """
    layers = np.arange(int(ratio) + 2)
    depth = (s + WALL_STIFFENING / ratio * _tooth(s * ratio - 0.5))[:, None] + (layers + 0.5) / ratio
    # Closer than half a spacing behind the wall, the particle has passed the first layer; the sum stays at its peak.
    depth = np.maximum(depth, 0.0)
    plane = _lattice(dim, ratio)
    plane = np.vstack([np.zeros(dim), plane[np.abs(plane[:, 0]) < 1e-12]])[:, 1:]
    away = np.sqrt(depth[:, :, None] ** 2 + np.sum(plane**2, axis=1))
    w, _ = kernel_shape(NAMES[name][0], away)
    return w.sum(axis=(1, 2)) / _lattice_sum(NAMES[name][0], dim, ratio)


def _tooth(x: np.ndarray) -> np.ndarray:
    """Return x around zero, back to zero at -1 and 1, and zero beyond."""
    return np.where(np.abs(x) < 0.5, x, np.sign(x) * np.maximum(1.0 - np.abs(x), 0.0))


def half_space_integral(name: str, dim: int, s: float) -> float:
    """Integrate W (h = 1) over the points whose coordinate along the normal exceeds `s`, by Gauss-Legendre.

    Shells of radius q lose the cap beyond s: (1 - s/q) / 2 of a sphere, arccos(s/q) / pi of a circle.
    """
    low = abs(s)
    nodes, weights = np.polynomial.legendre.leggauss(48)
    q = low + (1.0 - low) * 0.5 * (nodes + 1.0)
    w, _ = kernel_shape(name, q)
    cap = 0.5 * (1.0 - low / q) if dim == 3 else np.arccos(low / q) / math.pi
    area = 4.0 * math.pi * q**2 if dim == 3 else 2.0 * math.pi * q
    part = float(sigma(name, dim) * np.sum(weights * w * cap * area) * 0.5 * (1.0 - low))
    return part if s >= 0 else 1.0 - part
