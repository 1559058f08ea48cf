"""Radiance to pixels: compress what is too bright, average the samples of a pixel, encode as sRGB.

Khronos PBR Neutral tone mapper (2024): colours below 0.8 keep their value, so that what a colour map says survives; brighter ones
lose saturation on their way to white.
"""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import vec3
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill `picture` from `color`."""
    develop(buffers.color, buffers.curve, buffers.picture)


@qd.func
def neutral(color):
    """Displayable linear colour 0 to 1 of a radiance."""
    start, desaturation = 0.76, 0.15  # compression starts at 0.8 - 0.04
    color = qd.max(color, 0.0)
    low = qd.min(color.x, color.y, color.z)
    offset = 0.04
    if low < 0.08:
        offset = low - 6.25 * low * low
    color -= offset
    peak = qd.max(color.x, color.y, color.z)
    if peak >= start:
        rest = 1.0 - start
        compressed = 1.0 - rest * rest / (peak + rest - start)
        color *= compressed / peak
        white = 1.0 - 1.0 / (desaturation * (peak - compressed) + 1.0)
        color += (compressed - color) * white
    return color


@qd.kernel(fastcache=True)
def develop(color: qd.types.ndarray(), curve: qd.types.ndarray(), picture: qd.types.ndarray()):
    """Write every pixel of the picture from its samples; `curve` encodes linear light as sRGB bytes."""
    samples = color.shape[0] // picture.shape[0]
    last = curve.shape[0] - 1
    for row, column in qd.ndrange(picture.shape[0], picture.shape[1]):
        total = vec3(0.0, 0.0, 0.0)
        for k in range(samples):
            for m in range(samples):
                total += neutral(color[row * samples + k, column * samples + m])
        total = qd.min(total / (samples * samples), 1.0) * last + 0.5
        picture[row, column] = (
            curve[qd.cast(total.x, qd.i32)]
            | (curve[qd.cast(total.y, qd.i32)] << 8)
            | (curve[qd.cast(total.z, qd.i32)] << 16)
        )
