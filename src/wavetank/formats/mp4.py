"""H.264 video in MP4, for every browser and player."""

import threading
from collections.abc import Iterable, Sequence
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from wavetank.foundation.atomic_write import atomic_write, partial_path
from wavetank.foundation.errors import WavetankError

SUFFIXES = (".mp4",)
KIND = "video"

_BT709 = 1  # the number of ITU-R BT.709 for primaries, transfer and matrix (ITU-T H.273)
_LIMITED = 1  # libav's number for video range, 16 to 235
FRAGMENT = 1_000_000  # microseconds of video that play by themselves, at most


class VideoWriter:
    """Writes pictures of one size to a file that appears when it is complete.

    Use it in a ``with``. An interrupt (Ctrl-C) still completes the file with the pictures that were written, and a
    second one while it does leaves a file that plays as far as it goes; any other error leaves nothing, and a file of
    that name as it was. While it grows the file is fragmented (ISO/IEC 14496-12, 8.8): each part plays by itself.
    """

    def __init__(self, path: str | Path, width: int, height: int, fps: float = 60.0, *, quality: int = 18) -> None:
        """Open `path` for pictures of `width` x `height` pixels; `quality` is H.264's CRF, lower is better."""
        if width < 1 or height < 1 or not 0.1 <= fps <= 1000.0:
            raise WavetankError(
                f"video: {width} x {height} at {fps} frames per second is not allowed; "
                "sizes start at 1, rates lie between 0.1 and 1000."
            )
        if Path(path).suffix.lower() != ".mp4":
            raise WavetankError(f"{str(path)!r}: a video is an MP4; give the file a name that ends with .mp4.")
        self.path, self.width, self.height = Path(path), int(width), int(height)
        self.count = 0
        self._is_closed = False
        self._has_ended, self._lock = False, threading.Lock()
        self._problem: Exception | None = None
        self._rate = Fraction(fps).limit_denominator(1001)
        self._partial = partial_path(path)
        self._container = _open(self._partial)
        # The format halves the resolution of colours: sizes must be even, odd ones get one more row or column.
        self._stream = _add_stream(self._container, width + width % 2, height + height % 2, self._rate, quality)

    def write(self, image: np.ndarray) -> None:
        """Append a picture, uint8 [height, width, 3]."""
        import av

        if image.dtype != np.uint8 or image.shape != (self.height, self.width, 3):
            raise WavetankError(
                f"video: a picture of {image.dtype} {list(image.shape)} does not fit; "
                f"this video takes uint8 [{self.height}, {self.width}, 3]."
            )
        padding = ((0, self.height % 2), (0, self.width % 2), (0, 0))
        padded = np.pad(image, padding, mode="edge") if self.height % 2 or self.width % 2 else image
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(padded), format="rgb24")
        encoded = frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")
        encoded.pts = self.count
        encoded.time_base = 1 / self._rate
        for packet in self._stream.encode(encoded):
            self._container.mux(packet)
        self.count += 1

    def close(self) -> None:
        """Complete the file, its index first, and give it its name; without a single picture no file is left."""
        try:
            if self._is_closed:
                return
            self._end()
            if self.count:
                join([self._partial], self.path)
        except KeyboardInterrupt:
            self.keep()
            raise
        except OSError as error:
            raise WavetankError(f"{str(self.path)!r} cannot be written: {error.strerror or error}.") from error
        finally:
            self.discard()

    def keep(self) -> None:
        """Stop at once and leave what there is under the file's name; it plays as far as it goes."""
        if self._is_closed:
            return
        self._end()
        self._is_closed = True
        if self.count and self._partial.exists():
            self._partial.replace(self.path)

    def discard(self) -> None:
        """Stop and leave nothing."""
        self._is_closed = True
        with self._lock:
            if not self._has_ended:
                self._container.close()
                self._has_ended = True
        self._partial.unlink(missing_ok=True)

    def _end(self) -> None:
        """Encode what the encoder holds back, up to some forty pictures, and end the file that grows; once.

        In a thread of its own, where no interrupt comes between: whoever was interrupted here comes again and waits.
        """
        thread = threading.Thread(target=self._drain)
        thread.start()
        thread.join()
        if self._problem is not None:
            raise self._problem

    def _drain(self) -> None:
        with self._lock:
            if self._has_ended:
                return
            try:
                for packet in self._stream.encode(None) if self.count else ():
                    self._container.mux(packet)
                self._container.close()
            except Exception as error:
                self._problem = error
            self._has_ended = True

    def __enter__(self) -> "VideoWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None or not issubclass(kind, Exception):  # KeyboardInterrupt, SystemExit
            self.close()
        else:
            self.discard()


def _open(path: Path) -> Any:
    try:
        import av
    except ImportError:
        raise WavetankError("video needs the package `av`; install it with `pip install av`.") from None
    try:
        flags = {"movflags": "+frag_keyframe+empty_moov+default_base_moof", "frag_duration": str(FRAGMENT)}
        return av.open(str(path), "w", format="mp4", options=flags)
    except OSError as error:
        raise WavetankError(f"{str(path)!r} cannot be written: {error}.") from None


def _add_stream(container: Any, width: int, height: int, rate: Fraction, quality: int) -> Any:
    import av

    name = "libx264" if "libx264" in av.codecs_available else "h264"
    stream = container.add_stream(name, rate=rate)
    stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
    stream.options = {"crf": str(quality), "preset": "veryfast"}
    context = stream.codec_context
    context.color_primaries = context.color_trc = context.colorspace = _BT709
    context.color_range = _LIMITED
    return stream


def join(parts: Sequence[Path], path: Path) -> None:
    """Write one file with the pictures of the `parts`, concatenated without encoding again.

    The index goes first (faststart), so that a browser plays while it loads. Raises `WavetankError` where the file
    cannot be written.
    """
    import av

    options = {"movflags": "+faststart"}
    with atomic_write(path) as whole, av.open(str(whole), "w", format="mp4", options=options) as target:
        stream, shift = None, 0
        for part in parts:
            with av.open(str(part), format="mp4") as source:
                track = source.streams.video[0]
                stream = stream or target.add_stream_from_template(track)
                shift = _copy(source.demux(track), target, stream, shift)


def _copy(packets: Iterable[Any], target: Any, stream: Any, shift: int) -> int:
    """Write packets to a `stream` of the `target`, later by a `shift`; return when the last ends, in its ticks."""
    end = shift
    for packet in packets:
        if packet.dts is None or packet.pts is None:
            continue
        packet.pts, packet.dts = packet.pts + shift, packet.dts + shift
        end = max(end, packet.pts + max(packet.duration or 0, 1))
        packet.stream = stream
        target.mux(packet)
    return end


write = VideoWriter
