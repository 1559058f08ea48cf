"""A thick fluid that lies between two slabs, driven along them: the same flow as between plates, under gravity.

It fills the channel to its roof. Known: calming at solids slows it, and what sags by a hundredth of its height leaves
the roof and loses its drag.
"""

from wavetank.lab.cases.case import Case, Outcome
from wavetank.lab.cases.viscous_flow import DRIVES, GRAVITY, HIGH, LONG, POISEUILLE, VISCOSITY, compared
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.solids.shapes import Box

SLAB = 4  # d


def scene(dim: int, layers: int, drive: float) -> Scene:
    """Return the channel with so many layers, its gravity leant by the `drive` [m/s^2]."""
    d = HIGH / layers
    thick, wide = SLAB * d, (12 * d,) * (dim - 2)
    lower, upper = (0.0, thick, 0.0)[:dim], (LONG * d, thick + HIGH, *wide)
    slabs = [
        Box(center=(0.5 * LONG * d, y, *(0.5 * edge for edge in wide)), size=(2.0 * LONG * d, thick, *wide * 2)[:dim])
        for y in (0.5 * thick, 1.5 * thick + HIGH)
    ]
    return Scene(
        spacing=d,
        gravity=(drive, -GRAVITY, 0.0)[:dim],
        tank=Tank(size=(LONG * d, HIGH + 3.0 * thick, *wide), periodic=["x", "z"][: dim - 1]),
        fluids=[Block(lower=lower, upper=upper)],
        solids=slabs,
        dynamic_viscosity=VISCOSITY,
        foam=0.0,
    )


def run(quick: bool, arch: str) -> Outcome:
    """Drive it hard and gently, in 2-D at two spacings (quick: once)."""
    flows = [(2, 16, 1.0)] if quick else [(2, n, a) for n in (16, 32) for a in DRIVES]
    return compared(scene, POISEUILLE, flows, arch)


CASE = Case("pipe", "A closed channel full of honey", run)
