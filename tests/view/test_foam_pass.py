import numpy as np
import pytest

from wavetank import Camera, Scene, Tank
from wavetank.device.compiler import upload
from wavetank.device.state import new_diffuse
from wavetank.view.renderer import Renderer
from wavetank.view.style import Style
from wavetank.view.views import VIEWS

WIDTH, HEIGHT = 96, 64
FRONT = Camera(eye=(0.5, 0.5, 3.0), target=(0.5, 0.5, 0.5), height=1.2)


def with_foam(frame, positions, kind=2, age=0.2):
    """The frame with foam at `positions`."""
    x = np.asarray(positions, np.float32).reshape(-1, frame.dim)
    diffuse = new_diffuse(frame.dim, len(x) + 3)
    upload(diffuse.x, x)
    for array, value in ((diffuse.kind, kind), (diffuse.age, age), (diffuse.life, 1.0)):
        upload(array, np.full(len(x) + 3, value))
    upload(diffuse.id, np.arange(len(x)))
    vars(frame).update(diffuse=diffuse, foam_count=len(x))
    return frame


def picture(frame, camera=FRONT, size=(WIDTH, HEIGHT), **options):
    return Renderer(*size).render(frame, camera, view="particles", legend=False, **options).astype(int)


def cloud(n=400, center=(0.5, 0.5, 0.5), spread=0.05, seed=0):
    return np.array(center) + np.random.default_rng(seed).normal(0, spread, (n, len(center)))


@pytest.fixture
def wall_of_water(tank_scene, make_frame):
    """A dark sheet of particles across the tank at z = 0.5."""
    x, y = np.meshgrid(np.arange(0.025, 1, 0.05), np.arange(0.025, 1, 0.05))
    return lambda: make_frame(tank_scene, np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.5)], 1))


def test_foam_in_front_is_white(wall_of_water):
    bare = picture(wall_of_water(), color_by="#103060", radius=0.8)
    white = picture(with_foam(wall_of_water(), cloud(900, center=(0.5, 0.5, 0.75))), color_by="#103060", radius=0.8)
    middle = (slice(28, 36), slice(44, 52))
    assert bare[middle].max() < 180
    assert white[middle].mean() > 200
    assert (white[:5] == bare[:5]).all()


def test_foam_far_behind_is_hidden_and_a_little_behind_shows_through(wall_of_water):
    bare = picture(wall_of_water(), color_by="#103060", radius=0.8)
    far = picture(
        with_foam(wall_of_water(), cloud(center=(0.5, 0.5, 0.2), spread=0.02)), color_by="#103060", radius=0.8
    )
    near = [
        picture(with_foam(wall_of_water(), [(0.5, 0.5, 0.5 + z)] * 3), color_by="#103060", radius=0.8).sum()
        for z in (0.1, -0.03, -0.08)
    ]
    assert (far == bare).all()
    assert near[0] > near[1] > near[2] > bare.sum()


def test_foam_fades_with_age(wall_of_water):
    light = [
        picture(with_foam(wall_of_water(), cloud(center=(0.5, 0.5, 0.75)), age=age), color_by="#103060").sum()
        for age in (0.1, 0.6, 0.9, 1.0)
    ]
    assert light[0] > light[1] > light[2] > light[3] == picture(wall_of_water(), color_by="#103060").sum()


def test_the_kinds_differ_in_size(wall_of_water):
    spray, foam, bubble = (
        picture(with_foam(wall_of_water(), cloud(60, (0.5, 0.5, 0.75), 0.15), kind=kind), color_by="#103060").sum()
        for kind in (1, 2, 3)
    )
    assert foam > bubble > 0
    assert foam > spray > picture(wall_of_water(), color_by="#103060").sum()


def test_foam_in_a_shadow_is_darker(tank_scene, make_frame):
    """A roof of water between the sun and the foam."""
    x, z = np.meshgrid(np.arange(0.025, 1, 0.03), np.arange(0.025, 1, 0.03))
    roof = np.stack([x.ravel(), np.full(x.size, 0.9), z.ravel()], 1)
    foam = cloud(2000, (0.6, 0.4, 0.5), 0.03)
    lit = picture(with_foam(make_frame(tank_scene, [(0.0, 0.0, 0.0)]), foam))
    shaded = picture(with_foam(make_frame(tank_scene, roof), foam))
    middle = (slice(36, 38), slice(52, 54))
    assert lit[middle].mean() > shaded[middle].mean() + 10


def test_total_light_does_not_depend_on_the_size_of_the_picture(wall_of_water):
    """Also where particles are smaller than a pixel, foam covers the same share of the picture."""
    shares = []
    for size in ((48, 32), (192, 128), (768, 512)):
        look = {"size": size, "color_by": "#707070", "radius": 0.8}  # brighter than the tone mapper's toe
        bare = picture(wall_of_water(), **look) / 255
        foamy = picture(with_foam(wall_of_water(), cloud(150, (0.5, 0.5, 0.75), 0.15)), **look) / 255
        shares.append((foamy**2.2 - bare**2.2).mean())
    assert shares[0] == pytest.approx(shares[2], rel=0.2)
    assert shares[1] == pytest.approx(shares[2], rel=0.2)


