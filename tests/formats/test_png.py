import numpy as np
import pytest
from PIL import Image

from wavetank.formats.png import write_png
from wavetank.foundation.errors import WavetankError


def test_pixels_and_texts_come_back(tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (13, 17, 3), np.uint8)
    texts = {"scene": 'title = "Überlauf"\nspacing = 0.02', "time": 0.5}
    write_png(tmp_path / "a.png", image, texts)
    with Image.open(tmp_path / "a.png") as back:
        assert back.mode == "RGB"
        assert (np.asarray(back) == image).all()
        assert back.text == {"scene": texts["scene"], "time": "0.5"}
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.png"]


@pytest.mark.parametrize("image", [np.zeros((4, 4, 3)), np.zeros((4, 4), np.uint8), np.zeros((4, 4, 4), np.uint8)])
def test_what_is_no_picture_is_refused(tmp_path, image):
    with pytest.raises(WavetankError, match="uint8"):
        write_png(tmp_path / "a.png", image)
    assert not list(tmp_path.iterdir())
