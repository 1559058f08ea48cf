"""An open shutter smears what moves along its way, and nothing else."""

import numpy as np
from test_drops import ABOVE, SIZE, D, pool
from test_ellipsoids import lattice
from test_foam_pass import with_foam
from worlds import frame_of

from wavetank import Box, Camera, Scene, Simulation, Tank
from wavetank.device.compiler import upload
from wavetank.view.renderer import Renderer

TIME = 1.0 / 60.0


def picture(frame, camera=ABOVE, supersample=1, **style):
    return Renderer(*SIZE, supersample).render(frame, camera, view="water", floor="plain", **style).astype(int)


def jumps(film):
    """Share of pixels that jump by more than 40 of 255 against both neighbouring pictures."""
    before, after = film[1:-1] - film[:-2], film[1:-1] - film[2:]
    return ((np.abs(before) > 40) & (np.abs(after) > 40) & (before * after > 0)).any(axis=-1).mean()


def test_breaking_water_flickers_a_quarter_as_much():
    """`obstacle-tank` from 0.75 s on, the hardest: 1.7 % of all pixels with a closed shutter, 0.44 open."""
    sim = Simulation(Scene.load("obstacle-tank"))
    sim.advance(0.75)
    films, renderer = {0.0: [], TIME: []}, Renderer(640, 360)
    for _ in range(5):
        for shutter, film in films.items():
            film.append(renderer.render(sim.frame(), view="water", shutter=shutter).astype(np.int16))
        sim.advance(TIME)
    shut, opened = (jumps(np.array(film)) for film in films.values())
    assert shut > 0.012
    assert opened < 0.005


def test_a_drop_is_smeared_along_its_way():
    """0.6 m/s to the right, a tenth of a second long: longer than it was, hardly higher, and paler."""
    for supersample in (1, 2):
        bare = picture(pool(), supersample=supersample)
        frame = pool((0.5, 0.9, 0.5), velocity=(0.6, 0.0, 0.0))
        sharp, smeared = (
            np.abs(picture(frame, supersample=supersample, shutter=shutter) - bare).max(axis=2)
            for shutter in (0.0, 0.1)
        )
        sides = [
            [np.ptp(np.nonzero((change > 12).any(axis=axis))[0]) for axis in (0, 1)] for change in (sharp, smeared)
        ]
        assert sides[1][0] > sides[0][0] + 2, supersample
        assert sides[1][0] - sides[0][0] > 2 * (sides[1][1] - sides[0][1]), supersample
        assert smeared.max() < 0.9 * sharp.max(), supersample


def test_a_drop_before_a_wave_goes_its_own_way():
    """The water below rushes to the right, the drop falls past a wall: it is longer downwards, and no wider."""
    x = lattice((0, 0, 0), (1.0, 0.4, 1.0))
    frames = []
    for drop in (np.zeros((0, 3)), [(0.5, 0.6, 0.9)]):
        v = np.tile((2.0, 0.0, 0.0), (len(x) + len(drop), 1))
        v[len(x) :] = (0.0, -0.65, 0.0)
        frames.append(frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), np.concatenate([x, drop]), v))
    camera = Camera(eye=(0.5, 1.2, 2.6), target=(0.5, 0.5, 0.8))
    sizes = []
    for shutter in (0.0, 0.1):
        bare, wet = (picture(frame, camera, shutter=shutter) for frame in frames)
        seen = np.abs(wet - bare).max(axis=2) > 8
        sizes.append([np.ptp(np.nonzero(seen.any(axis=axis))[0]) for axis in (0, 1)])
    assert sizes[1][1] > sizes[0][1] + 4
    assert sizes[1][0] <= sizes[0][0] + 1


def test_foam_behind_a_pane_is_smeared_along_its_way():
    """The pane keeps what stands behind sharp, but foam moves: its speck is longer."""
    still, (speck,) = lattice((0, 0, 0), (1.0, 0.7, 1.0)), [(0.5, 0.35, 0.99)]
    camera, seen = Camera(eye=(0.5, 0.35, 3.0), target=(0.5, 0.35, 0.5)), []
    for shutter in (0.0, 0.05):
        frames = [frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0))), still) for _ in range(2)]
        upload(with_foam(frames[1], [speck] * 4).diffuse.v, np.tile(np.float32((2.0, 0.0, 0.0)), (7, 1)))
        bare, white = (picture(frame, camera, shutter=shutter) for frame in frames)
        seen.append((white - bare).max(axis=2))
    wide = [np.ptp(np.nonzero((one > 3).any(axis=0))[0]) for one in seen]
    assert wide[1] > wide[0] + 6


def test_what_rests_is_left_as_it_is():
    frame = pool((0.5, 0.9, 0.5))
    assert (picture(frame, shutter=TIME) == picture(frame)).all()


def test_what_stands_behind_a_pane_stays_sharp():
    """Water that moves along a pane moves nothing that is seen through it."""
    wall = Box(center=(0.5, 0.3, 0.5), size=(0.2, 0.6, 0.2), color="#101010")
    x = lattice((0, 0, 0), (1.0, 0.7, 1.0))
    x = x[np.abs(x - (0.5, 0.3, 0.5)).max(axis=1) > 0.12]
    frame = frame_of(Scene(spacing=D, tank=Tank(size=(1.0, 1.0, 1.0)), solids=[wall]), x, np.full_like(x, 1.5))
    camera = Camera(eye=(0.5, 0.35, 3.0), target=(0.5, 0.35, 0.5))
    change = np.abs(picture(frame, camera, shutter=TIME) - picture(frame, camera)).max(axis=2)
    column, row, _ = camera.project((0.5, 0.3, 1.0), *SIZE)[0]
    assert change[int(row) - 20 : int(row) + 20, int(column) - 25 : int(column) + 25].max() == 0
    assert change.max() > 5  # the surface is smeared


def test_a_picture_belongs_to_its_frame_alone():
    frame = pool((0.5, 0.9, 0.5), velocity=(1.5, 0.0, 0.0))
    renderer = Renderer(*SIZE)
    first = renderer.render(frame, ABOVE, view="water", floor="plain", shutter=TIME)
    renderer.render(pool((0.2, 0.9, 0.2), velocity=(0.0, 0.0, 3.0)), ABOVE, view="water", floor="plain", shutter=TIME)
    assert (renderer.render(frame, ABOVE, view="water", floor="plain", shutter=TIME) == first).all()
    assert (picture(frame, shutter=TIME) == first).all()
