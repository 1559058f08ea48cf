"""The legend: a colour bar with its numbers, the quantity and the time, written onto a finished picture."""

import functools
import math
from collections.abc import Mapping

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from wavetank.view.colormaps import to_srgb

SMALLEST = (160, 120)  # px: a legend in less would hide the picture
INK = (52, 60, 68, 255)
PLATE = (255, 255, 255, 150)


def draw_bar(picture: np.ndarray, colors: np.ndarray, limits: tuple[float, float], label: str) -> int:
    """Draw the colour bar of `colors` (linear RGB [entries, 3]) into the lower left corner of `picture`, in place.

    Returns the first column to its right that is free.
    """
    if not _has_room(picture):
        return 0
    unit = _unit(picture)
    plate = _bar(colors.tobytes(), limits, label, unit, int(max(0.2 * picture.shape[1], 8 * unit)))
    _lay(picture, plate, picture.shape[0] - plate.shape[0] - unit, unit)
    return int(plate.shape[1]) + unit


def draw_keys(picture: np.ndarray, colors: Mapping[str, str]) -> int:
    """Draw a patch of colour and its name for each of `colors` into the lower left corner of `picture`, in place.

    Returns the first column to its right that is free.
    """
    if not _has_room(picture):
        return 0
    unit, font = _unit(picture), _font(_unit(picture))
    widths = [int(font.getlength(name)) + 3 * unit for name in colors]
    plate = _plate(sum(widths) + unit, 2 * unit)
    pen, at = ImageDraw.Draw(plate), unit
    for (name, color), width in zip(colors.items(), widths, strict=True):
        pen.rectangle((at, unit // 2, at + unit, unit // 2 + unit), fill=color, outline=INK)
        pen.text((at + 3 * unit // 2, unit), name, INK, font, anchor="lm")
        at += width
    _lay(picture, np.asarray(plate), picture.shape[0] - plate.height - unit, unit)
    return plate.width + unit


def write_time(picture: np.ndarray, time: float, count: int, column: int = 0) -> None:
    """Write the time [s] and the number of particles at the lower edge of `picture` from `column` on, in place."""
    if not _has_room(picture):
        return
    unit, font = _unit(picture), _font(_unit(picture))
    text = f"t = {time:.2f} s"
    if picture.shape[1] >= 3 * SMALLEST[0]:
        text += f"    {count:,} particles".replace(",", " ")
    plate = _plate(int(font.getlength(text)) + 2 * unit, 2 * unit)
    ImageDraw.Draw(plate).text((unit, unit), text, INK, font, anchor="lm")
    _lay(picture, np.asarray(plate), picture.shape[0] - plate.height - unit, column + unit)


def draw_scale(picture: np.ndarray, pixels_per_metre: float) -> None:
    """Draw a bar of a round length [m] into the lower right corner of `picture`, in place."""
    if not _has_room(picture):
        return
    unit = _unit(picture)
    length = ticks(0.0, 0.3 * picture.shape[1] / pixels_per_metre)[1]
    bar = round(length * pixels_per_metre)
    plate = _plate(bar + 2 * unit, int(2.6 * unit))
    pen, at, low = ImageDraw.Draw(plate), int(1.9 * unit), unit // 4
    pen.text((unit + bar // 2, unit), f"{length:g} m", INK, _font(unit), anchor="mm")
    for line in (
        (unit, at, unit + bar, at),
        (unit, at - low, unit, at + low),
        (unit + bar, at - low, unit + bar, at + low),
    ):
        pen.line(line, fill=INK, width=max(1, unit // 10))
    _lay(picture, np.asarray(plate), picture.shape[0] - plate.height - unit, picture.shape[1] - plate.width - unit)


@functools.lru_cache(maxsize=16)
def _bar(colors: bytes, limits: tuple[float, float], label: str, unit: int, length: int) -> np.ndarray:
    """The bar on its plate, RGBA."""
    table = np.frombuffer(colors, np.float32).reshape(-1, 3)
    margin = 2 * unit  # the numbers at the ends are wider than the bar
    plate = _plate(length + 2 * margin, int(4.4 * unit))
    pen, font = ImageDraw.Draw(plate), _font(unit)
    entries = np.linspace(0, len(table) - 1, length).round().astype(int)
    stripe = (255.0 * to_srgb(table[entries]) + 0.5).astype(np.uint8)
    top, thick = int(1.8 * unit), max(2, int(0.7 * unit))
    plate.paste(Image.fromarray(np.repeat(stripe[None], thick, axis=0)), (margin, top))
    pen.rectangle((margin - 1, top - 1, margin + length, top + thick), outline=INK)
    pen.text((margin, unit), label, INK, font, anchor="lm")
    for value in ticks(*limits):
        at = margin + (length - 1) * (value - limits[0]) / (limits[1] - limits[0])
        pen.line((at, top + thick, at, top + thick + unit // 3), fill=INK)
        pen.text((at, top + thick + unit), f"{value:g}", INK, font, anchor="mm")
    return np.asarray(plate)


def ticks(low: float, high: float) -> list[float]:
    """Return up to six round numbers from `low` to `high`."""
    rough = (high - low) / 4.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(s * power for s in (1.0, 2.0, 2.5, 5.0, 10.0) if s * power >= rough * 0.999)
    first, last = math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6)
    return [round(k * step, 12) for k in range(first, last + 1)]


def _has_room(picture: np.ndarray) -> bool:
    return bool(picture.shape[1] >= SMALLEST[0] and picture.shape[0] >= SMALLEST[1])


def _unit(picture: np.ndarray) -> int:
    """Size of the letters [px]."""
    return max(9, round(min(int(picture.shape[0]), int(picture.shape[1])) / 48))


@functools.lru_cache(maxsize=8)
def _font(size: int) -> ImageFont.FreeTypeFont | ImageFont.ImageFont:
    return ImageFont.load_default(size)


def _plate(width: int, height: int) -> Image.Image:
    """A translucent ground that text stays readable on."""
    plate = Image.new("RGBA", (width, height), (255, 255, 255, 0))
    ImageDraw.Draw(plate).rounded_rectangle((0, 0, width - 1, height - 1), radius=height // 6, fill=PLATE)
    return plate


def _lay(picture: np.ndarray, plate: np.ndarray, row: int, column: int) -> None:
    """Blend an RGBA plate onto the picture, clipped to it."""
    row, column = max(row, 0), max(column, 0)
    target = picture[row : row + plate.shape[0], column : column + plate.shape[1]]
    part = plate[: target.shape[0], : target.shape[1]].astype(np.float32)
    share = part[..., 3:] / 255.0
    target[...] = (target + share * (part[..., :3] - target) + 0.5).astype(np.uint8)
