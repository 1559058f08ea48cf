"""Radiance to pixels: compress what is too bright, average the samples of a pixel, encode as sRGB.

Khronos PBR Neutral tone mapper (2024): colours below 0.8 keep their hue, so that what a colour map says survives;
brighter ones lose saturation on their way to white.
"""

from wavetank.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import vec3
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill `picture` from `color`."""
    develop(buffers.color, buffers.supersample, buffers.curve, buffers.picture)


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
def develop(color: qd.types.ndarray(), samples: qd.i32, curve: qd.types.ndarray(), picture: qd.types.ndarray()):
    """Write the picture from `samples`^2 samples a pixel; `curve` encodes linear light as sRGB bytes.

    Four pixels of three bytes fill three words, so that the words in memory are the bytes of the picture.
    """
    columns = color.shape[1] // samples
    pixels = color.shape[0] // samples * columns
    for group in range(picture.shape[0] // 3):
        word = qd.Vector([0, 0, 0])
        for k in qd.static(range(4)):
            pixel = qd.min(4 * group + k, pixels - 1)
            total = vec3(0.0, 0.0, 0.0)
            for m in range(samples):
                for n in range(samples):
                    total += neutral(color[pixel // columns * samples + m, pixel % columns * samples + n])
            last = curve.shape[0] - 1
            place = total * (last / (samples * samples)) + 0.5
            for channel in qd.static(range(3)):
                byte = 3 * k + channel
                entry = qd.min(qd.max(qd.cast(place[channel], qd.i32), 0), last)
                word[byte // 4] |= curve[entry] << (8 * (byte % 4))
        for k in qd.static(range(3)):
            picture[3 * group + k] = word[k]
