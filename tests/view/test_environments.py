"""Environments by name, a sun that turns, floors; a tank that leans is drawn leaning."""

import numpy as np
import pytest

import wavetank as wt
from wavetank import Box, Camera, Scene, Sphere, Tank, WavetankError
from wavetank.view.environments import ENVIRONMENTS, FLOORS, air_mass, look_of
from wavetank.view.renderer import Renderer

SIZE = (160, 120)
CAMERA = Camera(eye=(0.5, 2.5, 3.0), target=(0.5, 0.0, 0.5))


def picture(frame, camera=CAMERA, **style):
    return Renderer(*SIZE).render(frame, camera, **style).astype(int)


def dry(make_frame, **scene):
    return make_frame(Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)), **scene), np.zeros((0, 3)))


def test_each_environment_and_floor_is_another_picture(make_frame):
    frame = dry(make_frame)
    seen = [picture(frame, view="water", environment=name) for name in ENVIRONMENTS]
    seen += [picture(frame, view="water", floor=name) for name in FLOORS if name != "tiles"]
    for k, one in enumerate(seen):
        assert all(np.abs(one - other).mean() > 1.0 for other in seen[:k])


@pytest.mark.parametrize("name", ENVIRONMENTS)
def test_a_red_ball_is_red_under_any_sky(name, make_frame):
    ball = Sphere(center=(0.5, 0.3, 0.5), radius=0.2, color="#d02020")
    red, green, _ = picture(dry(make_frame, solids=[ball]), view="water", environment=name)[52:60, 76:84].mean((0, 1))
    assert red > green + 60


def test_the_shadow_turns_with_the_sun(make_frame):
    """A post's shadow points away from the sun, and is 1 / tan(elevation) of its height long."""
    post = Box(center=(0.5, 0.2, 0.5), size=(0.16, 0.4, 0.16))
    frame = dry(make_frame, solids=[post])
    above = Camera(eye=(0.5, 6.0, 0.5), target=(0.5, 0.0, 0.5), up=(0.0, 0.0, -1.0), height=3.0)
    for azimuth, toward in ((90.0, (-1, 0)), (0.0, (0, -1)), (200.0, None)):
        lit = picture(frame, above, view="water", floor="plain", sun=f"{azimuth},35").sum(axis=2)
        angle = np.radians(azimuth)
        way = np.array([-np.sin(angle), -np.cos(angle)])
        assert toward is None or np.allclose(way, toward, atol=1e-9)
        inside, beyond = (0.5 + share * 0.4 / np.tan(np.radians(35)) * way for share in (0.75, 1.4))
        values = []
        for x, z in (inside, beyond):
            column, row, _ = above.project(np.array([x, 0.0, z]), *SIZE)[0]
            values.append(lit[int(row), int(column)])
        assert values[0] < values[1] - 120


def test_a_scene_names_its_light_and_a_picture_overrides_it(make_frame):
    plain, sky = dry(make_frame), dry(make_frame, light={"environment": "sky", "floor": "sand"})
    asked = picture(plain, view="water", environment="sky", floor="sand")
    assert (picture(sky, view="water") == asked).all()
    assert (picture(sky, view="water", environment="pool", floor="tiles") == picture(plain, view="water")).mean() > 0.99
    assert Scene.from_text(sky.scene.text()).light == sky.scene.light


def test_a_low_sun_is_red(make_frame):
    """Kasten and Young: the air mass is 1 overhead, 2 at 30 degrees (1.994), 10.3 at 5 degrees."""
    assert air_mass(90.0) == pytest.approx(1.0, abs=1e-3)
    assert air_mass(30.0) == pytest.approx(1.994, abs=2e-3)
    assert air_mass(5.0) == pytest.approx(10.3, abs=0.1)
    high, low = look_of("sky", 0.0, 60.0), look_of("sky", 0.0, 8.0)
    assert low.sun[0] / low.sun[2] > 2.0 * high.sun[0] / high.sun[2]


@pytest.mark.parametrize(
    "wrong", [{"environment": "attic"}, {"floor": "lava"}, {"sun": "40"}, {"sun": "40,91"}, {"sun": "nan,30"}]
)
def test_what_is_refused(wrong, make_frame):
    with pytest.raises(WavetankError, match=next(iter(wrong))):
        picture(dry(make_frame), **wrong)
    if next(iter(wrong)) != "sun":
        with pytest.raises(WavetankError, match=next(iter(wrong))):
            Scene(light=wrong)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_tank_that_leans_is_drawn_leaning(dim):
    """Gravity, which a tilted tank has turned, points straight down in the picture, and the box stands in it whole."""
    size, upper = ((1.0, 0.8), (1.0, 0.3)) if dim == 2 else ((1.0, 0.8, 0.3), (1.0, 0.3, 0.3))
    fluids = [wt.Block(lower=(0,) * dim, upper=upper)]
    sim = wt.Simulation(Scene(spacing=0.05, tank=Tank(size=size, tilt=0.3), fluids=fluids))
    sim.advance(0.1)
    shot = Renderer(320, 240).shot(sim.frame())
    g = np.append(sim.gravity, [0.0] * (3 - dim))
    assert abs(g[0]) > 2.0, "in the tank's own frame the water is pulled aside"
    assert abs(float(np.asarray(shot.lens.right) @ g)) < 1e-3
    assert float(np.asarray(shot.lens.up) @ g) < -5.0
    corners = shot.extent.corners - np.asarray(shot.lens.eye)
    depth = corners @ np.asarray(shot.lens.forward)
    scale = shot.lens.focal / (depth if shot.lens.perspective else 1.0)
    assert np.abs(scale * (corners @ np.asarray(shot.lens.right))).max() < 160
    assert np.abs(scale * (corners @ np.asarray(shot.lens.up))).max() < 135


def test_the_light_is_no_part_of_the_digest():
    scene = Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0)), fluids=[wt.Block(lower=(0, 0), upper=(0.4, 0.4))])
    lit = scene.changed(light={"environment": "evening"})
    assert wt.Simulation(scene).digest() == wt.Simulation(lit).digest()
