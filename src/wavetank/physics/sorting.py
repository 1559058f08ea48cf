"""Particles sorted into the cells of the neighbour search, and within a cell by their x.

Inside a cell particles stand in the order of their x, then of their ids, whatever the threads did: results repeat bit
for bit. They stood in nearly that order a step before, so that on a processor, where one thread sorts a cell, it is
sorted by insertion.

Counting sort after Green 2010 ("Particle Simulation using CUDA"); Hoetzlein 2014 ("Fast Fixed-Radius Nearest
Neighbors") for the counting by integer atomics. What there is little of is counted by one thread: waking the others
costs more than they save.
"""

from wavetank.device.compiler import qd, worth_sharing
from wavetank.device.state import Grid, Particles
from wavetank.device.sums import sort_by
from wavetank.physics.clusters import chunks_over, end_of_part, first_of_part
from wavetank.physics.predicted_positions import predict_at, predicted


@qd.func
def comes_before(particles: Particles, i, j):
    """Whether particle `i` stands before `j` in their cell."""
    x, other = particles.px[i], particles.px[j]
    return x < other or (x == other and particles.id[i] < particles.id[j])


@qd.func
def sort_cell(particles: Particles, grid: Grid, begin, end):
    """Sort the numbers of the particles of a cell, by insertion: they stood in that order a step before, or nearly."""
    for n in range(begin + 1, end):
        i, place = grid.order[n], n
        while place > begin and comes_before(particles, i, grid.order[qd.max(place - 1, 0)]):
            grid.order[place] = grid.order[place - 1]
            place -= 1
        grid.order[place] = i


@qd.func
def copy_place(target: Particles, to, source: Particles, i):
    """Copy where particle `i` of `source` is to the place `to` of `target`."""
    target.x[to] = source.x[i]


@qd.func
def copy_prediction(target: Particles, to, source: Particles, i):
    """Copy where it is to be."""
    predict_at(target, to, predicted(source, i))


@qd.func
def copy_velocity(target: Particles, to, source: Particles, i):
    """Copy its velocity."""
    target.v[to] = source.v[i]


@qd.func
def copy_acceleration(target: Particles, to, source: Particles, i):
    """Copy what is carried on of what accelerated it."""
    target.a[to] = source.a[i]
    if source.viscous.shape[0] > 1 and target.viscous.shape[0] > 1:
        target.viscous[to] = source.viscous[i]


@qd.func
def copy_identity(target: Particles, to, source: Particles, i):
    """Copy who it is."""
    target.id[to] = source.id[i]
    target.material[to] = source.material[i]


@qd.func
def copy_marks(target: Particles, to, source: Particles, i):
    """Copy what is marked on it."""
    target.near[to] = source.near[i]
    target.dye[to] = source.dye[i]
    target.frozen[to] = source.frozen[i]


#: All that is known of a particle. Arrays begin at the same place of a page: where more than eight of one kind are
#: copied at once, each drives another one out of a processor's first cache, and it took three times as long.
#: Append only.
PARTS_OF_PARTICLE = (copy_place, copy_prediction, copy_velocity, copy_acceleration, copy_identity, copy_marks)


@qd.func
def copy_particle(target: Particles, to, source: Particles, i):
    """Copy particle `i` of `source` to the place `to` of `target`."""
    for part in qd.static(range(len(PARTS_OF_PARTICLE))):
        qd.static(PARTS_OF_PARTICLE[part])(target, to, source, i)


@qd.kernel(fastcache=True)
def reorder(sorted_: Particles, particles: Particles, grid: Grid, count: qd.i32, shared: qd.template()):
    """Copy the particles into their sorted order, given the cell of each: count, sum up, fill in, sort cells, copy.

    One thread counts, or all threads share it where `shared`. A thread of a processor sorts a cell, one of a graphics
    processor finds the place of a particle.
    """
    # Some ten thousand particles are done before other threads have started.
    sort_by(grid.cell, grid.order, grid.start, grid.fill, grid.blocks, grid.cells, count, shared)
    if qd.static(grid.lanes > 1):
        # In one loop, because each wakes all threads.
        for chunk in range(chunks_over(grid.cells, grid.parts, grid.lanes)):
            begin = qd.min(first_of_part(chunk, grid.cells, grid.parts, grid.lanes), grid.cells)
            end = qd.max(end_of_part(chunk, grid.cells, grid.parts, grid.lanes), begin)
            for cell in range(begin, end):
                sort_cell(particles, grid, grid.start[cell], grid.start[cell + 1])
            for part in qd.static(range(len(PARTS_OF_PARTICLE))):
                for n in range(grid.start[begin], grid.start[end]):
                    qd.static(PARTS_OF_PARTICLE[part])(sorted_, n, particles, grid.order[n])
    else:
        for n in range(count):
            i = grid.order[n]
            cell = grid.cell[i]
            place = grid.start[cell]
            for k in range(place, grid.start[cell + 1]):
                place += qd.cast(comes_before(particles, grid.order[k], i), qd.i32)
            copy_particle(sorted_, place, particles, i)


def sort_particles(particles: Particles, spare: Particles, grid: Grid, count: int) -> None:
    """Sort `particles` by cell into `spare`; `grid.cell` holds the cell of each."""
    reorder(spare, particles, grid, count, int(worth_sharing(grid.cells + count)))
