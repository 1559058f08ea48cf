"""Arrays of one picture size, allocated once and refilled by every picture.

rows x columns are the pixels that are computed: `supersample` times the picture's in each direction.
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd, upload
from wavetank.view.colormaps import to_srgb
from wavetank.view.lens import vec2, vec3

# What `surface` holds besides the places of particles. Kernels spell the numbers out, because the compiler's cache
# does not see global constants; depths are kept as their bit pattern, which orders like the depth itself.
NOTHING, SOLID, FLOOR = 0x7FFFFFFF, -1, -2
FARTHEST = 0x7F000000  # bits of 1.7e38 m
CURVE_ENTRIES = 8192  # so many that the steepest part of the sRGB curve loses no byte


@dataclasses.dataclass(frozen=True, eq=False)
class Pixels:
    """What each computed pixel shows, [rows, columns], on the device."""

    depth: qd.types.ndarray()  # i32: bits of the f32 depth along the view [m] of the nearest surface
    surface: qd.types.ndarray()  # i32: place of the particle in device order, or NOTHING, SOLID, FLOOR
    normal: qd.types.ndarray()  # vec3, unit, in the world
    color: qd.types.ndarray()  # vec3, linear RGB: albedo until the shade pass, radiance from then on
    lines: qd.types.ndarray()  # i32: marks of the edges of the tank, see `optics/edge_coverage.py`; or 0


@dataclasses.dataclass(frozen=True, eq=False)
class Light:
    """Light that reaches what every `step`-th row and column shows, on the device."""

    share: qd.types.ndarray()  # vec2: share of the sun, share of the sky
    rough: qd.types.ndarray()  # vec2: the same while it is being smoothed
    step: qd.i32


@dataclasses.dataclass(frozen=True, eq=False)
class FoamMaps:
    """Foam over each pixel of the picture, and over each texel of a coarser relief, on the device."""

    sums: qd.types.ndarray()  # i32 [height, width, 3]: optical depth, its part in the sun, and times the water above
    relief: qd.types.ndarray()  # i32 [texels]: optical depth in 1/4096
    light: qd.types.ndarray()  # vec2 [texels]: share of the sun and of the sky that its slopes get


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """Where what the picture shows goes, over texels of at least four pixels, on the device."""

    sums: qd.types.ndarray()  # i32 [texels, 3]: points, and their ways to the right and down in 1/64 px
    way: qd.types.ndarray()  # vec2 [texels], px: the mean around


class Paints:
    """Albedos of solids on the device, written anew when they change."""

    def __init__(self) -> None:
        self.colors: np.ndarray = np.zeros((0, 3), np.float32)
        self.device = qd.ndarray(vec3, shape=(1,))

    def of(self, colors: np.ndarray) -> Any:
        """Return a device array vec3 [n] of these `colors` [n, 3], linear RGB."""
        if self.colors.shape != colors.shape or (self.colors != colors).any():
            if len(colors) > self.device.shape[0]:
                self.device = qd.ndarray(vec3, shape=(len(colors),))
            upload(self.device, colors)
            self.colors = colors
        return self.device


@dataclasses.dataclass
class Buffers:
    """What the passes hand to each other."""

    pixels: Pixels
    light: Light | None  # on every pixel; see `with_light`
    foam: FoamMaps
    motion: Motion
    sun_depth: Any  # i32 [texels, texels]: bits of the depth [m] of what the sun sees first
    solid_box: Any  # i32 [4]: first and last column, first and last row that may show a solid
    streak_box: Any  # i32 [4]: the same of streaks, in pixels of the picture
    paints: Paints  # of solids
    glass_paints: Paints  # of those of glass
    curve: Any  # i32 [entries]: sRGB byte of linear light 0 to 1, in equal steps
    picture: Any  # i32 [words]: the finished picture, three sRGB bytes a pixel, row by row
    water: Any  # WaterBuffers once a picture of water was taken
    supersample: int  # computed pixels per pixel of the picture, in each direction
    probes: int  # of light per computed pixel: fewer where more pixels are averaged
    ice: Any = None  # vec [capacity]: places where ice alone is drawn, once it was [m]

    @property
    def rows(self) -> int:
        """Computed pixels from top to bottom."""
        return int(self.pixels.depth.shape[0])

    @property
    def columns(self) -> int:
        """Computed pixels from left to right."""
        return int(self.pixels.depth.shape[1])

    @property
    def texels(self) -> int:
        """Edge of the sun's depth map in pixels."""
        return int(self.sun_depth.shape[0])

    def with_light(self) -> Light:
        """Return the light on every pixel, allocated by the first view that needs it."""
        if self.light is None:
            self.light = new_light(self.rows, self.columns, 1)
        return self.light

    def host_picture(self) -> np.ndarray:
        """Return a copy of the finished picture, uint8 [height, width, 3]."""
        shape = (self.rows // self.supersample, self.columns // self.supersample, 3)
        return download(self.picture).view(np.uint8)[: shape[0] * shape[1] * 3].reshape(shape).copy()


def allocate(width: int, height: int, supersample: int) -> Buffers:
    """Return buffers for a picture of `width` x `height` pixels with `supersample`^2 samples in each."""
    shape = (height * supersample, width * supersample)
    # As fine as the picture, within what a shadow needs and a device likes.
    coarse = (height // 2 + 2, width // 2 + 2)
    coarser = (height // 4 + 2, width // 4 + 2)
    texels = min(2048, max(256, shape[0]))
    curve = qd.ndarray(qd.i32, shape=(CURVE_ENTRIES,))
    upload(curve, (255.0 * to_srgb(np.linspace(0.0, 1.0, CURVE_ENTRIES)) + 0.5).astype(np.int32))
    return Buffers(
        pixels=Pixels(
            depth=qd.ndarray(qd.i32, shape=shape),
            surface=qd.ndarray(qd.i32, shape=shape),
            normal=qd.ndarray(vec3, shape=shape),
            color=qd.ndarray(vec3, shape=shape),
            lines=qd.ndarray(qd.i32, shape=shape),
        ),
        light=None,
        foam=FoamMaps(
            sums=qd.ndarray(qd.i32, shape=(height, width, 3)),
            relief=qd.ndarray(qd.i32, shape=coarse),
            light=qd.ndarray(vec2, shape=coarse),
        ),
        motion=Motion(sums=qd.ndarray(qd.i32, shape=(*coarser, 3)), way=qd.ndarray(vec2, shape=coarser)),
        sun_depth=qd.ndarray(qd.i32, shape=(texels, texels)),
        solid_box=qd.ndarray(qd.i32, shape=(4,)),
        streak_box=qd.ndarray(qd.i32, shape=(4,)),
        paints=Paints(),
        glass_paints=Paints(),
        curve=curve,
        picture=qd.ndarray(qd.i32, shape=(3 * -(-height * width // 4),)),
        water=None,
        supersample=supersample,
        probes=8 if supersample == 1 else 4,
    )


def new_light(rows: int, columns: int, step: int) -> Light:
    """Allocate light for every `step`-th of so many rows and columns."""
    shape = (-(-rows // step), -(-columns // step))
    share, rough = (qd.ndarray(vec2, shape=shape) for _ in range(2))
    return Light(share=share, rough=rough, step=step)
