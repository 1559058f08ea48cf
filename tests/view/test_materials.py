"""Materials that look like themselves: clear, cloudy, opaque; with borders between them; in a plane up to its walls."""

import numpy as np
import pytest
from test_ellipsoids import lattice
from worlds import device, frame_of

import wavetank as wt
from wavetank import Box, Camera, Scene, Tank, WavetankError
from wavetank.foundation.materials import Material
from wavetank.view.renderer import Renderer

D = 0.05
SIZE = (240, 180)
FRONT = Camera(eye=(0.5, 0.35, 3.2), target=(0.5, 0.3, 0.5))
BLACK = Box(center=(0.5, 0.3, -0.1), size=(1.0, 0.6, 0.1), color="#000000")


def filled(materials, kinds=None, solids=(), dim=3, wide=1.0):
    x = lattice((0, 0, 0), (1.0, 0.6, wide)) if dim == 3 else lattice((0, 0, 0), (1.0, 0.6, D))[:, :2]
    size = (1.0, 1.0, wide)[:dim]
    scene = Scene(spacing=D, tank=Tank(size=size), materials=list(materials), solids=list(solids))
    numbers = np.ones(len(x), int) if kinds is None else kinds(x)
    return frame_of(scene, x, kinds=numbers)


def picture(frame, camera=FRONT, **style):
    return Renderer(*SIZE).render(frame, camera, view="water", **style).astype(int)


def at(image, camera, *point, half=2):
    column, row, _ = camera.project(np.array(point), *SIZE)[0]
    return image[int(row) - half : int(row) + half + 1, int(column) - half : int(column) + half + 1].reshape(-1, 3)


@pytest.mark.parametrize(("clarity", "least", "most"), [("clear", 25, 200), ("cloudy", 3, 40), ("opaque", 0, 2)])
def test_clarity_says_how_much_is_seen_of_what_is_behind(clarity, least, most):
    """A black wall behind 0.3 m of white fluid."""
    white = Material(name="fluid", color="#ffffff", clarity=clarity)
    seen = [at(picture(filled([white], solids=wall, wide=0.3)), FRONT, 0.5, 0.3, 0.3) for wall in ((), (BLACK,))]
    assert least <= np.abs(seen[0] - seen[1]).mean() <= most


def test_milk_is_white_and_casts_a_shadow():
    milk, glass = (Material(name="milk", color="#f6f1e4", clarity=clarity) for clarity in ("opaque", "clear"))
    above = Camera(eye=(1.6, 1.6, 2.6), target=(0.9, 0.1, 0.5))
    shadows = []
    for material in (milk, glass):
        image = picture(filled([material]), above)
        shadows.append(at(image, above, 1.2, 0.0, 0.48).mean())
        if material is milk:
            lit = at(image, above, 0.5, 0.6, 0.5)
            assert lit.min() > 200 and np.ptp(lit.mean(axis=0)) < 30
    assert shadows[0] < shadows[1] - 25


def test_a_solid_casts_its_shadow_on_milk():
    """A ball over the pool: its shadow lies where the sun's ray through its middle meets the surface."""
    milk = Material(name="milk", color="#f6f1e4", clarity="opaque")
    ball, above = wt.Sphere(center=(0.4, 0.85, 0.5), radius=0.08), Camera(eye=(0.5, 2.2, 2.6), target=(0.5, 0.5, 0.5))
    frame = filled([milk], solids=[ball])
    to_sun = np.asarray(Renderer(*SIZE).shot(frame).look.to_sun, float)
    place = np.array(ball.center) - (ball.center[1] - 0.6) / to_sun[1] * to_sun
    image = picture(frame, above)
    shade, lit = at(image, above, *place, half=1).mean(), at(image, above, 0.85, 0.6, 0.75, half=1).mean()
    assert shade < lit - 40