@pytest.mark.parametrize("supersample", [1, 2])
def test_pictures_repeat_and_do_not_depend_on_the_order(wall_of_water, supersample):
    x = cloud(3000, (0.5, 0.5, 0.6), 0.2)
    pictures = []
    for order in (slice(None), slice(None), slice(None, None, -1)):
        frame = with_foam(wall_of_water(), x[order])
        upload(frame.diffuse.id, np.arange(len(x))[order])
        pictures.append(Renderer(WIDTH, HEIGHT, supersample).render(frame, FRONT, view="particles"))
    assert (pictures[0] == pictures[1]).all()
    assert (pictures[0] == pictures[2]).all()


@pytest.mark.parametrize("eye", [(0.5, 0.5, 0.5), (0.5, 0.5, -5.0), (0.5, 0.5, 0.5001)])
def test_foam_at_and_behind_the_eye_does_no_harm(wall_of_water, eye):
    camera = Camera(eye=eye, target=(eye[0], eye[1], eye[2] - 1.0))
    for size in ((1, 1), (WIDTH, HEIGHT)):
        frame = with_foam(wall_of_water(), [*cloud(50), (0.5, 0.5, 0.5), (1e9, 0.0, 0.0), (0.5, 0.5, 1e30)])
        assert picture(frame, camera, size).shape == (size[1], size[0], 3)


def test_a_plane_shows_foam_on_water_and_spray_on_paper(make_frame):
    scene = Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0)))
    x, y = np.meshgrid(np.arange(0.025, 1, 0.05), np.arange(0.025, 0.5, 0.05))
    water = np.stack([x.ravel(), y.ravel()], 1)
    options = {"color_by": "#103060", "radius": 0.8, "camera": Camera.framing(scene, WIDTH / HEIGHT)}
    bare = picture(make_frame(scene, water), **options)
    below = picture(with_foam(make_frame(scene, water), cloud(50, (0.5, 0.2), 0.02)), **options)
    above = picture(with_foam(make_frame(scene, water), cloud(50, (0.5, 0.8), 0.02), kind=1), **options)
    assert (below - bare).max() > 80
    assert (below - bare).min() >= -2
    assert (above - bare).min() < -25  # darker than the paper


def test_without_foam_the_pass_changes_nothing(wall_of_water):
    from wavetank.view.passes import foam, tonemap

    renderer = Renderer(WIDTH, HEIGHT)
    image = renderer.render(wall_of_water(), FRONT, view="particles")
    shot = renderer.shot(wall_of_water(), FRONT, Style(view="particles"))
    passes = VIEWS["particles"].passes
    for draw in (*passes, tonemap.draw):
        if draw is not foam.draw:
            draw(shot, renderer.buffers)
    assert foam.draw in passes
    assert (renderer.render(with_foam(wall_of_water(), np.zeros((0, 3))), FRONT, view="particles") == image).all()


