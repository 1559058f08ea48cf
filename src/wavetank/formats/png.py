"""PNG pictures."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError

SUFFIXES = (".png",)
KIND = "picture"


def write_png(path: str | Path, image: np.ndarray, metadata: Mapping[str, object] | None = None) -> None:
    """Write `image`, uint8 [height, width, 3], with `metadata` (scene, time, ...) as named texts in the file."""
    from PIL import Image
    from PIL.PngImagePlugin import PngInfo

    checked = np.ascontiguousarray(image)
    if checked.dtype != np.uint8 or checked.ndim != 3 or checked.shape[2] != 3:
        raise WavetankError(
            f"png: an image of {checked.dtype} {list(checked.shape)} cannot be written; "
            "it must be uint8 [height, width, 3]."
        )
    texts = PngInfo()
    for name, value in (metadata or {}).items():
        texts.add_itxt(name, str(value))
    with atomic_write(path) as partial:
        Image.fromarray(checked).save(partial, format="PNG", pnginfo=texts, compress_level=4)


write = write_png
