"""Removes the remaining noise by an edge-avoiding wavelet filter that is guided by the variance of every pixel.

H. Dammertz et al., "Edge-avoiding À-Trous wavelet transform for fast global illumination filtering" (HPG 2010), with
the variance of C. Schied et al., "Spatiotemporal variance-guided filtering" (HPG 2017), Eq. 3-5. The variance is that
of the two halves of a pixel's samples, so that well spread samples, which leave less noise than chance does, are
filtered less. Where the halves agree a pixel is not filtered, whatever its neighbours are.

    code      symbol   meaning                                                        unit
    noise     Var      variance of a pixel's brightness                               1
    apart              difference of two pixels in units of their tolerance           1
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.film.paths import Film
from wavetank.view.lens import vec3

LEVELS = 5
TOLERANCE = 2.5  # standard deviations by which neighbours may differ


def denoised(film: Film, spare: tuple[Any, Any, Any]) -> Any:
    """Return the filtered radiance of `film`, one of the temporaries `spare`: two vec3, one vec2, [rows, columns]."""
    given, taken, noise = spare
    estimate_variance(noise, film)
    given.copy_from(film.mean)
    for level in range(LEVELS):
        filter_level(taken, noise, given, film, 1 << level, level % 2, TOLERANCE)
        given, taken = taken, given
    return given


@qd.func
def brightness(color):
    """Luminance of a displayed colour: compressed where pictures become white."""
    gray = 0.3 * color.x + 0.6 * color.y + 0.1 * color.z
    return gray / (1.0 + 0.5 * gray)


@qd.kernel(fastcache=True)
def estimate_variance(noise: qd.types.ndarray(), film: Film):
    """Write the variance of every pixel, estimated from the 25 pixels around it."""
    rows, columns = film.mean.shape[0], film.mean.shape[1]
    for row, column in qd.ndrange(rows, columns):
        total, count = 0.0, 0.0
        for y in range(qd.max(row - 2, 0), qd.min(row + 2, rows - 1) + 1):
            for x in range(qd.max(column - 2, 0), qd.min(column + 2, columns - 1) + 1):
                off = brightness(film.mean[y, x]) - brightness(film.half[y, x])
                w = qd.select(y == row and x == column, 3.0, 1.0)
                total += w * off * off
                count += w
        noise[row, column][0] = total / count


@qd.kernel(fastcache=True)
def filter_level(
    color: qd.types.ndarray(),
    noise: qd.types.ndarray(),
    before: qd.types.ndarray(),
    film: Film,
    step: qd.i32,
    turn: qd.i32,
    tolerance: qd.f32,
):
    """Average every pixel with those up to two steps away that show the same surface.

    `noise` holds two variances for every pixel, one is read and the other one written.
    """
    rows, columns = film.mean.shape[0], film.mean.shape[1]
    for row, column in qd.ndrange(rows, columns):
        gray = brightness(before[row, column])
        own = noise[row, column][turn]
        guide, form = film.albedo[row, column], film.shape[row, column]
        total, weight, rest = vec3(0.0, 0.0, 0.0), 0.0, 0.0
        scale = 1.0 / (tolerance * qd.sqrt(own) + 2e-4)
        for k in range(25):
            i, j = k % 5 - 2, k // 5 - 2
            y, x = row + j * step, column + i * step
            if y >= 0 and y < rows and x >= 0 and x < columns:
                there = before[y, x]
                other, shape = film.albedo[y, x], film.shape[y, x]
                apart = qd.abs(brightness(there) - gray) * scale
                apart += (other - guide).norm() * 10.0
                off = shape - form
                apart += off.norm() * 6.0
                w = qd.exp(-apart) * wavelet(i) * wavelet(j)
                total += w * there
                rest += w * w * noise[y, x][turn]
                weight += w
        color[row, column] = total / weight
        noise[row, column][1 - turn] = rest / (weight * weight)


@qd.func
def wavelet(k):
    """Weight of the cubic spline's wavelet."""
    return qd.select(k == 0, 0.375, qd.select(qd.abs(k) == 1, 0.25, 0.0625))