def test_glass_is_seen_in_a_draft():
    """A ball of glass before a wall: what is behind its middle shows through, coloured; its rim mirrors the sky."""
    wall = Box(center=(0.5, 0.7, 0.0), size=(1.0, 0.5, 0.1), color="#404040")
    camera, middle = Camera(eye=(0.5, 0.7, 3.0), target=(0.5, 0.7, 0.5)), (0.5, 0.75, 0.5)
    white = Material(name="fluid", color="#ffffff", clarity="clear")
    pictures = {
        color: picture(filled([white], kinds=None, solids=solids), camera)
        for color, solids in {
            "": [wall],
            "clear": [wall, wt.Sphere(center=middle, radius=0.12, finish="glass")],
            "red": [wall, wt.Sphere(center=middle, radius=0.12, finish="glass", color="#ff4040")],
        }.items()
    }
    bare, clear, red = (at(image, camera, *middle).mean(axis=0) for image in pictures.values())
    assert np.abs(clear - bare).max() < 50, "through its middle one sees nearly all"
    assert red[0] - red[2] > clear[0] - clear[2] + 15, "glass has a colour"
    change = np.abs(pictures["clear"] - pictures[""]).max(axis=2)
    assert (change > 40).sum() > 20, "and a rim"


def test_a_piece_of_ice_in_deep_water_hides_what_is_behind():
    """A black wall behind the tank changes nothing where a ball of ice of 0.24 m lies before it: 3.7 of 255 before."""
    seen, middle = [], np.array([0.5, 0.3, 0.85])
    for solids in ((), (BLACK,)):
        fluids = [wt.Block(lower=(0, 0, 0), upper=(1, 0.6, 1))]
        sim = wt.Simulation(Scene(spacing=D, tank=Tank(size=(1, 0.8, 1)), fluids=fluids, solids=list(solids)))
        sim.freeze_inside(middle, middle, 0.12)
        image = picture(sim.frame(), FRONT)
        seen.append(at(image, FRONT, *middle))
    assert np.abs(seen[0] - seen[1]).mean() < 1.5
    assert seen[0].mean() > at(image, FRONT, 0.15, 0.3, 0.85).mean() + 45, "and is pale beside the water"


def test_lava_glows_where_no_sun_reaches():
    """The side that turns away from the sun is as bright as its own light makes it."""
    rock, lava = (Material(name="rock", color="#ff4a08", clarity="opaque", glow=glow) for glow in (0.0, 0.9))
    away = Camera(eye=(3.4, 0.3, 0.5), target=(0.5, 0.3, 0.5))
    dark, bright = (at(picture(filled([m]), away), away, 1.0, 0.3, 0.5)[:, 0].mean() for m in (rock, lava))
    assert bright > 225 and bright > dark + 25


def test_a_border_between_fluids_is_sharp():
    """From black to white within a spacing, against the glass; it took four."""
    pair = [
        Material(name="a", color="#101010", clarity="opaque"),
        Material(name="b", color="#f0f0f0", clarity="opaque"),
    ]
    image = picture(filled(pair, lambda x: np.where(x[:, 0] < 0.5, 1, 2)))
    row = at(image, FRONT, 0.5, 0.3, 1.0, half=30).reshape(61, 61, 3)[30, :, 0]
    low, high = row[:10].mean(), row[-10:].mean()
    between = (row > low + 0.15 * (high - low)) & (row < high - 0.15 * (high - low))
    pixels = np.subtract(*FRONT.project(np.array([(0.5 + D, 0.3, 1.0), (0.5, 0.3, 1.0)]), *SIZE)[:, 0])
    assert high > low + 120
    assert between.sum() <= 1.2 * pixels


def test_a_border_in_a_plane_is_sharp():
    pair = [Material(name="a", color="#0050c8"), Material(name="b", color="#e0a526")]
    image = picture(filled(pair, lambda x: np.where(x[:, 0] < 0.5, 1, 2), dim=2), None)
    row = image[110, 50:190, 0]
    low, high = row[30], row[-30]
    between = (row > low + 0.15 * (high - low)) & (row < high - 0.15 * (high - low))
    assert high > low + 100
    assert between.sum() <= 9, "a spacing is 7 pixels"


