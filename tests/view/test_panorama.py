"""Environments from a picture: Radiance files by hand, their sun, their exposure; what is damaged is refused."""

import math

import numpy as np
import pytest

import wavetank as wt
from wavetank.view.panorama import directions_of, panorama, panorama_of, pixels_of

HEAD = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"


def packed(radiance):
    """Mantissas and exponents, uint8 [rows, columns, 4] (G. Ward 1991)."""
    peak = radiance.max(axis=2)
    power = np.where(peak > 0.0, np.floor(np.log2(np.maximum(peak, 1e-30))) + 1, -128.0)
    mantissas = np.floor(radiance * 256.0 / 2.0 ** power[..., None])
    return np.concatenate([mantissas, power[..., None] + 128.0], axis=2).clip(0, 255).astype(np.uint8)


def written(radiance, runs):
    rows, columns = radiance.shape[:2]
    body = b""
    for row in packed(radiance):
        if not runs:
            body += row.tobytes()
            continue
        body += bytes((2, 2, columns >> 8, columns & 255))
        for channel in row.T:
            half = columns // 2  # half of a row as it is, half as a run where it is one
            body += bytes((half,)) + channel[:half].tobytes()
            rest = channel[half:]
            body += (
                bytes((128 + len(rest), int(rest[0]))) if (rest == rest[0]).all() else bytes((len(rest),)) + bytes(rest)
            )
    return HEAD + b"-Y %d +X %d\n" % (rows, columns) + body


def under(sun, rows=64, columns=128):
    """A grey sky over a dark ground, blue towards +x, and a sun in the direction `sun`."""
    to = directions_of(rows, columns)
    sky = np.where(to[..., 1:2] > 0.0, 0.5, 0.1) * np.ones(3)
    sky[..., 2] += 0.6 * np.maximum(to[..., 0], 0.0)
    sky[to @ sun > math.cos(math.radians(4.0))] = (400.0, 380.0, 340.0)
    return sky.astype(np.float32)


SUN = np.array([0.7, 0.5, -math.sqrt(1.0 - 0.74)])


@pytest.mark.parametrize("runs", [False, True])
def test_a_picture_comes_back_to_a_byte(runs):
    given = under(SUN)
    found = pixels_of(written(given, runs), "x.hdr")
    # Half a step of a mantissa whose largest has seven bits or more.
    assert np.all(np.abs(found - given) <= given.max(axis=2, keepdims=True) / 256.0)


def test_the_bright_place_is_the_sun_and_the_ground_is_exposed():
    made = panorama_of(under(SUN))
    look = made.look
    assert np.degrees(np.arccos(float(np.asarray(look.to_sun) @ SUN))) < 1.0
    assert made.sky.max() < 0.1 * under(SUN).max()  # it is no longer in the sky
    ground = float(np.mean(look.sun) * look.to_sun[1] + np.mean(look.sky))
    again = panorama_of(50.0 * under(SUN))
    assert ground == pytest.approx(float(np.mean(again.look.sun) * again.look.to_sun[1] + np.mean(again.look.sky)))
    np.testing.assert_allclose(again.sky, made.sky, rtol=1e-4)
    assert look.sun[0] > look.sun[2] and look.sky[2] > look.sky[0]


@pytest.mark.parametrize("quality", ["draft", "film"])
def test_a_picture_lights_a_world(quality, tmp_path):
    path = tmp_path / "sky.hdr"
    path.write_bytes(written(under(SUN), True))
    scene = wt.Scene(spacing=0.1, tank=wt.Tank(size=(1.0, 1.0, 1.0)))
    sim = wt.Simulation(scene.changed(fluids=[wt.Points(positions=[[0.5, 0.05, 0.5]])]))
    options = {"quality": quality, "environment": str(path), "edges": False}
    if quality == "film":
        options["samples"] = 4
    right, left = (
        wt.render(sim, 48, 32, camera=wt.Camera(eye=(0.5, 0.5, 0.5), target=(0.5 + x, 0.9, 0.5)), **options).astype(int)
        for x in (1.0, -1.0)
    )
    blue = [(image[:8, :, 2] - image[:8, :, 0]).mean() for image in (right, left)]
    assert blue[0] > blue[1] + 15  # the picture's right half lies along +x
    path.write_bytes(written(under(SUN)[:, ::-1], True))
    other = wt.render(sim, 48, 32, camera=wt.Camera(eye=(0.5, 0.5, 0.5), target=(1.5, 0.9, 0.5)), **options)
    assert np.abs(other - right).mean() > 0.5  # read anew


GOOD = written(under(SUN), True)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "not an environment"),
        (b"#?RADIANCE\n\n-Y 4 +X 8\n" + bytes(128), "not an environment"),
        (HEAD + b"+Y 4 +X 8\n" + bytes(128), "not an environment"),
        (HEAD + b"-Y 999999 +X 999999\n", "pixels"),
        (HEAD + b"-Y 1 +X 1\n" + bytes(4), "pixels"),
        (GOOD[:-1], "too soon"),
        (GOOD[:200], "too soon"),
        (HEAD + b"-Y 4 +X 8\n" + bytes((2, 2, 0, 8)) + bytes((0,)) * 400, "damaged"),
        (HEAD + b"-Y 4 +X 8\n" + bytes((2, 2, 0, 8)) + bytes((255, 1)) * 400, "damaged"),
    ],
)
def test_what_is_damaged_is_refused_in_a_sentence(data, said, tmp_path):
    path = tmp_path / "sky.hdr"
    path.write_bytes(data)
    with pytest.raises(wt.WavetankError, match=said) as found:
        panorama(str(path))
    assert "\n" not in str(found.value) and "sky.hdr" in str(found.value)


def test_a_picture_has_its_own_sun_and_must_be_there(tmp_path):
    path = tmp_path / "sky.hdr"
    path.write_bytes(GOOD)
    frame = wt.Simulation(wt.Scene(spacing=0.1, tank=wt.Tank(size=(1.0, 1.0, 1.0)))).frame()
    with pytest.raises(wt.WavetankError, match="stands where"):
        wt.render(frame, 16, 16, environment=str(path), sun="10,20")
    with pytest.raises(wt.WavetankError, match="cannot be read"):
        wt.render(frame, 16, 16, environment=str(tmp_path / "none.hdr"))
    with pytest.raises(wt.WavetankError, match="environment"):
        wt.Scene(spacing=0.1, light={"environment": str(path)})  # a scene from anywhere opens no file
