"""Glare: what an eye or a lens scatters of light that is much brighter than white.

G. Spencer et al., "Physically-based glare effects for digital images" (SIGGRAPH 1995), Eq. 5 to 8: the point spread
function of the human eye by day, 0.384 f0 + 0.478 f1 + 0.138 f2. Here f0, which is narrower than a pixel, and what f1
has within one stay where they are. What a display can show scatters in the beholder's own eye and is left as it is;
only the rest is spread. One convolution by Fourier transform on the host, in double precision.

    code      symbol   meaning                                            unit
    angle     theta    angle between a pixel and the light                deg
    excess             radiance beyond `BRIGHT`                           1
    pixel              width of a pixel in the middle of the picture      rad
"""

from typing import Any

import numpy as np

from wavetank.device.compiler import download, upload
from wavetank.view.lens import Lens

BRIGHT = 1.8  # radiance that is much brighter than white


def add_glare(color: Any, excess: np.ndarray, lens: Lens, room: float = 0.0) -> None:
    """Spread the `excess` of a picture on the device, float32 [rows, columns, 3], in its vec3 array `color`.

    With `room` of 1 the picture is mapped for a display by now, and gets as much of the glare as it is short of white.
    """
    if float(lens.perspective) < 0.5 or not np.any(excess > 0.0):
        return
    spread = spread_of(excess, float(lens.pixel))
    seen = download(color).astype(float)
    # What is mapped by now had its own share of the excess mapped with it.
    change = spread * (1.0 - seen.clip(0.0, 1.0)) if room else spread - excess
    upload(color, (seen + change).astype(np.float32))


def excess_of(color: np.ndarray) -> np.ndarray:
    """Return what is beyond `BRIGHT` of a picture's radiance, float64, its colour kept."""
    peak = color.max(axis=-1, keepdims=True).astype(float)
    result: np.ndarray = color * (np.maximum(peak - BRIGHT, 0.0) / np.maximum(peak, 1e-9))
    return result


def spread_of(excess: np.ndarray, pixel: float) -> np.ndarray:
    """Return radiance [rows, columns, 3] after it was scattered; what leaves the picture is lost."""
    rows, columns = excess.shape[:2]
    shape = (2 * rows, 2 * columns)
    kernel = np.fft.rfft2(kernel_of(shape, pixel))
    spread = [np.fft.irfft2(np.fft.rfft2(excess[..., k], shape) * kernel, shape) for k in range(3)]
    return np.maximum(np.stack(spread, axis=-1)[:rows, :columns], 0.0)


def kernel_of(shape: tuple[int, int], pixel: float) -> np.ndarray:
    """Return the share that every pixel gets of the light in pixel (0, 0), wrapped around, [rows, columns]; sum 1."""
    y, x = (np.minimum(np.arange(size), size - np.arange(size)) for size in shape)
    angle = np.degrees(np.arctan(pixel * np.hypot(y[:, None], x[None, :])))
    lone = 0.478 * 20.91 / (angle + 0.02) ** 3 + 0.138 * 72.37 / (angle + 0.02) ** 2
    kernel: np.ndarray = lone * pixel**2
    kernel[0, 0] = 0.0
    kernel[0, 0] = max(1.0 - kernel.sum(), 0.0)
    return kernel / kernel.sum()
