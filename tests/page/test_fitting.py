"""What this machine is expected to compute, links that last, and meshes that are dropped."""

import pytest

import wavetank as wt
from wavetank.foundation.errors import WavetankError
from wavetank.page.dropped import command_for
from wavetank.page.fitting import expected_pace, fits, real_time_particles
from wavetank.page.play import _checked_token
from wavetank.page.units import digits, units
from wavetank.session.session import Session


def test_fewer_particles_are_faster_and_what_fits_runs_in_real_time():
    scene = wt.Scene.load("obstacle-tank")
    paces = [expected_pace(scene, count, 1.2e-6) for count in (1_000, 5_000, 20_000, 80_000)]
    assert paces == sorted(paces, reverse=True)
    assert paces[-1] < 0.2
    fit = real_time_particles(scene, 1.2e-6)
    assert expected_pace(scene, fit, 1.2e-6) == pytest.approx(1.0, abs=0.05)
    assert expected_pace(scene, 1.5 * fit, 1.2e-6) < 0.95
    assert real_time_particles(scene, 0.5e-6) > fit, "a faster machine has room for more"


def test_a_level_and_points_have_no_slider():
    assert fits(Session(wt.Scene.load("over-the-wall")))["here"] == []
    told = fits(Session(wt.Scene.load("drop-2d")))
    spacings = [choice["spacing"] for choice in told["here"]]
    assert spacings == sorted(spacings, reverse=True)
    assert len(told["scenes"]) > 20


@pytest.mark.parametrize("token", ["short", "with a space in it", "ä" * 20])
def test_a_token_that_anyone_could_guess_is_refused(token):
    with pytest.raises(WavetankError, match="--token"):
        _checked_token(token)
    assert _checked_token("abcdef-0123456789") == "abcdef-0123456789"


def test_units_are_worth_what_they_say():
    """L is the world's length, sqrt(g L) its speed, sqrt(g / L) its frequency."""
    told = units(4.0, 3)
    assert told["L"] == (4.0, "m")
    assert told["√(gL)"][0] == pytest.approx(6.264, abs=1e-3)
    assert told["√(g/L)"][0] == pytest.approx(1.566, abs=1e-3)
    assert told["cubes"] == (pytest.approx(9810.0), "N")
    assert units(0.5, 2)["L"] == (50.0, "cm")


def test_numbers_have_no_powers_of_ten():
    told = [digits(value) % value for value in (0.0, 0.08, 9.81, 1000.0, 200_000.0, 1e-5, 1.5e-4)]
    assert told == ["0", "0.08", "9.81", "1000", "200000", "0.0000100", "0.000150"]


def test_a_mesh_that_is_none_is_named():
    flat = Session(wt.Scene.load("drop-2d"))
    with pytest.raises(WavetankError, match=r"^a\.obj: a mesh needs a 3-D world"):
        command_for(flat, "v 0 0 0", "a.obj")
    box = Session(wt.Scene(spacing=0.1, tank=wt.Tank(size=(1, 1, 1))))
    for text, word in (("", "no mesh"), ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9", "no mesh"), ("v 0 0", "b.obj")):
        with pytest.raises(WavetankError, match=word):
            command_for(box, text, "b.obj")
