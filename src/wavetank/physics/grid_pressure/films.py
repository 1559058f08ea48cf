"""Where water is a film, thinner than a cell or so, and the grid leaves it to the iterations.

In a film one cell lies between floor and air. Grid and iterations both see the whole of what it is too dense by, and
each answers it in full. What removes an error more than 4/3 times in a step makes it grow with its sign changed, and
more than 1.2 times where a share of the pressure is carried on: layers on floors jumped up and down by 0.02 spacings
from step to step, for ever, and now and then a particle was thrown (notebook/calm.md). Iterations alone reach
through a film.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import CoarseGrid
from wavetank.physics.grid_pressure.coarse_grid import beside_on, ramp
from wavetank.physics.grid_pressure.surface import is_below_air, nodes_beyond
from wavetank.physics.grid_pressure.thin_walls import shut_towards


@qd.func
def reach():
    """Nodes on each side that are looked at; water that goes on beyond is no film."""
    return 3


@qd.func
def thickness(grid: CoarseGrid, n, axis: qd.template()):
    """Cells of water along an axis through node `n`, from a floor or wall to the air; many where it is no film."""
    total = qd.min(grid.fill[n], 1.0)
    closed, open = 0, 0
    for side in qd.static((-1, 1)):
        nodes = nodes_beyond(grid, n, axis, side)
        m, ended = n, 0
        for _ in range(qd.min(nodes, reach())):
            if ended == 0:
                before = m
                m = beside_on(grid, m, axis, side)
                if grid.room[m] <= 0.0 or shut_towards(grid, before, m, axis) == 1:
                    closed, ended = closed + 1, 1
                else:
                    total += qd.min(grid.fill[m], 1.0)
                    if grid.fill[m] < 0.5:
                        open, ended = open + 1, 1
        if ended == 0 and nodes < reach():  # the tank ends there
            closed += 1
    return qd.select(closed == 1 and open == 1, total, 2.0 * reach())


@qd.func
def left_to_grid(grid: CoarseGrid, n, thin, thick):
    """Share of the errors at node `n` that is the grid's: none where water is `thin` [cells], all where `thick`.

    A film is no deeper than that below the air.
    """
    cells = 2.0 * reach()
    if grid.fill[n] >= 0.5 and grid.room[n] > 0.0 and is_below_air(grid, n):
        for axis in qd.static(range(3)):
            if grid.nz > 1 or axis < 2:
                cells = qd.min(cells, thickness(grid, n, axis))
    return ramp(cells, thin, thick)
