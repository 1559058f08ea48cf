"""Environments from a picture: a Radiance file (.hdr) with the light from all directions, as panoramas have it.

Its middle looks along -z, its right half along +x; the upper half is above the horizon. What is far brighter than the
rest becomes the sun, of which shadows and caustics come; without such a place there is hardly any. The picture is
exposed so that the ground is as bright as under other skies. Quality film looks the rest up; other pictures have the
seven functions of `sky.py` fitted to it.

G. Ward, "Real Pixels", Graphics Gems II (1991), and the file format of Radiance, section "Picture File Format".
"""

import dataclasses
import functools
import re
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, printable, read_bytes
from wavetank.view.lens import vector
from wavetank.view.look import SKY, Look, lit_floor, pool
from wavetank.view.sky import terms

LARGEST, MOST_PIXELS = 80_000_000, 4096 * 2048  # bytes of a file, pixels of a picture
WIDEST = 2048  # columns that are kept
WIDE = 8.0  # deg around its middle in which a sun is looked for
TIMES = 6.0  # as many times brighter than the rest is a sun


@dataclasses.dataclass(frozen=True, eq=False)
class Panorama:
    """A sky without its sun, float32 [rows, columns, 3], and the light that goes with it."""

    sky: np.ndarray
    look: Look


def is_picture(environment: str | None) -> bool:
    """Say whether an environment is the name of a file."""
    return environment is not None and environment.lower().endswith(".hdr")


def panorama(path: str) -> Panorama:
    """Return the panorama in a file, read anew where it has changed; raises `WavetankError`."""
    try:
        about = Path(path).stat()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise WavetankError(f"{printable(path)}: the environment cannot be read: {reason}.") from None
    return _panorama(path, about.st_mtime_ns, about.st_size)


@functools.lru_cache(maxsize=4)
def _panorama(path: str, _changed: int, _size: int) -> Panorama:
    data = read_bytes(Path(path), LARGEST, "environment")
    with explain_errors(printable(path), "environment"):
        return panorama_of(pixels_of(data, printable(path)))


def pixels_of(data: bytes, origin: str) -> np.ndarray:
    """Return the radiance in a Radiance file, float32 [rows, columns, 3]; raises `WavetankError`."""
    head, _, rest = data.partition(b"\n\n")
    line, _, body = rest.partition(b"\n")
    size = re.fullmatch(rb"-Y ([0-9]{1,6}) \+X ([0-9]{1,6})", line.strip())
    if not head.startswith((b"#?RADIANCE", b"#?RGBE")) or b"FORMAT=32-bit_rle_rgbe" not in head or size is None:
        raise WavetankError(
            f"{origin}: this is not an environment; give a Radiance picture (.hdr) in 32-bit_rle_rgbe whose rows run "
            "from -Y to +X."
        )
    rows, columns = int(size[1]), int(size[2])
    if not (rows >= 2 and columns >= 4 and rows * columns <= MOST_PIXELS):
        raise WavetankError(
            f"{origin}: the environment has {columns} x {rows} pixels; at least 4 x 2, at most {MOST_PIXELS:,} in all "
            "are allowed."
        )
    packed = _unpacked(memoryview(body), rows, columns)
    if packed is None:
        raise WavetankError(f"{origin}: the environment ends too soon or is damaged; {rows} rows are announced.")
    scale = np.ldexp(1.0, packed[..., 3:].astype(int) - 136)
    radiance = np.where(packed[..., 3:] > 0, (packed[..., :3] + 0.5) * scale, 0.0)
    return np.minimum(radiance, 1e9).astype(np.float32)


def _unpacked(body: memoryview, rows: int, columns: int) -> np.ndarray | None:
    """Return mantissas and exponents, uint8 [rows, columns, 4], or None where there is too little or too much."""
    result = np.zeros((rows, columns, 4), np.uint8)
    at, marked = 0, bytes((2, 2, columns >> 8, columns & 255))
    for row in range(rows):
        if not (8 <= columns < 32768 and bytes(body[at : at + 4]) == marked):
            plain = body[at : at + 4 * columns]
            if len(plain) < 4 * columns:
                return None
            result[row] = np.frombuffer(plain, np.uint8).reshape(columns, 4)
            at += 4 * columns
            continue
        at += 4
        for channel in range(4):
            column = 0
            while column < columns:
                if at + 1 >= len(body):
                    return None
                count = body[at]
                run = count > 128
                count = count - 128 if run else count
                taken = 1 if run else count
                if not 0 < count <= columns - column or at + 1 + taken > len(body):
                    return None
                values = np.frombuffer(body[at + 1 : at + 1 + taken], np.uint8)
                result[row, column : column + count, channel] = values
                at, column = at + 1 + taken, column + count
    return result


