"""XSPH viscosity as a term of the step: in tanks by Eq. 11, by mass in mixtures, along lines of pairs in the open."""

from wavetank.device.state import Coefficients
from wavetank.foundation.params import Parameters
from wavetank.physics.plan import Plan
from wavetank.physics.terms.central_xsph import apply_central_xsph
from wavetank.physics.terms.term import Hook, Term
from wavetank.physics.terms.xsph_viscosity import apply_mixed_xsph, apply_xsph, pack_velocities
from wavetank.physics.world import World


def smooth_velocities(world: World, plan: Plan, params: Parameters, c: Coefficients) -> None:
    """Apply the XSPH viscosity that the fluids ask for; find the vorticity if it is to be confined."""
    particles, spare, grid, count = world.particles, world.spare, world.grid, world.count
    mixed = plan.kinds.mixed and plan.has_xsph
    if plan.confines_vorticity or not (mixed or plan.xsph_is_central):
        apply_xsph(spare, particles, world.temporaries, grid, c, count, plan.method, plan.confines_vorticity)
    if mixed or plan.xsph_is_central:
        packed = world.fluids.array("packed")
        if mixed:
            pack_velocities(packed, particles, world.temporaries.inverse_mass, count)
            apply_mixed_xsph(spare, particles, packed, grid, c, count, plan.method)
        else:
            pack_velocities(packed, particles, world.temporaries.lam, count)
            apply_central_xsph(spare, particles, packed, grid, c, count, plan.method)
    world.swap_arrays("v")


XSPH = Term("XSPH", Hook.VELOCITIES, smooth_velocities, lambda plan: plan.has_xsph or bool(plan.confines_vorticity))
