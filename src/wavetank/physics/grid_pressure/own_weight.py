"""What particles weigh among those of another fluid.

The grid's push is the gradient of a smooth pressure over the mean density there: it accelerates all particles alike,
and where weight goes by faces (`weight.py`) it bears a drop of brine in water as it bears the water. Such drops hung
where they were: after a heavy fluid had fallen through a light one, a tenth of it stayed above (notebook/calm.md).

A particle that is foreign where it is therefore has the push that it would have as a sphere: at rest on top of what
bears the fluid around, the buoyancy (rho_e - rho_i) g over the inertia rho_i + rho_e / 2 of the sphere and of the fluid
that it carries along (added mass: Lamb 1932, Hydrodynamics, art. 92). How foreign it is, is how far its density lies
from the mean there, over how far it lies from any mean near by: 1 for a drop and in a mixture of single particles, 0
within its own fluid, about 1/3 for the layers on both sides of a level interface, which are to have no weight of their
own; what is higher by a spacing reads 0.7. As with the surface (`surface.py`), that also gives weight to its bumps.

    code        symbol     meaning                                                       unit
    density     rho_i      of the particle, over that of the heaviest fluid              1
    around      rho_e      mean at its place                                             1
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import nearest, ramp

FOREIGN = (0.45, 0.8)  # how foreign a particle is where its own weight begins to count, and where all of it does


@qd.func
def farthest_density(grid: CoarseGrid, middle, density, dim: qd.template()):
    """How far a `density` lies at most from the mean ones at the node at the whole coordinates `middle` and beside it.

    Nodes that are nearly empty are not asked.
    """
    farthest = 1e-3
    for k in range(3**dim):
        place = middle + qd.Vector([k % 3 - 1, k // 3 % 3 - 1, k // 9 - 1 if qd.static(dim == 3) else 0])
        n = nearest(grid, place)
        farthest = qd.max(farthest, qd.abs(grid.density[n] - density) if grid.fill[n] > 0.1 else 0.0)
    return farthest


@qd.func
def own_push(grid: CoarseGrid, s, at: qd.template(), weights: qd.template(), density, foreign_from, foreign_to):
    """The push of a particle at the place `s` [cells] over that of the fluid around it, by the nodes `at` it."""
    dim = qd.static(3 if at.n == 8 else 2)
    around = 0.0
    for k in qd.static(range(at.n)):
        around += weights[k] * grid.density[at[k]]
    foreign = qd.abs(around - density) / farthest_density(grid, qd.floor(s + 0.5, qd.i32), density, dim)
    share = ramp(foreign, foreign_from, foreign_to)
    return 1.0 + share * (around - density) / (density + 0.5 * around)
