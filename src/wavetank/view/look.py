"""How a picture is lit: the numbers that the passes share.

All colours are linear RGB; lengths are relative to the world, so that a puddle and a harbour look alike.
"""

import dataclasses

import numpy as np

from wavetank.compiler import qd
from wavetank.view.colormaps import rgb_of, to_linear
from wavetank.view.lens import vec3, vector


@dataclasses.dataclass
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


def studio() -> Look:
    """Neutral light studio with a warm sun from behind the left shoulder: worlds in space."""
    return Look(
        to_sun=_unit(-0.72, 1.0, 0.08),
        sun=vector(0.97, 0.935, 0.89),
        sky=vector(0.44, 0.47, 0.51),
        ground=vector(0.30, 0.295, 0.285),
        horizon=_linear("#dbe1e6"),
        zenith=_linear("#a3b1bd"),
        floor=_linear("#dadcdd"),
        solid=_linear("#d9a982"),
        line=_linear("#5b6b78"),
        line_strength=0.75,
        pane=_linear("#f4f8fa"),
        glass=0.0,
        wrap=0.25,
        gloss=0.18,
        sun_size=0.10,
        shade_depth=2.0,
    )


def paper() -> Look:
    """Even light on white paper: worlds in the plane."""
    return Look(
        to_sun=_unit(-0.35, 0.55, 1.0),
        sun=vector(0.36, 0.36, 0.36),
        sky=vector(0.72, 0.72, 0.72),
        ground=vector(0.52, 0.52, 0.54),
        horizon=vector(2.5, 2.5, 2.5),  # the tone mapper makes it white
        zenith=vector(2.5, 2.5, 2.5),
        floor=_linear("#ffffff"),
        solid=_linear("#cda587"),
        line=_linear("#3c444b"),
        line_strength=1.0,
        pane=_linear("#edf2f5"),
        glass=1.0,
        wrap=0.5,
        gloss=0.0,
        sun_size=0.0,
        shade_depth=1.0,
    )


def _linear(color: str) -> np.ndarray:
    return vector(*to_linear(np.array(rgb_of(color))))


def _unit(x: float, y: float, z: float) -> np.ndarray:
    return vector(x, y, z) / np.linalg.norm([x, y, z]).astype(np.float32)
