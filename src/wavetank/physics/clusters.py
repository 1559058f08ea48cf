"""The loop over clusters of particles that passes over pairs share among threads.

A cluster is `grid.lanes` particles that follow each other in sorted order and are computed together (`pairs.py`), eight
on a processor and one on a graphics card:

    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):

Particles that share a neighbour list (`neighbors.py`) are a group, eight of them everywhere.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Grid


@qd.func
def chunk_bits():
    """Bits that number the chunks of a part on a processor: the first takes the whole part, the others nothing.

    The compiler gives a thread 512 chunks at least, which are too many clusters to share them out evenly.
    """
    return 9


@qd.func
def chunks_over(number, parts, lanes: qd.template()):
    """Number of chunks of a loop over `number` things in equal `parts`."""
    if qd.static(lanes == 1):
        return number
    return parts << chunk_bits()


@qd.func
def part_of(chunk):
    """Number of the part that a chunk takes, if any, on a processor."""
    return chunk >> chunk_bits()


@qd.func
def first_of_part(chunk, number, parts, lanes: qd.template()):
    """First of `number` things that a chunk takes."""
    if qd.static(lanes == 1):
        return chunk
    return part_of(chunk) * ((number + parts - 1) // parts)


@qd.func
def end_of_part(chunk, number, parts, lanes: qd.template()):
    """One past the last of `number` things that a chunk takes; the first where it takes none."""
    if qd.static(lanes == 1):
        return chunk + 1
    end = part_of(chunk) * ((number + parts - 1) // parts)
    if chunk & ((1 << chunk_bits()) - 1) == 0:
        end = qd.min(end + (number + parts - 1) // parts, number)
    return end


@qd.func
def groups(count):
    """Number of groups of `count` particles."""
    return (count + 7) >> 3


@qd.func
def group_of(i):
    """Number of the group of particle `i`."""
    return i >> 3


@qd.func
def place_in_group(i):
    """Which of the eight of its group particle `i` is."""
    return i & 7


@qd.func
def cluster_count(grid: Grid, count):
    """Number of clusters of `count` particles."""
    if qd.static(grid.lanes == 1):
        return count
    return (count + grid.lanes - 1) // grid.lanes


@qd.func
def chunks(grid: Grid, count):
    """Number of chunks of the loop over the clusters of `count` particles."""
    return chunks_over(cluster_count(grid, count), grid.parts, grid.lanes)


@qd.func
def first_cluster(chunk, grid: Grid, count):
    """First cluster of a chunk."""
    return first_of_part(chunk, cluster_count(grid, count), grid.parts, grid.lanes)


@qd.func
def end_cluster(chunk, grid: Grid, count):
    """One past the last cluster of a chunk."""
    return end_of_part(chunk, cluster_count(grid, count), grid.parts, grid.lanes)


@qd.func
def end_of(cluster, grid: Grid, count):
    """One past the last particle of a cluster."""
    return qd.min(cluster * grid.lanes + grid.lanes, count)
