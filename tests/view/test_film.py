"""The path tracer: laws of optics against their closed forms, light that is not lost, bits that repeat."""

import dataclasses
import math
import os
import subprocess
import sys

import numpy as np
import pytest

import wavetank as wt
from wavetank.device.compiler import download, qd, upload
from wavetank.view.film import denoise, light, paths
from wavetank.view.film.medium import Medium, medium_of
from wavetank.view.film.samples import Watch
from wavetank.view.film.tracer import Tracer
from wavetank.view.lens import vec2, vec3, vec4, vector
from wavetank.view.optics.interface import bent
from wavetank.view.renderer import Renderer
from wavetank.view.style import Style

ETA = 1.33


@qd.kernel
def bend_all(found: qd.types.ndarray(), ahead: qd.types.ndarray(), eta: qd.f32, count: qd.i32):
    for k in range(count):
        found[k] = bent(ahead[k], vec3(0.0, 1.0, 0.0), eta)


def full_tank(**fluid):
    scene = wt.Scene(
        spacing=0.1, tank=wt.Tank(size=(1.0, 1.0, 0.6)), fluids=[wt.Block(lower=(0, 0, 0), upper=(1.0, 0.8, 0.6))]
    )
    return wt.Simulation(scene.changed(**fluid) if fluid else scene).frame()


def shot_of(frame, size=(8, 8), eye=(0.5, 0.4, 3.0), target=(0.5, 0.4, 0.3), **style):
    renderer = Renderer(*size, 1)
    camera = wt.Camera(eye=eye, target=target, field_of_view=math.radians(2.0))
    return renderer, renderer.shot(frame, camera, Style(**style))


def in_white(look):
    """The same light, the same from everywhere."""
    white, black = vector(1.0, 1.0, 1.0), vector(0.0, 0.0, 0.0)
    return dataclasses.replace(
        look,
        outdoors=0,
        horizon=white,
        zenith=white,
        below=white,
        sky=white,
        sun=black,
        line_strength=0.0,
        paving=0,
        tile=0.0,
        floor=white,
    )


def clear_medium(*absorption):
    """Water that adds nothing and absorbs so much [1/m]."""
    black = vector(0.0, 0.0, 0.0)
    nothing = [qd.ndarray(vec3, shape=(1,)) for _ in range(2)]
    return Medium(
        vector(*absorption) if absorption else black,
        0.0,
        black,
        *nothing,
        0,
        qd.ndarray(vec4, shape=(1,)),
        qd.ndarray(vec3, shape=(1,)),
        0,
    )


