"""Small balls in the cells of the grid: lone drops of water, and what spray and foam consist of.

code      symbol   meaning                                    unit
ball               middle and radius                          m
kind               0 water, 1 white froth                     1
"""

import dataclasses

from wavetank.device.compiler import qd


@dataclasses.dataclass(frozen=True, eq=False)
class Motes:
    """Balls by the cells that they touch, on the device."""

    start: qd.types.ndarray()  # i32 [cells + 1]: first entry of each cell in `list`
    list: qd.types.ndarray()  # i32: numbers of balls
    ball: qd.types.ndarray()  # vec4 [balls], m
    kind: qd.types.ndarray()  # i32 [balls]
