from types import SimpleNamespace

import numpy as np
import pytest

from wavetank import Block, Box, HalfSpace, Scene, Tank
from wavetank.device import compiler
from wavetank.foundation.errors import WavetankError
from wavetank.simulation.simulation import Simulation
from wavetank.view import renderer as module
from wavetank.view.camera import Camera
from wavetank.view.passes import caustics, ellipsoids, solids
from wavetank.view.renderer import Renderer, render
from wavetank.view.style import Style
from wavetank.view.views import VIEWS

SIZE = (96, 64)


def test_a_picture_is_bytes_of_the_asked_size(splash):
    for supersample in (1, 2, 3):
        image = Renderer(97, 53, supersample).render(splash)
        assert image.shape == (53, 97, 3)
        assert image.dtype == np.uint8
        assert image.std() > 5.0


def test_a_picture_is_ours_to_keep(splash):
    renderer = Renderer(*SIZE)
    image = renderer.render(splash)
    before = image.copy()
    renderer.render(splash, color_by="density", camera=Camera(eye=(3, 3, 3), target=(0, 0, 0)))
    assert (image == before).all()


@pytest.mark.parametrize("view", VIEWS)
def test_pictures_repeat_bit_for_bit(splash, view):
    first = Renderer(*SIZE, 2)
    image = first.render(splash, view=view)
    first.render(splash, view=view, camera=Camera(eye=(0.5, 0.5, 0.5), target=(0, 0, 0)))
    assert (first.render(splash, view=view) == image).all()
    assert (Renderer(*SIZE, 2).render(splash, view=view) == image).all()


@pytest.mark.parametrize("view", ["water", "particles"])
def test_the_order_of_particles_does_not_matter(make_frame, splash, view):
    order = np.random.default_rng(2).permutation(splash.count)
    shuffled = make_frame(splash.scene, splash.positions[order], splash.velocities[order], splash.densities[order])
    ids = shuffled.id.to_numpy()
    ids[: splash.count] = order
    shuffled.id.from_numpy(ids)
    renderer = Renderer(*SIZE)
    assert (renderer.render(shuffled, view=view) == renderer.render(splash, view=view)).all()


def test_water_that_rests_is_looked_at_from_all_sides_for_less(monkeypatch):
    """From the third picture of a moment on, its shape and the sun in it are kept; what moves or changes is seen."""
    sim = Simulation(Scene.load("drop").changed(spacing=0.05))
    renderer, eyes = (
        Renderer(*SIZE),
        [Camera(eye=(3.0 * np.sin(a), 1.5, 3.0 * np.cos(a)), target=(0.4, 0.3, 0.4)) for a in (0.1, 0.4, 0.7, 1.0)],
    )
    fitted = []
    monkeypatch.setattr(ellipsoids, "fit", lambda *a, fit=ellipsoids.fit: (fitted.append(1), fit(*a)))
    for eye in eyes:
        np.testing.assert_array_equal(renderer.render(sim.frame(), eye), Renderer(*SIZE).render(sim.frame(), eye))
    assert len(fitted) == len(eyes) + 2
    sim.step()
    for change in (
        lambda: None,
        lambda: None,
        lambda: None,
        sim.step,
        lambda: sim.remove(range(40)),
        lambda: sim.paint_inside(np.zeros(3), np.ones(3), 0.2, 127 << 24 | 0xE0446A),
    ):
        change()
        image = renderer.render(sim.frame(), eyes[0])
        np.testing.assert_array_equal(image, Renderer(*SIZE).render(sim.frame(), eyes[0]))


def test_shadows_of_solids_wait_for_the_solids_not_for_the_eye(monkeypatch):
    scene = Scene.load("drop").changed(spacing=0.06, solids=[Box(name="box", center=(0.2, 0.1, 0.2), size=(0.1,) * 3)])
    sim, renderer, casts = Simulation(scene), Renderer(*SIZE), []

    def trace(*args, trace=solids.trace) -> None:
        casts.extend([1] * (args[-1] == 0))  # not drawn, but seen by the sun
        trace(*args)

    monkeypatch.setattr(solids, "trace", trace)

    def look(angle: float, view: str = "water") -> int:
        eye = Camera(eye=(3.0 * np.sin(angle), 1.5, 3.0 * np.cos(angle)), target=(0.4, 0.3, 0.4))
        before = len(casts)
        image, cast = renderer.render(sim.frame(), eye, view=view), len(casts) - before
        np.testing.assert_array_equal(image, Renderer(*SIZE).render(sim.frame(), eye, view=view))
        return cast

    look(0.1)
    assert [look(angle) for angle in (0.4, 0.7, 1.0)] == [0, 0, 0]
    sim.move("box", (0.3, 0.1, 0.2))
    sim.step()
    assert look(1.0) == 1
    assert look(1.0, "particles") == 1  # which puts particles into the same map
    assert look(1.0) == 1