def directions_of(rows: int, columns: int) -> np.ndarray:
    """Return the unit vector to the middle of every pixel, [rows, columns, 3]."""
    height = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)
    turn = 2.0 * np.pi * ((np.arange(columns) + 0.5) / columns - 0.5)
    flat = np.cos(height)[:, None]
    return np.stack([flat * np.sin(turn), np.sin(height)[:, None] + 0.0 * turn, -flat * np.cos(turn)], axis=2)


def panorama_of(radiance: np.ndarray) -> Panorama:
    """Return the light of a panorama [rows, columns, 3]: its sun, its sky, its exposure."""
    less = max(1, -(-radiance.shape[1] // WIDEST))
    rows, columns = (size // less * less for size in radiance.shape[:2])
    seen = (
        radiance[:rows, :columns].reshape(rows // less, less, columns // less, less, 3).mean(axis=(1, 3), dtype=float)
    )
    rows, columns = seen.shape[:2]
    to = directions_of(rows, columns)
    per = 2.0 * np.pi**2 / (rows * columns) * np.sqrt(1.0 - to[..., 1] ** 2)  # sr of every pixel
    above = to[..., 1] > 0.0
    bright = seen @ (0.3, 0.6, 0.1)
    peak = to.reshape(-1, 3)[np.argmax(np.where(to[..., 1] > 0.05, bright, -1.0))]
    around = to @ peak > np.cos(np.radians(WIDE))
    usual = float(np.average(bright[above & ~around], weights=per[above & ~around]))
    lamp = (
        seen
        * (around & above)[..., None]
        * (np.maximum(bright - TIMES * usual, 0.0) / np.maximum(bright, 1e-12))[..., None]
    )
    power = np.einsum("rck,rc->k", lamp, per)
    sky = seen - lamp
    white = np.einsum("rck,rc->k", sky * above[..., None], per * to[..., 1]) / np.pi
    to_sun = np.asarray(pool().to_sun, float)
    if power.sum() > 0.0:
        to_sun = np.einsum("rck,rc,rcm->m", lamp, per, to)
        to_sun[1] = max(to_sun[1], 0.06 * np.linalg.norm(to_sun))
        to_sun /= np.linalg.norm(to_sun)
    area = float(per[lamp.sum(axis=2) > 0.0].sum())
    plain, up = pool(), float(to_sun[1])
    wanted = float(np.mean(plain.sun) * plain.to_sun[1] + np.mean(plain.sky))
    gain = wanted / max(float(np.mean(power) / np.pi * up + np.mean(white)), 1e-12)
    sun, white, sky = gain * power / np.pi, gain * white, gain * sky
    low, high = (to[..., 1] > 0.0) & (to[..., 1] < 0.1), to[..., 1] > 0.8
    fitted = _fitted(sky[above], to[above], per[above], to_sun)
    weights: dict[str, Any] = {name: vector(*weight) for name, weight in zip(SKY, fitted, strict=True)}
    look = dataclasses.replace(
        plain,
        to_sun=vector(*to_sun),
        sun=vector(*np.maximum(sun, 1e-3)),
        sky=vector(*white),
        outdoors=1,
        horizon=vector(*np.average(sky[low], axis=0, weights=per[low])),
        zenith=vector(*np.average(sky[high], axis=0, weights=per[high])),
        sun_size=float(np.clip(np.sqrt(area / np.pi), 0.005, 0.12)),
        **weights,
    )
    look = dataclasses.replace(look, below=lit_floor(look), ground=vector(*(0.45 * np.asarray(lit_floor(look)))))
    return Panorama(sky.astype(np.float32), look)


def _fitted(sky: np.ndarray, to: np.ndarray, per: np.ndarray, to_sun: np.ndarray) -> np.ndarray:
    """Return the weights of the functions of `sky.terms` for a sky [n, 3] seen in directions [n, 3], [TERMS, 3].

    Lamps are cut off at twice the mean and steep functions held back, or smooth ones would swing below nought; what the
    sky shows a white surface is kept.
    """
    functions, share = terms(to, to_sun), np.sqrt(per)[:, None]
    even = np.minimum(sky, 2.0 * np.average(sky, axis=0, weights=per))
    hold = np.sqrt(0.03 * per.sum()) * np.diag([0.0, *[1.0] * (functions.shape[1] - 1)])
    rows, wanted = np.vstack([functions * share, hold]), np.vstack([even * share, np.zeros((len(hold), 3))])
    weights = np.linalg.lstsq(rows, wanted, rcond=None)[0]
    down = per * to[:, 1]
    seen: np.ndarray = weights * (down @ sky) / np.maximum(down @ np.maximum(functions @ weights, 0.0), 1e-12)
    return seen
