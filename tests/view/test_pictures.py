"""Pictures against kept ones, with a tolerance that follows the eye.

`python tests/view/test_pictures.py` keeps new ones. The worlds are made by formula, so that a
change of the solver changes no picture.
"""

import dataclasses
import functools
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from test_foam_pass import with_foam
from worlds import frame_of

from wavetank import Box, Scene, Sphere, Tank
from wavetank.view import views
from wavetank.view.camera import Camera
from wavetank.view.colormaps import oklab, to_linear
from wavetank.view.renderer import Renderer

FOLDER = Path(__file__).parent / "pictures"
SIZE = (320, 180)
EYES = {
    "under": Camera(eye=(0.12, 0.08, 0.35), target=(0.6, 0.32, 0.3), field_of_view=1.5),  # in the water
    "brief": Camera(eye=(0.55, 0.6, 1.2), target=(0.55, 0.45, 0.3), field_of_view=0.6),
}
OPEN = {"sharp": 0.0, "brief": 0.01}  # s: the water with a shutter that shows drops


def lattice(size, spacing):
    return np.stack(np.meshgrid(*(np.arange(0.5, n / spacing) * spacing for n in size), indexing="ij"), -1).reshape(
        -1, len(size)
    )


@functools.cache
def world(dim):
    """A wave that runs over a box, drops in the air, and foam on the crest."""
    d = 0.03 if dim == 3 else 0.015
    size = (1.2, 0.6, 0.6)[:dim]
    x = lattice(size, d)
    across = 0.5 * np.sin(5.0 * x[:, 2]) if dim == 3 else 0.0
    x = x[x[:, 1] < 0.28 + 0.1 * np.sin(6.0 * x[:, 0] + across)]
    x = x[
        np.abs(x[:, :2] - (0.85, 0.12)).max(axis=1) > 0.135
        if dim == 2
        else (np.abs(x - (0.85, 0.12, 0.3)).max(axis=1) > 0.135)
    ]
    drops = np.random.default_rng(4).uniform(0.05, 0.95, (25, dim)) * (1.1, 0.15, 0.55)[:dim] + (0.0, 0.42, 0.0)[:dim]
    x = np.concatenate([x + np.random.default_rng(3).normal(0.0, 0.04 * d, x.shape), drops])
    v = np.zeros_like(x)
    v[:, 0] = 3.0 * x[:, 1]
    solids = [
        Box(center=(0.85, 0.12, 0.3)[:dim], size=(0.24, 0.24, 0.24)[:dim]),
        Sphere(center=(0.3, 0.45, 0.2)[:dim], radius=0.06),
    ]
    crest = np.random.default_rng(5).normal((0.35, 0.4, 0.3)[:dim], 0.05, (600, dim))
    frame = frame_of(Scene(spacing=d, tank=Tank(size=size), solids=solids), x, v)
    return with_foam(frame, crest)


def difference(image, kept):
    """(mean, share of clearly different places) of the distance in Oklab after a blur as wide as a pixel."""

    def seen(picture):
        lab = oklab(to_linear(picture.reshape(-1, 3) / 255.0)).reshape(picture.shape)
        return 0.25 * (lab[1:, 1:] + lab[:-1, 1:] + lab[1:, :-1] + lab[:-1, :-1])

    distance = np.linalg.norm(seen(image) - seen(kept), axis=-1)
    return distance.mean(), (distance > 0.05).mean()


def looks_like(image, kept):
    mean, share = difference(image, kept)
    return mean < 0.002 and share < 0.003


def picture(dim, view):
    frame, camera, shutter = world(dim), EYES.get(view), OPEN.get(view, 0.1)
    kind = "water" if view in ("under", *OPEN) else view
    return Renderer(*SIZE).render(frame, camera, view=kind, legend=False, shutter=shutter)


def kept_picture(dim, view):
    return np.asarray(Image.open(FOLDER / f"{view}-{dim}d.png").convert("RGB"))


PARTS = ("still", "once", "passes")
LIGHT = ("shadow", "occlusion", "smooth")  # they fill one map of light, and are left out as one
CASES = [*((dim, view) for dim in (2, 3) for view in views.VIEWS), *((3, view) for view in ("under", *OPEN))]


@pytest.mark.parametrize(("dim", "view"), CASES)
def test_a_view_looks_as_it_did(dim, view):
    assert looks_like(picture(dim, view), kept_picture(dim, view)), difference(
        picture(dim, view), kept_picture(dim, view)
    )


def name_of(draw):
    name = draw.__module__.rpartition(".")[2]
    return "light" if name in LIGHT else name


@pytest.mark.parametrize("name", sorted({name_of(f) for part in PARTS for f in getattr(views.VIEWS["water"], part)}))
def test_no_pass_can_be_left_out(monkeypatch, name):
    """The comparison is keen enough to see every single pass of the water missing."""
    kind = views.VIEWS["water"]
    without = {part: tuple(f for f in getattr(kind, part) if name_of(f) != name) for part in PARTS}
    monkeypatch.setitem(views.VIEWS, "water", dataclasses.replace(kind, **without))
    view = {"below": "under", "drops": "sharp", "streaks": "brief"}.get(name, "water")
    assert not looks_like(picture(3, view), kept_picture(3, view))


def test_the_tolerance_forgives_what_no_eye_sees():
    kept = kept_picture(3, "water").astype(int)
    noise = np.random.default_rng(0).integers(-1, 2, kept.shape)
    assert looks_like(np.clip(kept + noise, 0, 255), kept)
    assert not looks_like(np.roll(kept, 1, axis=1), kept)


def test_kept_pictures_are_small():
    assert all(path.stat().st_size <= 100_000 for path in FOLDER.glob("*.png"))


if __name__ == "__main__":
    for dim, view in CASES:
        Image.fromarray(picture(dim, view)).save(FOLDER / f"{view}-{dim}d.png", optimize=True)
