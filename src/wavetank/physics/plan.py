"""Which terms a time step has, and with which numbers: made by `planning.plan_step`."""

import dataclasses

from wavetank.physics.broad_phase import Obstacles
from wavetank.physics.density_constraint import Correction
from wavetank.physics.mixture import Blend


@dataclasses.dataclass(frozen=True)
class Plan:
    """Which terms a step has. Whole numbers are what kernels are specialised by: 1 where so, else 0."""

    kinds: Blend  # the fluids
    method: int  # smoothing kernel: its place in KERNELS
    obstacles: Obstacles
    correction: Correction  # of the first iteration
    later_correction: Correction  # of the others
    pressure_iterations: int  # with artificial pressure
    confines_vorticity: int  # whether vortices are confined
    has_surface_tension: bool  # fluids have surface tension
    has_viscosity: bool  # fluids have viscosity that matters
    high_viscosity: bool  # so much that they carry on what pressed them
    stirred_by_solids: bool  # solids move through it
    push_limit: float  # how far it limits corrections of positions, from 0 to 1
    iterations: int
    has_friction: bool  # walls or solids hold sliding back
    has_xsph: bool  # velocities are drawn to each other
    xsph_is_central: bool  # along the line between particles, which in the open leaves angular momentum alone
    on_grid: bool  # errors of the whole tank are removed on a grid
    warm_start: float  # share of the pressure of the last step that it begins with