def test_in_haste_the_sun_looks_at_moving_water_every_second_time(monkeypatch):
    sim, renderer, looks = Simulation(Scene.load("drop").changed(spacing=0.06)), Renderer(*SIZE), []
    monkeypatch.setattr(caustics, "gather", lambda *a, gather=caustics.gather: (looks.append(1), gather(*a)))

    def count(**options) -> int:
        before = len(looks)
        sim.step()
        renderer.render(sim.frame(), **options)
        return len(looks) - before

    assert [count() for _ in range(2)] == [1, 1]
    assert sum(count(hasty=True) for _ in range(6)) == 3
    while count(hasty=True):
        pass
    for _ in range(2):  # where the water came to rest, its light is that of this moment
        image = renderer.render(sim.frame(), hasty=True)
    np.testing.assert_array_equal(image, Renderer(*SIZE).render(sim.frame(), hasty=True))


EYES = {
    "framing": None,
    "inside": Camera(eye=(0.5, 0.5, 0.5), target=(0.1, 0.4, 0.2)),
    "away": Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 6.0)),
    "below": Camera(eye=(0.5, -1.0, 2.0), target=(0.5, 0.5, 0.5)),
    "on the floor": Camera(eye=(2.0, 0.0, 2.0), target=(0.5, 0.0, 0.5)),
    "straight down": Camera(eye=(0.5, 4.0, 0.5), target=(0.5, 0.0, 0.5)),
    "flat": Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.5), height=2.0),
    "very far": Camera(eye=(0.0, 0.0, 9e3), target=(0.0, 0.0, 0.0)),
}


@pytest.mark.parametrize("eye", EYES)
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("count", [0, 1, 300])
@pytest.mark.parametrize("tank", [True, False])
@pytest.mark.parametrize("view", VIEWS)
def test_nothing_breaks_from_any_eye(make_frame, eye, dim, count, tank, view):
    solids = [
        Box(center=(0.4, 0.1, 0.5)[:dim], size=(0.2, 0.2, 0.3)[:dim]),
        HalfSpace(point=(0.8, 0.0, 0.0)[:dim], normal=(-1.0, 1.0, 0.0)[:dim]),
    ]
    scene = Scene(
        spacing=0.05,
        tank=Tank(size=(1.0, 1.0, 1.0)[:dim]) if tank else None,
        solids=solids,
        gravity=(0.0, -9.81, 0.0)[:dim],
    )
    frame = make_frame(scene, np.random.default_rng(0).uniform(0.1, 0.9, (count, dim)))
    renderer = Renderer(*SIZE)
    image = renderer.render(frame, camera=EYES[eye], view=view)
    assert image.shape == (SIZE[1], SIZE[0], 3)
    assert np.isfinite(renderer.buffers.pixels.color.to_numpy()).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1), (3, 3)])
@pytest.mark.parametrize("view", VIEWS)
def test_tiny_pictures(splash, size, view):
    assert Renderer(*size).render(splash, view=view).shape == (size[1], size[0], 3)


def test_particles_that_are_no_numbers_are_survived(make_frame, tank_scene):
    x = np.full((6, 3), 0.5)
    x[1], x[2], x[3], x[4, 0] = np.nan, np.inf, 1e30, -np.inf
    frame = make_frame(tank_scene, x, velocities=np.full((6, 3), np.nan), densities=np.full(6, np.nan))
    for quantity in ("speed", "density"):
        image = Renderer(*SIZE).render(frame, color_by=quantity)
        assert image.shape == (SIZE[1], SIZE[0], 3)
    for view in VIEWS:
        assert Renderer(*SIZE).render(frame, view=view).shape == (SIZE[1], SIZE[0], 3)


def centre_color(make_frame, scene, velocity=0.0, density=1000.0, **options):
    frame = make_frame(scene, [(0.5, 0.5, 0.5)], [(velocity, 0.0, 0.0)], [density])
    camera = Camera(eye=(0.5, 0.9, 2.0), target=(0.5, 0.5, 0.5))
    image = Renderer(64, 64).render(frame, camera=camera, radius=3.0, legend=False, **options)
    return image[28:36, 28:36].reshape(-1, 3).mean(axis=0)


def test_colours_follow_the_quantity(make_frame, tank_scene):
    slow, fast = (centre_color(make_frame, tank_scene, velocity=v, limits=(0.0, 2.0)) for v in (0.0, 2.0))
    assert slow[2] > 2.0 * slow[0]  # blue
    assert fast.min() > 180  # nearly white
    low, rest, high = (
        centre_color(make_frame, tank_scene, density=rho, color_by="density") for rho in (900.0, 1000.0, 1100.0)
    )
    assert low[2] > 1.5 * low[0]
    assert high[0] > 1.5 * high[2]
    assert np.ptp(rest) < 40
    red, green, blue = centre_color(make_frame, tank_scene, color_by="#20c040")
    assert green > 1.5 * max(red, blue)
    assert tuple(centre_color(make_frame, tank_scene, velocity=2.0, colormap="viridis", limits=(0, 2))) != tuple(fast)