def test_the_reports_foam_is_white(make_frame, tank_scene):
    """Coloured by foam, a particle below the threshold is blue and one above it white."""
    speed = tank_scene.foaming_speed
    frame = make_frame(tank_scene, [(0.25, 0.5, 0.5), (0.75, 0.5, 0.5)], [(0.999 * speed, 0, 0), (1.001 * speed, 0, 0)])
    image = picture(frame, color_by="foam", radius=2.0)
    slow, fast = image[HEIGHT // 2, WIDTH // 2 - 13], image[HEIGHT // 2, WIDTH // 2 + 13]
    assert slow[2] > slow[0] + 60
    assert np.ptp(fast) < 30
    assert frame.foaming.tolist() == [False, True]


@pytest.mark.parametrize(("z", "visible"), [(1.05, True), (0.5, False)])
def test_foam_lies_over_the_waters_surface_too(tank_scene, make_frame, z, visible):
    """In the view water: bright in front of its surface, unseen far behind it."""
    x = 0.05 * np.stack(np.meshgrid(*(np.arange(0.5, 20),) * 3, indexing="ij"), -1).reshape(-1, 3)
    bare = Renderer(WIDTH, HEIGHT).render(make_frame(tank_scene, x), FRONT).astype(int)
    foam = with_foam(make_frame(tank_scene, x), cloud(center=(0.5, 0.5, z), spread=0.02))
    change = np.abs(Renderer(WIDTH, HEIGHT).render(foam, FRONT).astype(int) - bare).max()
    assert change > 20 if visible else change == 0


def bright(frame_with, frame_without, camera=FRONT, size=(192, 128)):
    """How much brighter foam makes each pixel."""
    options = {"color_by": "#103060", "radius": 0.8}
    return (picture(frame_with, camera, size, **options) - picture(frame_without, camera, size, **options)).sum(axis=2)


def widest(marks):
    """Pixels of the longest unbroken run in any row."""
    return max(len(run) for row in marks for run in "".join("x" if mark else " " for mark in row).split(" "))


def test_no_foam_is_a_ball_near_the_eye(wall_of_water):
    """A particle a hand's breadth from the eye is many small discs, and none of them a bokeh."""
    camera = Camera(eye=(0.5, 0.5, 1.0), target=(0.5, 0.5, 0.5))
    foam = with_foam(wall_of_water(), [(0.5, 0.5, 0.9)], kind=2)
    white = bright(foam, wall_of_water(), camera, (480, 320)) > 60
    assert widest(white) < 0.07 * 320
    assert white.sum() > 200
    columns = np.flatnonzero(white.any(axis=0))
    assert np.ptp(columns) > 0.15 * 320


def test_what_is_fast_is_drawn_along_its_way(wall_of_water):
    """A shutter that is open for half a frame sees half of its way."""
    spread = []
    for speed in (0.0, 30.0):
        foam = with_foam(wall_of_water(), [(0.5, 0.5, 0.75)] * 40, kind=1)
        upload(foam.diffuse.v, np.tile(np.float32([speed, 0, 0]), (43, 1)))
        rows, columns = np.nonzero(bright(foam, wall_of_water()) > 12)
        spread.append((np.ptp(rows), np.ptp(columns)))
    (tall, wide), (tall_fast, wide_fast) = spread
    pixels = 128 / 1.2 * 2.5 / 2.25  # of a metre
    assert wide_fast - wide == pytest.approx(0.5 * 30.0 / 60.0 * pixels, rel=0.35)
    assert abs(tall_fast - tall) <= 3
    assert abs(tall - wide) <= 0.6 * tall


def test_foam_is_seen_through_five_spacings(wall_of_water):
    """Three spacings below the surface it shows, six below it does not."""
    below = [
        bright(with_foam(wall_of_water(), cloud(100, (0.5, 0.5, 0.5 - deep * 0.05), 0.01)), wall_of_water())
        for deep in (1.0, 3.0, 8.0)
    ]
    assert below[0].sum() > below[1].sum() > 0
    assert below[1].max() > 40
    assert (below[2] == 0).all()


def test_a_heap_of_foam_is_lit_from_the_suns_side(tank_scene, make_frame):
    """The sun stands on the left: the left slope of a heap is brighter than its right one."""
    heap = cloud(6000, (0.5, 0.5, 0.5), 0.1)
    image = picture(with_foam(make_frame(tank_scene, [(0.0, 0.0, 0.0)]), heap, kind=2), size=(192, 128))
    column, row, _ = FRONT.project((0.5, 0.5, 0.5), 192, 128)[0]
    row, column, aside = int(row), int(column), 11
    left, right = (image[row - 3 : row + 4, column + k - 2 : column + k + 3].mean() for k in (-aside, aside))
    assert left > right + 12


def test_foam_stays_within_the_glass(tank_scene, make_frame):
    """Foam at a pane is not drawn outside of the tank."""
    foam = [(0.0, y, z) for y in np.linspace(0.3, 0.7, 30) for z in np.linspace(0.3, 0.7, 10)]
    camera = Camera(eye=(0.0, 0.5, 3.0), target=(0.0, 0.5, 0.5), height=1.2)
    change = np.abs(
        picture(with_foam(make_frame(tank_scene, []), foam), camera, (192, 128))
        - picture(make_frame(tank_scene, []), camera, (192, 128))
    ).sum(axis=2)
    assert change[:, 100:].max() > 30
    assert change[:, :93].max() == 0


def test_foam_casts_a_shadow(tank_scene, make_frame):
    """A patch of foam on a pool darkens what lies below, along the sun's rays, and nothing in front of the tank."""
    x, y, z = np.meshgrid(*[np.arange(0.025, n, 0.05) for n in (1.0, 0.4, 1.0)])
    pool = np.stack([x.ravel(), y.ravel(), z.ravel()], 1)
    patch = cloud(2000, center=(0.5, 0.41, 0.5), spread=0.08) * (1, 0, 1) + (0, 0.41, 0)
    eye = Camera(eye=(0.5, 1.4, 2.4), target=(0.5, 0.15, 0.5))
    bare, shaded = (
        Renderer(192, 128).render(frame, eye, view="water").astype(int)
        for frame in (make_frame(tank_scene, pool), with_foam(make_frame(tank_scene, pool), patch))
    )
    darker = (bare - shaded).min(axis=2) > 5
    assert darker.sum() > 60
    _, row, _ = eye.project(np.array([(0.5, 0.0, 1.1)]), 192, 128)[0]
    assert not darker[int(row) :].any()
