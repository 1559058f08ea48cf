"""Levels of some thousand nodes on a graphics processor: a block of threads is done before as many launches begin."""

from wavetank.device.compiler import current_backend, qd, worth_sharing
from wavetank.device.state import CoarseGrid

BLOCK_NODES = 8192  # at most, of a level that one block of a graphics processor sees to


@qd.func
def block_threads():
    """Threads of a block of a graphics processor that see to a level."""
    return 512


@qd.func
def wait_for_block(fenced: qd.template()):
    """Wait until all threads of the block are here; what they wrote is read from here on.

    On CUDA that is what the barrier means, elsewhere it must be said, so that waits are `fenced`.
    """
    if qd.static(fenced):
        qd.simt.grid.mem_fence()
    qd.simt.block.sync()
    if qd.static(fenced):
        qd.simt.grid.mem_fence()


def is_shared(level: CoarseGrid) -> bool:
    """Whether all threads see to a `level`."""
    return worth_sharing(level.nx * level.ny * level.nz)


def in_block(level: CoarseGrid) -> bool:
    """Whether one block of a graphics processor sees to a `level`: it is done before as many launches have begun."""
    return current_backend() != "cpu" and level.nx * level.ny * level.nz <= BLOCK_NODES