def test_dye_in_a_plane_reaches_the_walls():
    """A wall takes as much of the dye's discs as of the water's: the colour is the same in the middle and beside it."""
    frame = filled([], lambda x: np.zeros(len(x), int), dim=2)
    dye = np.full(frame.count, (127 << 24) | (220 << 16) | (40 << 8) | 40)
    vars(frame).update(dye=device(dye, frame.dye.dtype, frame.count + 3))
    camera = Camera(eye=(0.5, 0.5, 1.0), target=(0.5, 0.5, 0.0), height=1.2)
    image = picture(frame, camera)
    middle, beside = (at(image, camera, x, 0.3, 0.0, half=1).mean(axis=0) for x in (0.5, 0.03))
    assert middle[0] > middle[2] + 80
    assert np.abs(middle - beside).max() < 25


def test_ice_is_paler_than_water_and_hides_what_is_behind():
    """A black plate on the floor below a ball of ice."""
    plate = Box(center=(0.5, 0.01, 0.5), size=(0.7, 0.02, 0.7), color="#000000")
    above = Camera(eye=(0.5, 2.5, 1.0), target=(0.5, 0.4, 0.5))
    middle, seen = np.array([0.5, 0.3, 0.5]), []
    for solids in ((), (plate,)):
        fluids = [wt.Block(lower=(0, 0, 0), upper=(1, 0.5, 1))]
        sim = wt.Simulation(Scene(spacing=D, tank=Tank(size=(1, 0.8, 1)), fluids=fluids, solids=list(solids)))
        water = at(picture(sim.frame(), above), above, 0.5, 0.5, 0.5)
        sim.freeze_inside(middle, middle, 0.22)
        seen.append((water, at(picture(sim.frame(), above), above, 0.5, 0.5, 0.5)))
    (water, ice), (dark_water, dark_ice) = seen
    assert ice.mean() > water.mean() + 25
    assert np.abs(ice - dark_ice).mean() < 0.35 * np.abs(water - dark_water).mean()


def test_what_a_material_may_not_be():
    for wrong in ({"clarity": "muddy"}, {"glow": -1.0}, {"glow": 1e9}):
        with pytest.raises(WavetankError, match=next(iter(wrong))):
            Material(name="x", **wrong)


def test_water_in_a_plane_is_as_blue_beside_solids_as_elsewhere():
    """A box and a ball in the water have no pale rim around them, and no dark one."""
    solids = [Box(center=(0.4, 0.22), size=(0.12, 0.2)), wt.Sphere(center=(0.8, 0.2), radius=0.1)]
    fluids = [wt.Block(lower=(0, 0), upper=(1.2, 0.48))]
    sim = wt.Simulation(Scene(spacing=0.02, tank=Tank(size=(1.2, 0.6)), fluids=fluids, solids=solids))
    sim.advance(0.5)
    camera = Camera(eye=(0.6, 0.3, 1.0), target=(0.6, 0.3, 0.0), height=0.7)
    image = picture(sim.frame(), camera)
    for x, y in ((0.328, 0.22), (0.472, 0.2), (0.912, 0.2), (0.8, 0.312)):
        beside, far = (at(image, camera, column, y, 0.0, half=1).mean(axis=0) for column in (x, 0.1))
        assert np.abs(beside - far).max() < 12, (x, y)


def test_milk_in_a_plane_is_as_bright_at_its_floor_as_at_its_surface():
    """Nothing casts a shadow in a plane: no map of what the sun sees is read there."""
    milk = Material(name="milk", color="#f6f1e4", clarity="opaque")
    camera = Camera(eye=(0.5, 0.5, 1.0), target=(0.5, 0.5, 0.0), height=1.2)
    image = picture(filled([milk], dim=2), camera)
    low, high = (at(image, camera, 0.5, y, 0.0).mean() for y in (0.1, 0.45))
    assert min(low, high) > 190
