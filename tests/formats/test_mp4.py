import os
import signal
import time

import av
import numpy as np
import pytest

from wavetank.formats import mp4
from wavetank.formats.mp4 import VideoWriter
from wavetank.foundation.errors import WavetankError

COLORS = [(200, 30, 30), (30, 200, 30), (30, 30, 200), (240, 240, 240), (10, 10, 10)]


def decoded(path):
    with av.open(str(path)) as container:
        return container.streams.video[0].average_rate, [
            frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)
        ]


def picture(color, width, height):
    return np.broadcast_to(np.array(color, np.uint8), (height, width, 3)).copy()


@pytest.mark.parametrize("size", [(64, 48), (63, 47), (1, 1)])
def test_a_video_decodes_completely(tmp_path, size):
    with VideoWriter(tmp_path / "a.mp4", *size, fps=30) as video:
        for color in COLORS * 4:
            video.write(picture(color, *size))
    rate, frames = decoded(tmp_path / "a.mp4")
    assert rate == 30
    assert len(frames) == 4 * len(COLORS)
    assert frames[0].shape == (size[1] + size[1] % 2, size[0] + size[0] % 2, 3)
    for frame, color in zip(frames, COLORS * 4, strict=True):
        assert np.abs(frame.reshape(-1, 3).mean(axis=0) - color).max() < 6.0
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mp4"]


def test_the_index_comes_first_and_colours_are_declared(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", 64, 48, fps=29.97) as video:
        video.write(picture(COLORS[0], 64, 48))
    content = (tmp_path / "a.mp4").read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")
    with av.open(str(tmp_path / "a.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.codec_context.colorspace == 1
        assert float(stream.average_rate) == pytest.approx(29.97, abs=1e-3)


def test_an_interrupt_leaves_a_complete_file(tmp_path):
    with pytest.raises(KeyboardInterrupt), VideoWriter(tmp_path / "a.mp4", 64, 48) as video:
        for color in COLORS:
            video.write(picture(color, 64, 48))
        raise KeyboardInterrupt
    assert len(decoded(tmp_path / "a.mp4")[1]) == len(COLORS)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mp4"]


@pytest.fixture
def interrupts():
    """Interrupts are what they are in a terminal: what runs in the background of a script is born without."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_a_second_interrupt_keeps_what_the_encoder_holds_back(tmp_path):
    """Five pictures lie in the encoder and there is no file yet: an interrupt while they are encoded loses none."""
    path = tmp_path / "a.mp4"
    with pytest.raises(KeyboardInterrupt), VideoWriter(path, 64, 48, 30.0) as video:
        drain = video._drain

        def interrupted():
            video._drain = drain
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.3)
            drain()

        video._drain = interrupted
        for k in range(5):
            video.write(picture(COLORS[k], 64, 48))
    assert len(decoded(path)[1]) == 5
    assert [*tmp_path.iterdir()] == [path]


def test_a_second_interrupt_while_the_index_is_put_first_loses_nothing(tmp_path, monkeypatch):
    """The last step makes a file of the one that grew; where it is cut short, that one is the video."""
    path = tmp_path / "a.mp4"

    def interrupted(parts, target):
        with mp4.atomic_write(target):
            raise KeyboardInterrupt

    monkeypatch.setattr(mp4, "join", interrupted)
    with pytest.raises(KeyboardInterrupt), VideoWriter(path, 64, 48, 30.0) as video:
        for color in COLORS:
            video.write(picture(color, 64, 48))
    assert len(decoded(path)[1]) == len(COLORS)
    assert [*tmp_path.iterdir()] == [path]


def test_a_large_video_has_all_its_pictures(tmp_path):
    """The file is made of the one that grew: were they one file, what no buffer holds would be overwritten first."""
    path, rng = tmp_path / "a.mp4", np.random.default_rng(0)
    with VideoWriter(path, 320, 240, 30.0) as video:
        for _ in range(60):
            video.write(rng.integers(0, 255, (240, 320, 3), dtype=np.uint8))
    assert path.stat().st_size > 2_000_000
    assert len(decoded(path)[1]) == 60


def test_stopping_at_once_keeps_all_pictures(tmp_path):
    video = VideoWriter(tmp_path / "a.mp4", 64, 48, 30.0)
    for k in range(5):
        video.write(picture(COLORS[k], 64, 48))
    video.keep()
    video.close()
    assert len(decoded(tmp_path / "a.mp4")[1]) == 5


def test_an_error_leaves_the_old_file_and_nothing_else(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"old")
    with pytest.raises(RuntimeError), VideoWriter(tmp_path / "a.mp4", 64, 48) as video:
        video.write(picture(COLORS[0], 64, 48))
        assert (tmp_path / "a.mp4").read_bytes() == b"old"
        raise RuntimeError
    assert (tmp_path / "a.mp4").read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.mp4"]


def test_no_picture_no_file(tmp_path):
    with VideoWriter(tmp_path / "a.mp4", 64, 48):
        pass
    assert not list(tmp_path.iterdir())


def test_mistakes_are_named(tmp_path):
    with pytest.raises(WavetankError, match="rates"):
        VideoWriter(tmp_path / "a.mp4", 64, 48, fps=0.0)
    with pytest.raises(WavetankError, match="ends with .mp4"):
        VideoWriter(tmp_path / "a.avi", 64, 48)
    with pytest.raises(WavetankError, match="no folder"):
        VideoWriter(tmp_path / "missing" / "a.mp4", 64, 48)
    with VideoWriter(tmp_path / "a.mp4", 64, 48) as video, pytest.raises(WavetankError, match="does not fit"):
        video.write(picture(COLORS[0], 48, 64))
