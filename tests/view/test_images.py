"""Solids at a seam, as pictures show them."""

import numpy as np

import wavetank as wt
from wavetank.view.images import Images


def frame(**changes):
    ball = wt.Sphere(center=(1.95, 0.2, 0.5), radius=0.15, color="#ff0000", name="ball", **changes)
    stone = wt.Sphere(center=(0.7, 0.1, 0.5), radius=0.1, color="#00ff00")
    tank = wt.Tank(size=(2.0, 0.6, 1.0), periodic=["x"])
    sim = wt.Simulation(
        wt.Scene(spacing=0.05, tank=tank, solids=[ball, stone], fluids=[wt.Block(lower=(0, 0, 0), upper=(2, 0.1, 1))])
    )
    return sim, sim.frame()


def test_a_ball_is_cut_at_the_seam_and_goes_on_at_the_other_side():
    _, plain = frame()
    shown = Images().within(plain)
    assert shown.solids.count == plain.solids.count + 1
    ball, stone, image = shown.scene.solids
    assert stone is plain.scene.solids[1]
    assert [ball.color, image.color] == ["#ff0000", "#ff0000"]
    assert ball.origin[0] == 1.95
    np.testing.assert_allclose(image.origin, [-0.05, 0.2, 0.5])
    boxes = [one.solid.parts[0].radius for one in shown.placed if one.solid.shape == "difference"]
    assert boxes == [0.15, 0.15]


def test_images_are_made_anew_only_where_something_moves():
    sim, plain = frame(motion={"position": ["1.95 + 0.1*t", "0.2", "0.5"]})
    images = Images()
    first = images.within(plain)
    assert images.within(sim.frame()).solids is first.solids
    sim.step()
    moved = images.within(sim.frame())
    assert moved.solids is not first.solids
    assert moved.scene.solids[2].origin[0] > first.scene.solids[2].origin[0]


def test_a_solid_that_has_left_by_whole_lengths_is_shown_within():
    sim, _ = frame(motion={"position": ["1.95 + 240*t", "0.2", "0.5"]})
    sim.step()  # by 4 m, twice the length of the tank
    ball, _, image = Images().within(sim.frame()).scene.solids
    np.testing.assert_allclose([ball.origin[0], image.origin[0]], [1.95, -0.05], atol=1e-5)


def test_worlds_without_a_seam_are_shown_as_they_are():
    scene = wt.Scene.load("obstacle-tank").changed(spacing=0.05)
    plain = wt.Simulation(scene).frame()
    assert Images().within(plain) is plain


def test_both_halves_are_in_the_picture():
    sim, _ = frame()
    picture = wt.render(sim, width=320, height=180, view="particles").astype(int)
    red = (picture[..., 0] > picture[..., 1] + 60) & (picture[..., 0] > picture[..., 2] + 60)
    columns = np.flatnonzero(red.any(axis=0))
    assert red.sum() > 60
    assert np.diff(columns).max() > 60, "at both ends of the tank"
