"""Which kernel applies which force of a scene; a force of a user's own brings its own `apply`."""

from collections.abc import Callable

from wavetank.device.state import Particles
from wavetank.physics.forces.attract import apply_attract
from wavetank.physics.forces.burst import apply_burst
from wavetank.physics.forces.drag import apply_drag
from wavetank.physics.forces.jet import apply_jet
from wavetank.physics.forces.sway import apply_sway
from wavetank.physics.forces.vortex import apply_vortex
from wavetank.physics.forces.wind import apply_wind
from wavetank.scene.forces import Attract, Burst, Drag, Force, Sway, Vortex, Wind
from wavetank.scene.forces.jet import Jet

KERNELS: dict[type[Force], Callable[..., None]] = {
    Attract: apply_attract,
    Burst: apply_burst,
    Drag: apply_drag,
    Jet: apply_jet,
    Sway: apply_sway,
    Vortex: apply_vortex,
    Wind: apply_wind,
}


def apply_force(force: Force, particles: Particles, count: int, dt: float, time: float) -> None:
    """Change the velocities of `count` particles for a substep of `dt` [s] that begins at `time` [s] of water."""
    kernel = next((KERNELS[kind] for kind in type(force).__mro__ if kind in KERNELS), None)
    if kernel is None or type(force).apply is not Force.apply:
        force.apply(particles, count, dt, time)
    else:
        kernel(force, particles, count, dt, time)
