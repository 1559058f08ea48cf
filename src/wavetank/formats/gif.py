"""Animated GIF, for pages that show no video."""

import itertools
from pathlib import Path
from types import TracebackType

import numpy as np

from wavetank.foundation.atomic_write import partial_path
from wavetank.foundation.errors import WavetankError

SUFFIXES = (".gif",)
KIND = "video"

LARGEST_RATE = 50.0  # frames per second: most programs slow shorter frames than two hundredths of a second down


class GifWriter:
    """Collects pictures of one size, 256 colours each, and writes them when it is closed.

    Use it in a ``with``. An interrupt (Ctrl-C) still completes the file with the pictures that were written; any other
    error leaves nothing, and a file of that name as it was.
    """

    def __init__(self, path: str | Path, width: int, height: int, fps: float = 25.0) -> None:
        """Open `path` for pictures of `width` x `height` pixels."""
        if width < 1 or height < 1 or not 0.1 <= fps <= LARGEST_RATE:
            raise WavetankError(
                f"gif: {width} x {height} at {fps} frames per second is not allowed; sizes start at 1, rates lie "
                f"between 0.1 and {LARGEST_RATE:g}."
            )
        self.path, self.width, self.height, self.fps = Path(path), int(width), int(height), float(fps)
        self._partial = partial_path(path)
        self._pictures: list[object] = []

    def write(self, image: np.ndarray) -> None:
        """Append a picture, uint8 [height, width, 3]."""
        from PIL import Image

        if image.dtype != np.uint8 or image.shape != (self.height, self.width, 3):
            raise WavetankError(
                f"gif: a picture of {image.dtype} {list(image.shape)} does not fit; "
                f"this one takes uint8 [{self.height}, {self.width}, 3]."
            )
        # A palette of its own for each picture, undithered: dots that dance are worse than a step in a gradient.
        self._pictures.append(Image.fromarray(image).quantize(256, dither=Image.Dither.NONE))

    def close(self) -> None:
        """Write the file, if there is any picture."""
        pictures, self._pictures = self._pictures, []
        if not pictures:
            return
        # Delays are whole hundredths of a second; rounding the times, not the delays, keeps the length of the whole.
        times = [round(100.0 * k / self.fps) for k in range(len(pictures) + 1)]
        delays = [10 * (b - a) for a, b in itertools.pairwise(times)]
        try:
            pictures[0].save(  # type: ignore[attr-defined]
                self._partial, format="GIF", save_all=True, append_images=pictures[1:], duration=delays, loop=0
            )
            self._partial.replace(self.path)
        except OSError as error:
            raise WavetankError(f"{str(self.path)!r} cannot be written: {error.strerror or error}.") from error
        finally:
            self._partial.unlink(missing_ok=True)

    def __enter__(self) -> "GifWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or not issubclass(kind, Exception):  # KeyboardInterrupt, SystemExit
            self.close()
        self._pictures = []


def resized(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Resize a picture, uint8 [height, width, 3]."""
    from PIL import Image

    if image.shape[1::-1] == size:
        return image
    return np.asarray(Image.fromarray(image).resize(size, Image.Resampling.BOX))


write = GifWriter
