"""A number that is none ends a run with a sentence, costs nothing to find, and leaves the last good state."""

import json

import numpy as np
import pytest
from attacks import POOL

import wavetank as wt
from wavetank.device.compiler import download
from wavetank.session.session import Session


def poisoned(sim: wt.Simulation, name: str, value: float, place: int = 7) -> int:
    """Put a number that is none among the particles on the device, as a step might, and return whose it is."""
    array = getattr(sim.world.particles, name)
    rows = download(array).copy()
    rows[place] = value
    array.from_numpy(rows)
    return int(download(sim.world.particles.id)[place])


@pytest.mark.parametrize("value", [np.nan, -np.nan, np.inf, -np.inf, 1e30])
@pytest.mark.parametrize("name", ["v", "x"])
def test_a_step_that_makes_what_is_no_number_says_who_and_when(name, value):
    if name == "x" and value == 1e30:
        return
    sim = wt.Simulation(wt.Scene.from_text(POOL))
    for _ in range(3):
        sim.step()
    number = poisoned(sim, name, value)
    with pytest.raises(wt.WavetankError) as report:
        for _ in range(3):
            sim.step()
    text = str(report.value)
    assert "t = 0.0" in text and "\n" not in text
    if name == "v":
        assert text.startswith(f"particle {number} at "), text


def test_a_session_goes_back_to_the_last_good_instant():
    session = Session(wt.Scene.from_text(POOL))
    for _ in range(20):
        session.tick()
    poisoned(session.sim, "v", np.nan)
    for _ in range(3):
        session.tick()
    assert session.paused
    assert any("particle" in note and "is not finite" in note for note in session.notes)
    assert np.isfinite(session.sim.velocities).all()
    assert 0.2 <= session.sim.time <= 20 / 60
    session.paused = False
    before = session.sim.time
    session.tick()
    assert session.sim.time > before


def test_what_is_no_number_is_not_saved(tmp_path):
    sim = wt.Simulation(wt.Scene.from_text(POOL))
    sim.step()
    sim.save(tmp_path / "state.npz")
    good = (tmp_path / "state.npz").read_bytes()
    poisoned(sim, "x", np.nan)
    with pytest.raises(wt.WavetankError, match=r"not written: x\[\d+\] at t = 0.0166667 s is not finite"):
        sim.save(tmp_path / "state.npz")
    assert (tmp_path / "state.npz").read_bytes() == good


def test_a_run_ends_with_its_files_complete(tmp_path, monkeypatch, capsys):
    from wavetank import cli
    from wavetank.simulation.simulation import Simulation

    step, frames = Simulation._advance_frame, []

    def poison(self, duration):
        frames.append(duration)
        if len(frames) == 9:
            poisoned(self, "v", np.nan)
        step(self, duration)

    monkeypatch.setattr(Simulation, "_advance_frame", poison)
    monkeypatch.setattr(
        "sys.argv",
        [
            "wavetank",
            "run",
            "drop-2d",
            "--seconds",
            "1",
            "--out",
            str(tmp_path),
            "--size",
            "64x48",
            "--video",
            "--export",
            "npz",
        ],
    )
    with pytest.raises(SystemExit) as end:
        cli.main()
    said = capsys.readouterr().err
    assert end.value.code == 1
    assert said.splitlines()[-1].startswith("wavetank: particle ")
    import av

    with av.open(str(tmp_path / "drop-2d.mp4")) as film:
        assert len([*film.decode(video=0)]) == 5
    assert len([*tmp_path.glob("*.npz")]) == 5
    assert json.loads((tmp_path / "stats.json").read_text())["last"]["time"] == pytest.approx(8 / 60)
    assert not [*tmp_path.glob(".*")]
