"""Counting, prefix sums, and a sort by them; the sums do not depend on threads."""

from wavetank.device.compiler import qd


@qd.func
def scan_block():
    """Values, or sums of as many, that one thread sums up."""
    return 128


@qd.func
def many_threads():
    """Threads of a graphics processor that come to one number together: few enough to wait for each other."""
    return 16384


@qd.func
def blocks_in(count):
    """Blocks of so many values."""
    return (count + scan_block() - 1) // scan_block()


def blocks_of(values: int) -> int:
    """Return how many sums `sum_up` needs room for: of all blocks, and of all blocks of these."""
    blocks = -(-values // scan_block.fn())
    return max(1, blocks + -(-blocks // scan_block.fn()))


@qd.func
def count_one(values: qd.template(), at, shared: qd.template()):
    """Add one to a value and return what it was; no other thread may do so unless it is `shared`."""
    before = 0
    if qd.static(shared):
        before = qd.atomic_add(values[at], 1)
    else:
        before = values[at]
        values[at] = before + 1
    return before


@qd.func
def sort_by(
    key: qd.template(),
    order: qd.template(),
    start: qd.template(),
    fill: qd.template(),
    blocks: qd.template(),
    keys,
    count,
    shared: qd.template(),
):
    """Write the numbers below `count` into `order` so that their `key` rises, and where each of so many `keys` starts.

    One thread does it, or all threads share it where `shared`, and then the order within a key is chance. `fill` and
    `blocks` are scratch. To be called at the top level of a kernel.
    """
    qd.loop_config(serialize=not shared)
    for k in range(keys):
        start[k] = 0
    qd.loop_config(serialize=not shared)
    for i in range(count):
        count_one(start, key[i], shared)
    sum_up(start, blocks, keys, shared)
    qd.loop_config(serialize=not shared)
    for k in range(keys):
        fill[k] = start[k]
    qd.loop_config(serialize=not shared)
    for i in range(count):
        order[count_one(fill, key[i], shared)] = i


@qd.func
def share_of(thread, count):
    """How many of `count` things one of `many_threads` sees to: number `thread`, and so on in steps of as many.

    For one number from all of them on a graphics processor. There every 32 threads bring in what they have found, one
    exchange after the other, and in a loop over things there are as many threads as the card has room for.
    """
    return (count + many_threads() - 1 - thread) // many_threads()


@qd.func
def sum_of(values: qd.template(), begin, end):
    """The sum of the values from `begin` to `end`."""
    total = 0
    for k in range(begin, end):
        total += values[k]
    return total


@qd.func
def run_up(values: qd.template(), begin, end, total):
    """Replace the values from `begin` to `end` by `total` and the sums of those before them; return the sum of all."""
    for k in range(begin, end):
        own = values[k]
        values[k] = total
        total += own
    return total


@qd.func
def sum_up(values: qd.template(), blocks: qd.template(), count, shared: qd.template()):
    """Replace the first `count` values by the sums of those before them, and write the total behind.

    One thread does it, or all threads share it where `shared`, in blocks and blocks of blocks (Blelloch 1990, "Prefix
    sums and their applications"). To be called at the top level of a kernel.
    """
    if qd.static(shared):
        for b in range(blocks_in(count)):
            blocks[b] = sum_of(values, b * scan_block(), qd.min((b + 1) * scan_block(), count))
        for b in range(blocks_in(blocks_in(count))):
            few = blocks_in(count)
            blocks[few + b] = sum_of(blocks, b * scan_block(), qd.min((b + 1) * scan_block(), few))
        qd.loop_config(serialize=True)
        for _ in range(1):
            few = blocks_in(count)
            values[count] = run_up(blocks, few, few + blocks_in(few), 0)
        for b in range(blocks_in(blocks_in(count))):
            few = blocks_in(count)
            run_up(blocks, b * scan_block(), qd.min((b + 1) * scan_block(), few), blocks[few + b])
        for b in range(blocks_in(count)):
            run_up(values, b * scan_block(), qd.min((b + 1) * scan_block(), count), blocks[b])
    else:
        # A processor is done with it before other threads have started, or nearly so.
        qd.loop_config(serialize=True)
        for _ in range(1):
            values[count] = run_up(values, 0, count, 0)
