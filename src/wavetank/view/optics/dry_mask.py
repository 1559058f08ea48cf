"""Which pixels no water takes the sun from: those that are as they were in the picture before.

The sun's view of the water is divided into cells, at most `CELLS` to a side. Pixels that come together know between
which cells they lie, as long as neither eye nor solids move: where all of these are dry, the sun is all there.

    bits        hold
    0 to 27     first and last column, first and last row of these cells, seven each
    29          1 where these are known
    30          1 where the pixels show no shadow of the water
"""

from wavetank.device.compiler import qd
from wavetank.view.water_buffers import SunlitWater


@qd.kernel(fastcache=True)
def mark_wet_cells(sunlit: SunlitWater, water: qd.types.ndarray()):
    """Mark the cells where something is read, of `water` along the sun's rays or of caustics, that is not zero."""
    cells, texels = sunlit.wet.shape[0], sunlit.depth.shape[0]
    wide = (texels + cells - 1) // cells
    for row, column in qd.ndrange(sunlit.wet.shape[0], sunlit.wet.shape[0]):
        found = 0
        # Between the four texels around a place one beside its own is read.
        for r in range(qd.max(row * wide - 1, 0), qd.min((row + 1) * wide + 1, texels)):
            for c in range(qd.max(column * wide - 1, 0), qd.min((column + 1) * wide + 1, texels)):
                found = found | water[r, c] | sunlit.caustic[r, c]
        sunlit.wet[row, column] = qd.cast(found != 0, qd.i32)


@qd.func
def cells_between(lowest, highest, texels, cells):
    """(first and last column, first and last row) of the cells between two places in texels, packed as above."""
    wide = (texels + cells - 1) // cells
    low, high = qd.max(lowest, 0.0), qd.min(highest, texels - 1.0)
    result = (1 << 29) | 127 | (127 << 14)
    if low.x <= high.x and low.y <= high.y:
        result = (1 << 29) | qd.cast(low.x, qd.i32) // wide | (qd.cast(high.x, qd.i32) // wide << 7)
        result = result | (qd.cast(low.y, qd.i32) // wide << 14) | (qd.cast(high.y, qd.i32) // wide << 21)
    return result


@qd.func
def all_cells_dry(wet: qd.template(), known):
    """Whether all cells are dry between which pixels lie that are `known`; False of others."""
    found = qd.cast(known & (1 << 29) == 0, qd.i32)
    if found == 0:
        for row in range((known >> 14) & 127, ((known >> 21) & 127) + 1):
            for column in range(known & 127, ((known >> 7) & 127) + 1):
                found = found | wet[row, column]
    return found == 0


@qd.func
def drawn_dry(known):
    """Whether pixels show no water's shadow."""
    return (known >> 30) & 1 == 1


@qd.func
def with_dryness(known, dry):
    """What is known of pixels that have been painted, in no water's shadow where `dry`."""
    return (known & ~(1 << 30)) | (qd.cast(dry, qd.i32) << 30)
