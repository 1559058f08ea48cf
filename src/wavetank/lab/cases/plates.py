"""A thick fluid without weight between two walls of its tank, driven along them: Poiseuille's flow."""

from wavetank.lab.cases.case import Case, Outcome
from wavetank.lab.cases.viscous_flow import DRIVES, POISEUILLE, compared, layers_in
from wavetank.scene.forces.sway import Sway
from wavetank.scene.scene import Scene


def scene(dim: int, layers: int, drive: float) -> Scene:
    """Return the channel with so many layers; the `drive` [m/s^2] is that of a tank that accelerates the other way."""
    sway = Sway(acceleration=(-drive, 0.0, 0.0)[:dim])
    return layers_in(dim, layers, 1.0, gravity=(0.0,) * dim, forces=[sway])


def run(quick: bool, arch: str) -> Outcome:
    """Drive it hard and gently, in 2-D at two spacings and in 3-D (quick: once)."""
    flows = [(2, 16, 1.0)] if quick else [(2, n, a) for n in (16, 32) for a in DRIVES] + [(3, 16, a) for a in DRIVES]
    return compared(scene, POISEUILLE, flows, arch)


CASE = Case("plates", "Flow between two plates", run)