def mean_radiance(shot, renderer, medium, samples=256):
    tracer = Tracer(renderer.buffers)
    world = tracer._world(shot, 0.0, 0.0)
    photons = tracer._trace_photons(shot, world, medium, 0, 1)
    setting = dataclasses.replace(tracer.setting(shot, 0.0, None), brightest=1e9)
    paths.trace(tracer.film, world, photons, shot.lens, shot.look, medium, setting, 0, samples, samples // 2)
    return download(tracer.film.mean)


def test_the_surface_bends_and_mirrors_as_snell_and_fresnel_say():
    angles = np.radians(np.linspace(0.0, 89.0, 90))
    ahead, found = qd.ndarray(vec3, shape=(90,)), qd.ndarray(vec4, shape=(90,))
    upload(ahead, np.stack([np.sin(angles), -np.cos(angles), 0 * angles], axis=1).astype(np.float32))
    for eta in (1.0 / ETA, ETA):
        bend_all(found, ahead, eta, 90)
        got = download(found)
        sine = eta * np.sin(angles)
        total = sine >= 1.0
        cosi, cost = np.cos(angles), np.sqrt(np.maximum(1.0 - sine**2, 0.0))
        s = ((eta * cosi - cost) / (eta * cosi + cost)) ** 2
        p = ((eta * cost - cosi) / (eta * cost + cosi)) ** 2
        np.testing.assert_allclose(got[:, 3], np.where(total, 1.0, 0.5 * (s + p)), atol=2e-4)
        np.testing.assert_allclose(got[~total, 0], sine[~total], atol=1e-4)
        np.testing.assert_allclose(got[~total, 1], -cost[~total], atol=3e-4)


@pytest.mark.parametrize("absorption", [0.0, 2.0])
def test_a_slab_of_water_dims_a_white_world_as_its_closed_form(absorption):
    """Between parallel panes: F + (1 - F)^2 T / (1 - F T), with T of Beer and Lambert (incoherent slab)."""
    renderer, shot = shot_of(full_tank())
    shot = dataclasses.replace(shot, look=in_white(shot.look))
    medium = clear_medium(absorption, 0.0, 0.5 * absorption)
    mirror = ((ETA - 1.0) / (ETA + 1.0)) ** 2
    left = np.exp(-0.6 * np.array([absorption, 0.0, 0.5 * absorption]))
    expected = mirror + (1.0 - mirror) ** 2 * left / (1.0 - mirror * left)
    np.testing.assert_allclose(mean_radiance(shot, renderer, medium).mean(axis=(0, 1)), expected, atol=2e-3)


def test_a_layer_of_dye_dims_as_beer_and_lambert_say():
    """Half of the tank is dyed: what crosses that half alone sees the dye's absorption."""
    sim = wt.Simulation(
        wt.Scene(
            spacing=0.05,
            tank=wt.Tank(size=(1.0, 1.0, 0.6)),
            fluids=[
                wt.Block(lower=(0, 0, 0), upper=(0.5, 0.8, 0.6)),
                wt.Block(lower=(0.5, 0, 0), upper=(1.0, 0.8, 0.6), material="red"),
            ],
            materials=[{"name": "red", "color": "#ff4030"}],
        )
    )
    renderer, shot = shot_of(sim.frame(), eye=(0.8, 0.4, 3.0), target=(0.8, 0.4, 0.3))
    shot = dataclasses.replace(shot, look=in_white(shot.look))
    shot = dataclasses.replace(
        shot, scattering=0.0, look=dataclasses.replace(shot.look, glow=vector(0.0, 0.0, 0.0)), usual=0.6
    )
    tracer = Tracer(renderer.buffers)
    medium = medium_of(shot, tracer._world(shot, 0.0, 0.0).field.grid)
    color = np.array([1.0, (64 / 255 + 0.055) ** 2.4 / 1.055**2.4, (48 / 255 + 0.055) ** 2.4 / 1.055**2.4])
    left = color.clip(0.02, 0.98) ** 2.5  # 0.6 m of it, 2.5 layers as thick as is usual
    mirror = ((ETA - 1.0) / (ETA + 1.0)) ** 2
    expected = mirror + (1.0 - mirror) ** 2 * left / (1.0 - mirror * left)
    np.testing.assert_allclose(mean_radiance(shot, renderer, medium).mean(axis=(0, 1)), expected, atol=4e-3)


@pytest.mark.parametrize("tank", [True, False])
def test_no_water_and_one_drop_have_pictures(tank):
    walls = {"tank": wt.Tank(size=(1.0, 1.0, 1.0))} if tank else {}
    for points in ([], [[0.5, 0.5, 0.5]]):
        scene = wt.Scene(spacing=0.1, fluids=[wt.Points(positions=np.array(points).reshape(-1, 3))], **walls)
        image = wt.render(wt.Simulation(scene), 9, 1, quality="film", samples=1)
        assert image.shape == (1, 9, 3) and image.max() > 0


def stuff(clarity, *, size=(2.0, 1.6, 2.0), **more):
    """A tank of a pale yellow that is not clear, seen from above."""
    scene = wt.Scene(
        spacing=0.1,
        tank=wt.Tank(size=size),
        materials=[{"name": "m", "color": "#e8e6a0", "clarity": clarity, **more}],
        fluids=[wt.Block(lower=(0, 0, 0), upper=(size[0], 1.4, size[2]), material="m")],
    )
    return shot_of(wt.Simulation(scene).frame(), eye=(1.0, 6.0, 1.0), target=(1.0, 1.4, 1.0))


def color_of_stuff():
    return ((np.array([232, 230, 160]) / 255 + 0.055) / 1.055) ** 2.4


@pytest.mark.parametrize("clarity", ["cloudy", "opaque"])
def test_what_is_not_clear_has_its_color_under_even_light(clarity):
    """Saunderson's equation and Chiang's inverse: an endless depth shows the colour, and the surface 2 % more."""
    renderer, shot = stuff(clarity)
    shot = dataclasses.replace(shot, look=in_white(shot.look))
    tracer = Tracer(renderer.buffers)
    medium = medium_of(shot, tracer._world(shot, 0.0, 0.0).field.grid)
    if clarity == "cloudy":  # ten free ways deep
        turbidity = download(medium.turbidity)
        upload(medium.turbidity, (turbidity * 7.0 / turbidity[:, 3:].max()).astype(np.float32))
    mirror = ((ETA - 1.0) / (ETA + 1.0)) ** 2
    seen = mean_radiance(shot, renderer, medium).mean(axis=(0, 1))
    np.testing.assert_allclose(seen, mirror + (1.0 - mirror) * color_of_stuff(), atol=0.05)


def test_light_that_is_scattered_is_neither_lost_nor_made():
    """The white furnace. Paths of more than 40 events lose a half, and each event a thousandth (inverse of 1)."""
    renderer, shot = stuff("cloudy")
    shot = dataclasses.replace(shot, look=in_white(shot.look))
    tracer = Tracer(renderer.buffers)
    medium = medium_of(shot, tracer._world(shot, 0.0, 0.0).field.grid)
    turbidity = download(medium.turbidity)
    upload(medium.turbidity, np.repeat(1.0 * (turbidity[:, 3:] > 0.0), 4, axis=1).astype(np.float32))
    assert 0.95 < mean_radiance(shot, renderer, medium).mean() < 1.002


def test_a_floor_in_the_sun_is_darker_under_water():
    """(1 - F)^2 rho / n^2 / (1 - rho F_i): light is spread where it leaves, and F_i = 0.472 of it comes back down."""
    scene = wt.Scene(
        spacing=0.1, tank=wt.Tank(size=(4.0, 0.6, 4.0)), fluids=[wt.Block(lower=(0, 0, 0), upper=(4.0, 0.4, 4.0))]
    )
    frame = wt.Simulation(scene).frame()
    renderer, shot = shot_of(frame, (64, 64), (2.0, 6.0, 2.0), (2.0, 0.4, 2.0), sun="0,89.5", environment="studio")
    white, black = vector(1.0, 1.0, 1.0), vector(0.0, 0.0, 0.0)
    look = dataclasses.replace(
        in_white(shot.look),
        sun=white,
        sky=black,
        horizon=black,
        zenith=black,
        below=black,
        sparkle=0.0,
        sun_size=1e-3,
        floor=vector(0.3, 0.3, 0.3),
    )
    seen = mean_radiance(dataclasses.replace(shot, look=look), renderer, clear_medium(), 64).mean()
    mirror = ((ETA - 1.0) / (ETA + 1.0)) ** 2
    assert seen == pytest.approx((1.0 - mirror) ** 2 * 0.3 / ETA**2 / (1.0 - 0.472 * 0.3), rel=0.03)


def test_lava_shines_on_what_is_beside_it():
    scene = wt.Scene(
        spacing=0.1,
        tank=wt.Tank(size=(1.0, 1.0, 1.0)),
        materials=[{"name": "m", "color": "#ff4a08", "clarity": "opaque", "glow": 2.0}],
        fluids=[wt.Block(lower=(0, 0, 0), upper=(1.0, 0.8, 1.0), material="m")],
    )
    renderer, shot = shot_of(wt.Simulation(scene).frame(), (16, 16), (0.5, 3.0, 1.4), (0.5, 0.0, 1.4))
    black = vector(0.0, 0.0, 0.0)
    look = dataclasses.replace(in_white(shot.look), sky=black, horizon=black, zenith=black, below=black)
    shot = dataclasses.replace(shot, look=look)
    tracer = Tracer(renderer.buffers)
    medium = medium_of(shot, tracer._world(shot, 0.0, 0.0).field.grid)
    seen = mean_radiance(shot, renderer, medium).mean(axis=(0, 1))
    # The floor at `a` before a wall of the height `h` sees it by (1 - a / sqrt(a^2 + h^2)) / 2, were it endless.
    most = 0.5 * (1.0 - 0.4 / math.hypot(0.4, 0.8)) * 2.0
    assert 0.5 * most < seen[0] < most and seen[1] < 0.2 * seen[0]


def furnace_of(**solid):
    """A wall before a white world: what is seen of it, and what it is made of."""
    wall = wt.Box(center=(0.5, 9.0, 1.5), size=(2.0, 2.0, 0.1), color="#c98a4b", **solid)
    scene = wt.Scene(
        spacing=0.1, tank=wt.Tank(size=(1.0, 1.0, 1.0)), fluids=[wt.Points(positions=[[0.5, 0.5, 0.5]])], solids=[wall]
    )
    renderer, shot = shot_of(wt.Simulation(scene).frame(), eye=(0.5, 9.0, 4.0), target=(0.5, 9.0, 1.5))
    shot = dataclasses.replace(shot, look=in_white(shot.look))
    return mean_radiance(shot, renderer, clear_medium(), 512).mean(axis=(0, 1))


BRONZE = ((np.array([201, 138, 75]) / 255 + 0.055) / 1.055) ** 2.4


def test_metal_mirrors_a_white_world_in_its_color():
    """Schlick's mirror seen straight on is the colour; of facets of that slope a 32nd mirrors into the metal (GGX)."""
    seen = furnace_of(finish="metal") / BRONZE
    assert np.all(seen > 0.94) and np.all(seen < 1.0)


def test_glass_mirrors_as_a_pane_and_lets_its_color_through():
    """2 F / (1 + F) of a pane (n = 1.5), and the colour of the rest."""
    pane = 2.0 * 0.04 / 1.04
    np.testing.assert_allclose(furnace_of(finish="glass"), pane + (1.0 - pane) * BRONZE, atol=0.01)


def test_metal_shows_the_sun_where_it_mirrors_it():
    """The lobe in the direction of the mirror over all: its sum over the sphere is what a white world shows."""
    ball = wt.Sphere(center=(0.5, 0.5, 0.5), radius=0.4, color="#808080", finish="metal")
    scene = wt.Scene(spacing=0.1, fluids=[wt.Points(positions=[[0.5, 2.5, 0.5]])], solids=[ball])
    frame = wt.Simulation(scene).frame()
    camera = wt.Camera(eye=(0.5, 0.5, 5.0), target=(0.5, 0.5, 0.5), field_of_view=math.radians(14.0))
    options = {"quality": "film", "samples": 8, "camera": camera, "sun": "60,20", "environment": "studio"}
    image = wt.render(frame, 64, 64, **options).astype(int).sum(axis=2)
    row, column = np.unravel_index(image.argmax(), image.shape)
    # Half way between eye and sun: 30 degrees to the right of the middle (10 up).
    assert abs(column - (32 + 64 * 0.4 * math.sin(math.radians(30.0)) / (2 * 4.5 * math.tan(math.radians(7.0))))) < 4
    assert row < 32


def test_glass_is_left_away_by_drafts():
    tank, water = wt.Tank(size=(1.0, 1.0, 1.0)), wt.Block(lower=(0, 0, 0), upper=(1, 0.3, 1))
    ball = {"center": (0.5, 0.7, 0.5), "radius": 0.2}
    bare, glass, matte = (
        wt.render(
            wt.Simulation(wt.Scene(spacing=0.1, tank=tank, fluids=[water], solids=solids)).frame(),
            64,
            48,
            quality="draft",
        )
        for solids in ([], [wt.Sphere(**ball, finish="glass")], [wt.Sphere(**ball)])
    )
    # Light from the floor and in the water still knows of it.
    assert np.abs(glass.astype(int) - bare).mean() < 0.2 * np.abs(matte.astype(int) - bare).mean()


def test_water_and_drops_in_a_white_world_cannot_be_seen():
    """The white furnace: what loses no light, white floor included, is as bright as what is around it."""
    rng = np.random.default_rng(3)
    scattered = wt.Points(positions=rng.uniform(0.1, 0.9, (60, 3)))
    ball = wt.Ball(center=(0.5, 0.5, 0.5), radius=0.3)
    scene = wt.Scene(spacing=0.06, tank=wt.Tank(size=(1.0, 1.0, 1.0)), fluids=[ball, scattered])
    renderer, shot = shot_of(wt.Simulation(scene).frame(), (48, 48), (0.5, 0.9, 3.0), (0.5, 0.5, 0.5))
    camera = wt.Camera(eye=(0.5, 0.9, 3.0), target=(0.5, 0.5, 0.5), field_of_view=math.radians(18.0))
    shot = dataclasses.replace(shot, look=in_white(shot.look), lens=camera.lens(48, 48))
    clear = clear_medium()
    seen = mean_radiance(shot, renderer, clear, 16)
    assert abs(seen.mean() - 1.0) < 0.004
    assert (np.abs(seen - 1.0) > 0.1).mean() < 0.01


def test_the_surface_does_not_show_its_particles():
    """Particles lie a tenth of a spacing off their places, as in water that has settled."""
    rest = full_tank().positions
    places = rest + np.random.default_rng(2).uniform(-0.01, 0.01, rest.shape)
    tank = wt.Tank(size=(1.0, 1.0, 0.6))
    frame = wt.Simulation(wt.Scene(spacing=0.1, tank=tank, fluids=[wt.Points(positions=places)])).frame()
    renderer, shot = shot_of(frame)
    tracer = Tracer(renderer.buffers)
    world = tracer._world(shot, 0.0, 0.0)
    grid = world.field.grid
    level = download(world.field.level).reshape(grid.nz, grid.ny, grid.nx)
    above = (level[:, :-1] > 0.0) & (level[:, 1:] <= 0.0)
    assert np.all(above.sum(axis=1) == 1)  # one surface, without holes, and nothing above it
    j = above.argmax(axis=1)[:, None]
    a, b = (np.take_along_axis(level, j + k, axis=1)[:, 0] for k in (0, 1))
    height = grid.lower[1] + (j[:, 0] + 0.5 + a / (a - b)) * grid.step[1]
    assert np.std(height) < 0.033 * 0.1  # without the blur it is 0.044
    assert abs(height.mean() - 0.8) < 0.05 * 0.1


def test_the_sun_s_light_in_a_tank_is_neither_lost_nor_made():
    """Of what falls on the top (1 - F) arrives on the floor, as panes mirror it totally; and all that a pane gets.

    What a pane mirrors falls on the floor before it.
    """
    renderer, shot = shot_of(full_tank(), sun="0,80", environment="pool")
    shot = dataclasses.replace(shot, look=dataclasses.replace(shot.look, sun_size=1e-4))
    tracer = Tracer(renderer.buffers)
    world = tracer._world(shot, 0.0, 0.0)
    clear = clear_medium()
    photons = tracer._trace_photons(shot, world, clear, 0, 1)
    arrived = download(photons.floor)[..., 1].sum() / light.UNIT * float(photons.corner[1]) ** 2
    height = math.sin(math.radians(80.0))
    top, side = 1.0 * 0.6 * height, 1.0 * 0.8 * math.cos(math.radians(80.0))  # m^2 across the sun's rays
    # Fresnel at 10 degrees is that at 0 to a tenth of a per cent.
    through = top * (1.0 - ((ETA - 1.0) / (ETA + 1.0)) ** 2) + side
    assert arrived == pytest.approx(through, rel=0.01)


def test_what_is_left_of_the_noise_goes_and_edges_stay():
    rng = np.random.default_rng(1)
    shape = (48, 64)
    film = paths.Film(
        mean=qd.ndarray(vec3, shape=shape),
        half=qd.ndarray(vec3, shape=shape),
        albedo=qd.ndarray(vec3, shape=shape),
        shape=qd.ndarray(vec4, shape=shape),
    )
    truth = np.where(np.arange(64) < 32, 0.3, 0.6)[None, :, None] * np.ones((48, 64, 3), np.float32)
    noise = rng.normal(0.0, 0.02, (2, *shape, 1)).astype(np.float32)
    upload(film.mean, (truth + 0.5 * (noise[0] + noise[1])).astype(np.float32))
    upload(film.half, (truth + noise[0]).astype(np.float32))
    spare = (qd.ndarray(vec3, shape=shape), qd.ndarray(vec3, shape=shape), qd.ndarray(vec2, shape=shape))
    clean = download(denoise.denoised(film, spare))
    assert np.abs(clean - truth)[:, :30].std() < 0.3 * 0.02 / math.sqrt(2.0)
    assert np.abs(clean - truth).max() < 0.06  # nothing of the other side of the edge
    upload(film.half, download(film.mean).copy())  # no noise at all: nothing is averaged
    np.testing.assert_allclose(download(denoise.denoised(film, spare)), download(film.mean), atol=2e-3)


def dam():
    scene = wt.Scene(
        spacing=0.08,
        tank=wt.Tank(size=(1.2, 0.8, 0.6)),
        fluids=[wt.Block(lower=(0, 0, 0), upper=(0.5, 0.6, 0.6))],
        solids=[wt.Sphere(center=(0.8, 0.2, 0.3), radius=0.15)],
    )
    sim = wt.Simulation(scene)
    sim.advance(0.2)
    return sim


def test_a_picture_that_was_stopped_goes_on_to_the_same_bits(tmp_path):
    frame = dam().frame()
    options = {"traced": True, "samples": 6, "aperture": 0.01, "shutter": 0.01}
    whole = Renderer(48, 27, 1).render(frame, **options)
    path = tmp_path / "kept.npz"
    watch = Watch(tell=lambda done, of: False, path=path)
    Renderer(48, 27, 1).render(frame, watch=watch, **options)
    assert not watch.whole and 0 < watch.done < 6 and path.exists()
    told = []
    watch = Watch(tell=lambda done, of: told.append(done) or True, path=path)
    again = Renderer(48, 27, 1).render(frame, watch=watch, **options)
    assert watch.begun > 0 and watch.whole and not path.exists()
    assert min(told) > watch.begun  # what was there is not taken again
    np.testing.assert_array_equal(again, whole)


def test_samples_of_another_picture_are_begun_anew(tmp_path):
    frame, path = dam().frame(), tmp_path / "kept.npz"
    stopped = Watch(tell=lambda done, of: False, path=path)
    Renderer(16, 16, 1).render(frame, watch=stopped, traced=True, samples=40)
    watch = Watch(path=path)
    Renderer(16, 16, 1).render(frame, watch=watch, traced=True, samples=2, sun="10,30")
    assert watch.begun == 0


def moving(velocity, motion):
    ball = {"center": (0.5, 0.5, 0.5), "radius": 0.2, "color": "#d02020"}
    body = wt.Sphere(name="ball", **ball, density=500.0, velocity=velocity)
    carried = wt.Sphere(name="ball", **(ball | {"center": ("0.5 + 2*t", 0.5, 0.5)}))
    scene = wt.Scene(
        spacing=0.1,
        gravity=(0, 0, 0),
        fluids=[wt.Points(positions=[[0.5, 2.5, 0.5]])],
        solids=[carried if motion else body],
    )
    camera = wt.Camera(eye=(0.5, 0.5, 5.0), target=(0.5, 0.5, 0.5), field_of_view=math.radians(20.0))
    frame = wt.Simulation(scene).frame()
    return [
        wt.render(frame, 96, 64, quality="film", samples=16, camera=camera, shutter=shutter).astype(int)[32]
        for shutter in (0.0, 0.1)
    ]


@pytest.mark.parametrize("motion", [True, False])
def test_solids_move_while_the_shutter_is_open(motion):
    """At 2 m/s and 0.1 s a ball is smeared over 0.2 m, half of them to each side, and no farther."""
    still, open_for = (row[:, 0] - row[:, 1] for row in moving((2.0, 0.0, 0.0), motion))
    pixel = 2.0 * 4.5 * math.tan(math.radians(10.0)) / 64
    wide = [np.flatnonzero(red > 40) for red in (still, open_for)]
    sharp = wide[0][-1] - wide[0][0]
    assert sharp == pytest.approx(0.4 / pixel, abs=2.5)
    smeared = np.flatnonzero(open_for > 5)  # its ends are there in one of eight instants
    assert smeared[-1] - smeared[0] == pytest.approx((0.4 + 7 / 8 * 0.2) / pixel, abs=4.0)
    assert smeared[-1] - smeared[0] > sharp + 4
    assert abs((smeared[-1] + smeared[0]) - (wide[0][-1] + wide[0][0])) <= 3  # about where it is


PICTURE = """
import hashlib, wavetank as wt
scene = wt.Scene(
    spacing=0.1, tank=wt.Tank(size=(1.2, 0.8, 0.6)), fluids=[
        wt.Block(lower=(0, 0, 0), upper=(0.5, 0.3, 0.6)),
        wt.Block(lower=(0, 0.3, 0), upper=(0.5, 0.6, 0.6), material="m"),
    ],
    materials=[{"name": "m", "clarity": "cloudy", "color": "#e8e6a0"}],
    solids=[wt.Sphere(center=(0.8, 0.2, 0.3), radius=0.15)],
)
sim = wt.Simulation(scene)
sim.advance(0.2)
print(hashlib.sha256(wt.render(sim, 40, 24, quality="film", samples=3, shutter=0.01).tobytes()).hexdigest())
"""


def test_one_thread_and_two_take_the_same_picture():
    found = {
        subprocess.run(
            [sys.executable, "-c", PICTURE],
            env=os.environ | {"QD_CPU_MAX_NUM_THREADS": threads},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for threads in ("1", "2")
    }
    assert len(found) == 1


def test_film_is_for_water_in_space_and_other_pictures_are_averaged():
    flat = wt.Simulation(wt.Scene.load("drop-2d").changed(spacing=0.05))
    high = wt.render(flat, 32, 24, quality="high", samples=2)
    np.testing.assert_array_equal(wt.render(flat, 32, 24, quality="film", samples=2), high)
    with pytest.raises(wt.WavetankError, match="aperture = -1"):
        wt.render(flat, 32, 24, quality="film", aperture=-1)
