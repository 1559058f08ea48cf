"""How much of a body the water is, in the sun's view: what bent rays through a tank ask for (`optics/body.py`).

Broken water leaves air in the sun's way. Its share is averaged over four spacings, because single lumps that come and
go would turn what is seen through the water on and off.
"""

from wavetank.device.compiler import qd
from wavetank.view.buffers import Buffers
from wavetank.view.lens import Lens, ray_direction, ray_origin, view_ray
from wavetank.view.optics.body import wall_ahead
from wavetank.view.optics.rays import Box
from wavetank.view.shot import Shot
from wavetank.view.water_buffers import UNIT, SunlitWater, water_of


def draw_from_sun(shot: Shot, buffers: Buffers) -> None:
    """Fill the share of water in the sun's way; `sunlit.spare` holds it before it is averaged."""
    if shot.frame.dim == 3 and shot.frame.scene.tank:
        water = water_of(buffers, shot)
        fill(water.sunlit, water.sun_thickness.water, shot.water_sun, shot.walls, shot.extent.spacing / UNIT)
        average(water.sunlit)


@qd.kernel(fastcache=True)
def fill(sunlit: SunlitWater, column: qd.types.ndarray(), sun: Lens, walls: Box, unit: qd.f32):
    """Put the share of water, in 1 / 4096, in every texel that shows some; -1 in the others."""
    for row, texel in qd.ndrange(column.shape[0], column.shape[1]):
        share = -1
        if sunlit.depth[row, texel] < 0x7F000000:  # FARTHEST
            ray = view_ray(sun, row, texel)
            at = ray_origin(sun, ray) + qd.bit_cast(sunlit.depth[row, texel], qd.f32) * sun.forward
            length = qd.min(wall_ahead(walls, at, ray_direction(sun, ray))[3], 1e3)
            share = qd.cast(4096.0 * qd.min(column[row, texel] * unit / qd.max(length, 1e-6), 1.0), qd.i32)
        sunlit.spare[row, texel] = share


@qd.kernel(fastcache=True)
def average(sunlit: SunlitWater):
    """Average over the texels around each that show water, nearer ones counting more."""
    for row, texel in qd.ndrange(sunlit.whole.shape[0], sunlit.whole.shape[1]):
        total, weight = 0, 0
        for n in range(25):
            r, c = row + 2 * (n // 5 - 2), texel + 2 * (n % 5 - 2)
            if r >= 0 and c >= 0 and r < sunlit.whole.shape[0] and c < sunlit.whole.shape[1]:
                if sunlit.spare[r, c] >= 0:
                    share = (3 - qd.abs(n // 5 - 2)) * (3 - qd.abs(n % 5 - 2))
                    total += share * sunlit.spare[r, c]
                    weight += share
        sunlit.whole[row, texel] = total // qd.max(weight, 1)
