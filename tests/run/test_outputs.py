"""How large the files of a run are, told before they fill a disk."""

import pytest

from instants import FPS, instants, world
from wavetank.run import outputs
from wavetank.run.outputs import Outputs, bytes_of


@pytest.fixture
def spoken(tmp_path, monkeypatch):
    """What is told of a run of so many frames, of which ten are written."""
    monkeypatch.setattr(outputs, "LARGE", 100_000_000)

    def spoken_(frames: int) -> list[str]:
        told: list[str] = []
        one = next(iter(instants()))
        with Outputs(tmp_path / "w", world(), ("npz", "csv"), fps=FPS, frames=frames, tell=told.append) as files:
            for number in range(12):
                files.write(number, one)
        written = sum(path.stat().st_size for path in tmp_path.iterdir())
        assert bytes_of(files.files) == written
        for text in told:
            assert float(text.split(" about ")[1].split()[0]) == pytest.approx(written / 12 * frames / 1e9, abs=0.06)
        return told

    return spoken_


def test_a_disk_that_would_fill_is_told_of_beforehand(spoken):
    assert len(spoken(1_000_000)) == 1


def test_what_is_small_is_not_worth_a_word(spoken):
    assert spoken(20) == []