def test_a_renderer_changes_its_colours(splash):
    renderer = Renderer(*SIZE)
    first = renderer.render(splash, colormap="viridis", legend=False)
    assert (renderer.render(splash, colormap="ember", legend=False) != first).any()
    assert (renderer.render(splash, color_by="#ff0000", legend=False) != first).any()
    assert (renderer.render(splash, colormap="viridis", legend=False) == first).all()


def test_limits_of_the_scene_are_round_and_do_not_change_with_time(splash):
    shot = Renderer(*SIZE).shot(splash, None, Style(color_by="speed"))
    assert shot.limits == (0.0, 3.0)
    weightless = Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0)), gravity=(0.0, 0.0, 0.0))
    assert module.QUANTITIES["speed"].limits(weightless) == (0.0, 1.0)


def test_the_legend_stays_in_its_corner(splash):
    renderer = Renderer(480, 270)
    bare, written = (renderer.render(splash, view="particles", legend=on) for on in (False, True))
    changed = (bare != written).any(axis=2)
    assert changed[200:, :200].mean() > 0.2
    assert not changed[:200].any()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"color_by": "spede"}, "speed"),
        ({"color_by": "#12"}, "rrggbb"),
        ({"colormap": "jet"}, "viridis"),
        ({"limits": (1.0, 1.0)}, "limits"),
        ({"limits": (0.0, float("nan"))}, "limits"),
        ({"limits": (1.0,)}, "limits"),
        ({"limits": "auto"}, "limits"),
        ({"radius": 0.0}, "radius"),
        ({"radius": "big"}, "radius"),
        ({"view": "watr"}, "water, particles, slice, foam"),
        ({"view": "water", "color_by": "speed"}, "does not go with"),
        ({"view": "slice", "cut": "w"}, "cut"),
        ({"view": "slice", "cut": "z=inf"}, "cut"),
        ({"view": "slice", "cut": ""}, "cut"),
        ({"view": "slice", "cut": "z=1.2"}, "from 0 to 1 m"),
        ({"view": "water", "cut": "z=0.5"}, "does not go with"),
        ({"samples": 0}, "samples"),
        ({"colour_by": "speed"}, "no option 'colour_by'; did you mean 'color_by'"),
        ({"xyz": 1}, "no option 'xyz'; options are view, color_by"),
    ],
)
def test_mistakes_are_named(splash, options, message):
    with pytest.raises(WavetankError, match=message):
        Renderer(*SIZE).render(splash, **options)


@pytest.mark.parametrize("wrong", [(0, 10), (10, 10_000), (1.5, 10), (10, 10, 5), (10, True)])
def test_impossible_sizes_are_refused(wrong):
    with pytest.raises(WavetankError, match="whole number"):
        Renderer(*wrong)


def test_render_takes_frames_and_whatever_has_one(splash):
    world = SimpleNamespace(frame=lambda measured: splash)
    image = render(world, *SIZE)
    assert (image == render(splash, *SIZE)).all()
    assert (image == Renderer(*SIZE, 2).render(splash)).all()
    assert (render(splash, *SIZE, quality="draft") == Renderer(*SIZE, 1).render(splash)).all()
    with pytest.raises(WavetankError, match="quality = 'best' is not known; use one of draft, standard, high, film"):
        render(splash, *SIZE, quality="best")
    with pytest.raises(WavetankError, match="int"):
        render(3)


def test_renderers_are_kept_but_not_without_end(splash):
    for width in range(20, 20 + 2 * module.KEPT_RENDERERS):
        render(splash, width, 20)
    assert len(module._kept) <= module.KEPT_RENDERERS
    kept = module._kept[(width, 20, 2)]
    render(splash, width, 20)
    assert module._kept[(width, 20, 2)] is kept


def test_neighbours_are_searched_for_only_where_densities_are_seen():
    sim = Simulation(Scene(spacing=0.1, tank=Tank(size=(1, 1, 1)), fluids=[Block(lower=(0, 0, 0), upper=(1, 0.4, 1))]))
    sim.step()
    names: list[str] = []

    def around(module, name, launch):
        names.append(name)
        return launch()

    with compiler.watched(around):
        render(sim, 32, 18)
        assert "light_backdrop" in names and "list_neighbors" not in names
        render(sim, 32, 18, view="particles", color_by="density")
        assert "list_neighbors" in names
