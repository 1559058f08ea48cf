import numpy as np
import pytest

from wavetank import Box, Scene, Tank
from wavetank.view.camera import Camera
from wavetank.view.extent import extent_of
from wavetank.view.renderer import Renderer

WIDTH, HEIGHT = 160, 120


def lines_of(frame, camera):
    renderer = Renderer(WIDTH, HEIGHT)
    renderer.render(frame, camera=camera, view="particles", legend=False)
    return renderer.buffers.pixels.lines.to_numpy() >> 23  # without their depth


def edge_points(scene, share):
    """The points at `share` along the edges of the tank, [edges, 3]."""
    corners = extent_of(scene).corners
    pairs = [(a, b) for a in corners for b in corners if (a != b).sum() == 1 and (a < b).any()]
    return np.unique([a + share * (b - a) for a, b in pairs], axis=0)


@pytest.mark.parametrize("size", [(1.0, 0.8, 0.6), (1.0, 0.7)])
@pytest.mark.parametrize("share", [0.03, 0.5, 0.9])
def test_every_edge_is_marked(make_frame, size, share):
    scene = Scene(spacing=0.05, tank=Tank(size=size))
    camera = Camera.framing(scene, WIDTH / HEIGHT)
    lines = lines_of(make_frame(scene, []), camera)
    pixels = camera.project(edge_points(scene, share), WIDTH, HEIGHT)
    for column, row, _ in pixels:
        row, column = int(row), int(column)
        assert lines[row - 1 : row + 2, column - 1 : column + 2].max() > 100
    assert (lines > 0).mean() < 0.2


def test_a_solid_hides_the_edges_behind_it_only(make_frame):
    scene = Scene(spacing=0.05, tank=Tank(size=(1, 1, 1)), solids=[Box(center=(0.5, 0.5, 0.5), size=(0.5, 0.5, 0.2))])
    camera = Camera(eye=(0.5, 0.5, 4.0), target=(0.5, 0.5, 0.0), field_of_view=0.7)
    bare = Scene(spacing=0.05, tank=Tank(size=(1, 1, 1)))
    near_to = camera.orbit(0.5, 0.3)
    with_box, without = lines_of(make_frame(scene, []), near_to), lines_of(make_frame(bare, []), near_to)
    assert (with_box <= without).all()
    assert (with_box < without).any()
    front = near_to.project([(0.5, 0.0, 1.0), (0.5, 1.0, 1.0)], WIDTH, HEIGHT)
    for column, row, _ in front:
        assert with_box[int(row) - 1 : int(row) + 2, int(column) - 1 : int(column) + 2].max() > 100


@pytest.mark.parametrize("eye", [(0.5, 0.5, 0.5), (1.2, 1.1, 0.9), (0.9, 0.1, 0.8), (0.5, -0.5, 0.5)])
def test_only_edges_in_front_of_the_eye_are_marked_and_only_there(make_frame, tank_scene, eye):
    camera = Camera(eye=eye, target=(0.2, 0.3, 0.1), field_of_view=1.8)
    lines = lines_of(make_frame(tank_scene, []), camera)
    points = np.concatenate([edge_points(tank_scene, share) for share in np.linspace(0.0, 1.0, 3001)])
    pixels = camera.project(points, WIDTH, HEIGHT)
    seen = pixels[(pixels[:, 2] > 1.01 * camera.near) & (np.abs(pixels[:, :2]) < 1e4).all(axis=1)]
    columns, rows = np.floor(seen[:, :2]).astype(int).T
    inside = (columns >= 0) & (columns < WIDTH) & (rows >= 0) & (rows < HEIGHT)
    expected = np.zeros((HEIGHT + 4, WIDTH + 4), bool)
    expected[rows[inside] + 2, columns[inside] + 2] = True
    near = np.zeros((HEIGHT, WIDTH), bool)
    for row in range(5):
        for column in range(5):
            near |= expected[row : row + HEIGHT, column : column + WIDTH]
    assert not ((lines > 0) & ~near)[3:-3, 3:-3].any()
    floor_or_edge = expected[2:-2, 2:-2]
    assert (lines > 0)[floor_or_edge].mean() > (0.9 if eye[1] > 0 else 0.3)


def test_an_edge_through_the_eye_does_no_harm(make_frame, tank_scene):
    for eye in ((1.0, 1.0, 1.0), (0.0, 0.0, 0.5)):
        lines = lines_of(make_frame(tank_scene, []), Camera(eye=eye, target=(0.2, 0.3, 0.1), field_of_view=1.5))
        assert 0 <= lines.min() <= lines.max() <= 255


def test_no_tank_no_lines(make_frame):
    frame = make_frame(Scene(spacing=0.05), [])
    renderer = Renderer(WIDTH, HEIGHT)
    assert len(np.unique(renderer.render(frame, view="particles", legend=False).reshape(-1, 3), axis=0)) < 200


def test_a_world_without_a_tank_shows_no_lines_of_the_one_before(make_frame):
    renderer = Renderer(160, 120)
    block = np.stack(np.meshgrid(*[np.arange(0.05, 0.6, 0.05)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    open_world = make_frame(Scene(spacing=0.05), block)
    fresh = renderer.render(open_world, view="water")
    renderer.render(make_frame(Scene(spacing=0.05, tank=Tank(size=(1.0, 1.0, 1.0))), block), view="water")
    assert (renderer.render(open_world, view="water") == fresh).all()
