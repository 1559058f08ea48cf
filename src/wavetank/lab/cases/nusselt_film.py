"""A film of a thick fluid runs down a slope: Nusselt's flow.

Known: a packing of particles is a crystal, whose rows lock below some pascals of stress, so that what is driven gently
creeps less than it should.
"""

from wavetank.lab.cases.case import Case, Outcome
from wavetank.lab.cases.viscous_flow import DRIVES, GRAVITY, NUSSELT, compared, layers_in
from wavetank.scene.scene import Scene


def scene(dim: int, layers: int, drive: float) -> Scene:
    """Return the film with so many layers, its gravity leant by the `drive` [m/s^2]."""
    return layers_in(dim, layers, 2.0, gravity=(drive, -GRAVITY, 0.0)[:dim])


def run(quick: bool, arch: str) -> Outcome:
    """Drive it hard and gently, in 2-D at two spacings and in 3-D (quick: once)."""
    flows = [(2, 16, 1.0)] if quick else [(2, n, a) for n in (16, 32) for a in DRIVES] + [(3, 16, a) for a in DRIVES]
    return compared(scene, NUSSELT, flows, arch)


CASE = Case("nusselt-film", "A film that runs down a slope", run)
