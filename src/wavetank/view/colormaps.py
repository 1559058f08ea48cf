"""Colour maps: small tables of sRGB colours, evened out in Oklab so that equal steps look equal.

Oklab: Bjorn Ottosson, "A perceptual color space for image processing" (2020). `viridis` is the map of that name by
Stefan van der Walt and Nathaniel Smith (2015, CC0), every 32nd entry; the others are ours.
"""

import functools

import numpy as np

from wavetank.foundation.errors import WavetankError

ENTRIES = 256

#: name -> colours at equal distances from the lower to the upper limit
COLORMAPS: dict[str, tuple[str, ...]] = {
    "water": ("#174fa6", "#1a68bc", "#2482d0", "#459ee0", "#78bbeb", "#a9d5f3", "#d0eaf8", "#f1f9fd"),
    "viridis": ("#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"),
    "ember": ("#1b1033", "#4a1a5f", "#86235f", "#c13b4a", "#e96a37", "#f6a53f", "#f9e08a"),
    "balance": ("#1f3f8f", "#4477bd", "#8fb4dc", "#eceef0", "#eba98e", "#cf5f4c", "#8c1c2f"),
    # The report's foam: water of one colour, white from the middle on, without a step between.
    "foam": ("#2482d0",) * (ENTRIES // 2) + ("#ffffff",) * (ENTRIES // 2),
}

# Linear sRGB to cone responses, and their cube roots to Oklab (Ottosson 2020).
_TO_CONES = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def table(name: str) -> np.ndarray:
    """Return the map as linear RGB, float32 [ENTRIES, 3]; raises `WavetankError` for an unknown name."""
    if name not in COLORMAPS:
        raise WavetankError(f"colormap = {name!r} is not known; use one of {', '.join(COLORMAPS)}.")
    return _table(name)


def bands(colors: tuple[str, ...]) -> np.ndarray:
    """Return bands of equal width of the `colors` as linear RGB, float32 [ENTRIES, 3]."""
    place = np.arange(ENTRIES) * len(colors) // ENTRIES
    linear: np.ndarray = to_linear(np.array([rgb_of(color) for color in colors]))[place].astype(np.float32)
    return linear


@functools.cache
def _table(name: str) -> np.ndarray:
    anchors = oklab(to_linear(np.array([rgb_of(color) for color in COLORMAPS[name]])))
    places = np.linspace(0.0, len(anchors) - 1.0, ENTRIES)
    even = np.stack([np.interp(places, np.arange(len(anchors)), channel) for channel in anchors.T], axis=1)
    linear = (even @ np.linalg.inv(_TO_LAB).T) ** 3 @ np.linalg.inv(_TO_CONES).T
    colors: np.ndarray = np.clip(linear, 0.0, 1.0).astype(np.float32)
    return colors


def rgb_of(color: str) -> tuple[float, float, float]:
    """Return sRGB components 0 to 1 of a colour written ``#rrggbb``; raises `WavetankError` for anything else."""
    digits = color[1:]
    if len(color) != 7 or color[0] != "#" or not all(d in "0123456789abcdefABCDEF" for d in digits):
        raise WavetankError(f"colour {color!r} is not allowed; write it as '#rrggbb', for example '#3f99da'.")
    red, green, blue = (int(digits[k : k + 2], 16) / 255.0 for k in (0, 2, 4))
    return red, green, blue


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """Return sRGB components 0 to 1 as linear light (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """Return linear light 0 to 1 as sRGB components."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055)


def oklab(linear: np.ndarray) -> np.ndarray:
    """Return linear RGB [n, 3] as Oklab (lightness 0 to 1, green-red, blue-yellow) [n, 3]."""
    lab: np.ndarray = np.cbrt(linear @ _TO_CONES.T) @ _TO_LAB.T
    return lab
