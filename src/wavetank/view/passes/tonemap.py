"""Radiance to pixels: compress what is too bright, average the samples of a pixel, encode as sRGB.

Khronos PBR Neutral tone mapper (2024): colours below 0.8 keep their hue, so that what a colour map says survives;
brighter ones lose saturation on their way to white.
"""

from typing import Any

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import vec3
from wavetank.view.shot import Shot


def draw(shot: Shot, buffers: Buffers) -> None:
    """Fill `picture` from `color`."""
    write(buffers, buffers.pixels.color, 0)


def collect(color: Any, total: Any, share: float) -> None:
    """Add `share` of a picture, tone-mapped, to `total`; a share of 1 starts anew, so that the mean is kept."""
    add(total, color, share)


def draw_collected(total: Any, buffers: Buffers) -> None:
    """Fill `picture` from what was collected."""
    write(buffers, total, 1)


def write(buffers: Buffers, color: Any, mapped: int) -> None:
    """Fill `picture` from `color`, which may be `mapped` (1 or 0) by now."""
    threes = int(buffers.picture.shape[0]) // 3  # of words in a picture
    develop(buffers.picture, color, buffers.curve, buffers.supersample, mapped, threes)


@qd.kernel(fastcache=True)
def add(total: qd.types.ndarray(), color: qd.types.ndarray(), share: qd.f32):
    """Move `total` by `share` of the way to the tone-mapped `color`."""
    for row, column in qd.ndrange(color.shape[0], color.shape[1]):
        mapped = neutral(color[row, column])
        before = total[row, column]
        if share == 1.0:
            before = mapped
        total[row, column] = before + share * (mapped - before)


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
def develop(
    picture: qd.types.ndarray(),
    color: qd.types.ndarray(),
    curve: qd.types.ndarray(),
    samples: qd.template(),
    mapped: qd.template(),
    threes: qd.i32,
):
    """Write the picture from `samples`^2 samples a pixel; `curve` encodes linear light as sRGB bytes.

    Four pixels of three bytes fill three words, so that the words in memory are the bytes of the picture.
    """
    rows, columns = color.shape[0] // samples, color.shape[1] // samples
    # As an argument: portable back ends cannot divide before they start a loop.
    for group in range(threes):
        first, second, third = 0, 0, 0
        row = 4 * group // columns
        column = 4 * group - row * columns
        for k in range(4):
            total = vec3(0.0, 0.0, 0.0)
            for part in range(qd.static(samples * samples)):
                sample = color[row * samples + part // samples, column * samples + part % samples]
                if qd.static(mapped == 0):
                    sample = neutral(sample)
                total += sample
            column += 1
            if column == columns:
                column, row = 0, qd.min(row + 1, rows - 1)
            last = curve.shape[0] - 1
            place = total * (last / (samples * samples)) + 0.5
            for channel in qd.static(range(3)):
                byte = 3 * k + channel
                entry = qd.min(qd.max(qd.cast(place[channel], qd.i32), 0), last)
                bits = curve[entry] << (8 * (byte % 4))
                # Spelled out: an operator in place on part of a vector is more than every back end can do.
                if byte < 4:
                    first = first | bits
                elif byte < 8:
                    second = second | bits
                else:
                    third = third | bits
        picture[3 * group] = first
        picture[3 * group + 1] = second
        picture[3 * group + 2] = third
