import numpy as np
import pytest
from PIL import Image

from wavetank.formats.gif import GifWriter
from wavetank.foundation.errors import WavetankError


def pictures(count, size=(40, 30)):
    return [np.full((size[1], size[0], 3), (10 * k, 200 - 10 * k, 90), np.uint8) for k in range(count)]


def test_a_gif_has_its_pictures_and_its_length(tmp_path):
    path = tmp_path / "a.gif"
    with GifWriter(path, 40, 30, fps=30.0) as film:
        for picture in pictures(7):
            film.write(picture)
    with Image.open(path) as read:
        assert read.n_frames == 7
        assert read.size == (40, 30)
        assert read.info["loop"] == 0
        total = 0
        for number in range(7):
            read.seek(number)
            total += read.info["duration"]
            assert np.abs(np.asarray(read.convert("RGB")).astype(int) - pictures(7)[number]).max() < 12
    assert total == pytest.approx(1000 * 7 / 30, abs=10)


def test_an_error_leaves_nothing(tmp_path):
    with pytest.raises(ValueError, match="on purpose"), GifWriter(tmp_path / "a.gif", 40, 30) as film:
        film.write(pictures(1)[0])
        raise ValueError("on purpose")
    with GifWriter(tmp_path / "b.gif", 40, 30):
        pass
    assert list(tmp_path.iterdir()) == []


def test_mistakes_are_named(tmp_path):
    with pytest.raises(WavetankError, match="50"):
        GifWriter(tmp_path / "a.gif", 40, 30, fps=60)
    with pytest.raises(WavetankError, match="does not fit"), GifWriter(tmp_path / "a.gif", 40, 30) as film:
        film.write(pictures(1, (30, 30))[0])
    with pytest.raises(WavetankError, match="no folder"):
        GifWriter(tmp_path / "none" / "a.gif", 40, 30)
