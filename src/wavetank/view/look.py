"""How a picture is lit: the numbers that the passes share.

All colours are linear RGB; lengths are relative to the world, so that a puddle and a harbour look alike.
"""

import dataclasses
import functools
from typing import Any

import numpy as np

from wavetank.device.compiler import qd
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.extent import Extent
from wavetank.view.lens import vec3, vector
from wavetank.view.sky import fitted


@dataclasses.dataclass(frozen=True, eq=False)
class Look:
    """Light and colours of a picture, on the device."""

    to_sun: vec3  # unit
    sun: vec3  # radiance of a white surface that faces the sun
    sky: vec3  # radiance of a white surface that sees only the upper half of the sky
    ground: vec3  # radiance of a white surface that sees only the floor
    horizon: vec3  # background behind the floor, and what distance fades to
    zenith: vec3  # background overhead
    floor: vec3  # albedo
    solid: vec3  # albedo
    line: vec3  # radiance of the tank's edges
    line_strength: qd.f32  # share of what is behind an edge that the edge hides
    pane: vec3  # radiance that the panes of the tank mirror
    glass: qd.f32  # share of it in what is seen through a pane; 1 is white paper, cut off at the tank
    wrap: qd.f32  # how far the sun's light wraps around particles: 0 hard, 1 all around
    gloss: qd.f32  # strength of the highlight on particles and solids
    sun_size: qd.f32  # tangent of the sun's angular radius: softness of shadows
    shade_depth: qd.f32  # strength of ambient occlusion, about 1
    outdoors: qd.i32  # 1 under the sky that these seven are the weights of, see `sky.py`; 0 in a studio
    sky_even: vec3
    sky_low: vec3
    sky_haze: vec3
    sky_near: vec3
    sky_near_haze: vec3
    sky_glow: vec3
    sky_glare: vec3
    below: vec3  # radiance of the ground that the water mirrors
    lamp: vec3  # radiance of the rim of a sheet of water in a plane
    glow: vec3  # radiance of light that comes back out of deep water
    sparkle: qd.f32  # strength of the sun's image in the water
    veil: qd.f32  # share of the sun that a surface of water keeps from what is below
    caustic: qd.f32  # strength of the light that bulges of water gather
    tile: qd.f32  # m: edge of the floor's tiles, 0 for none
    paving: qd.i32  # what the floor is made of: place in `environments.FLOORS`


TURBIDITY = 3.5
SKY = ("sky_even", "sky_low", "sky_haze", "sky_near", "sky_near_haze", "sky_glow", "sky_glare")
STUDIO: dict[str, Any] = {"outdoors": 0, "below": vector(0.5, 0.5, 0.5)} | dict.fromkeys(SKY, vector(0.0, 0.0, 0.0))


def under_sky(look: Look, turbidity: float = TURBIDITY) -> Look:
    """Return a look in the open, on the ground that its sun and its sky light."""
    parts = (tuple(map(float, part)) for part in (look.to_sun, look.sky, look.horizon))
    weights: dict[str, Any] = {
        name: vector(*weight) for name, weight in zip(SKY, fitted(*parts, turbidity), strict=True)
    }
    return dataclasses.replace(look, outdoors=1, below=lit_floor(look), **weights)


@functools.cache
def studio() -> Look:
    """Neutral light studio with a warm sun from behind the left shoulder: worlds in space."""
    return Look(
        to_sun=unit(-0.72, 1.0, 0.08),
        sun=vector(0.97, 0.935, 0.89),
        sky=vector(0.44, 0.47, 0.51),
        ground=vector(0.30, 0.295, 0.285),
        horizon=linear("#dbe1e6"),
        zenith=linear("#a3b1bd"),
        floor=linear("#dadcdd"),
        solid=linear("#d9a982"),
        line=linear("#5b6b78"),
        line_strength=0.75,
        pane=linear("#f4f8fa"),
        glass=0.0,
        wrap=0.25,
        gloss=0.18,
        sun_size=0.10,
        shade_depth=2.0,
        **STUDIO,
        lamp=vector(1.5, 1.55, 1.6),
        glow=vector(0.55, 0.75, 0.85),
        sparkle=3.0,
        veil=0.25,
        caustic=0.5,
        tile=0.0,
        paving=0,
    )


@functools.cache
def pool() -> Look:
    """A tiled floor in the open: worlds in space, seen as water."""
    return under_sky(
        dataclasses.replace(
            studio(),
            sun=vector(1.25, 1.16, 1.02),
            sky=vector(0.42, 0.50, 0.60),
            ground=vector(0.30, 0.31, 0.31),
            horizon=linear("#d9e4ec"),
            zenith=linear("#4f7ba6"),
            floor=linear("#b9bcb9"),
            solid=linear("#e09a5c"),
            line=linear("#eef4f7"),
            tile=0.1,
            paving=1,
            sun_size=0.04,
        )
    )


@functools.cache
def paper() -> Look:
    """Even light on white paper: worlds in the plane."""
    return Look(
        to_sun=unit(-0.35, 0.55, 1.0),
        sun=vector(0.36, 0.36, 0.36),
        sky=vector(0.72, 0.72, 0.72),
        ground=vector(0.52, 0.52, 0.54),
        horizon=vector(2.5, 2.5, 2.5),  # the tone mapper makes it white
        zenith=vector(2.5, 2.5, 2.5),
        floor=linear("#ffffff"),
        solid=linear("#cda587"),
        line=linear("#3c444b"),
        line_strength=1.0,
        pane=linear("#edf2f5"),
        glass=1.0,
        wrap=0.5,
        gloss=0.0,
        sun_size=0.0,
        shade_depth=1.0,
        **STUDIO,
        lamp=vector(0.5, 0.55, 0.6),
        glow=vector(0.35, 0.55, 0.70),
        sparkle=0.0,
        veil=0.0,
        caustic=0.0,
        tile=0.0,
        paving=0,
    )


WATER = {2: "#3a8cc2", 3: "#4aa6c8"}  # what white becomes behind so much water as is usual in the world


def usual_depth(extent: Extent) -> float:
    """Depth of water [m] at which its colour is the one it is named by."""
    return 0.75 * extent.radius if extent.dim == 3 else extent.spacing


def fluid_optics(color: str | None, extent: Extent) -> tuple[np.ndarray, float, np.ndarray]:
    """Absorption and scattering [1/m] of a fluid, and the tint of its depth, from the colour that it gives to white."""
    usual = usual_depth(extent)
    seen = np.clip(to_linear(np.array(rgb_of(color or WATER[extent.dim]))), 0.02, 0.98)
    scattering = (0.5 if extent.dim == 3 else 0.9) / usual
    return vector(*(-np.log(seen) / usual)), float(scattering), vector(*seen**0.6)


def lit_floor(look: Look) -> np.ndarray:
    """Radiance of a floor that nothing shades."""
    return vector(*(look.floor * (look.to_sun[1] * look.sun + look.sky)))


def linear(color: str) -> np.ndarray:
    """Return the linear RGB of a colour `#rrggbb`, as a kernel argument."""
    return vector(*to_linear(np.array(rgb_of(color))))


def unit(x: float, y: float, z: float) -> np.ndarray:
    """Return the unit vector in a direction, as a kernel argument."""
    return vector(*(vector(x, y, z) / np.linalg.norm([x, y, z]).astype(np.float32)))
