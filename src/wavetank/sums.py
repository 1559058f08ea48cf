"""Counting, prefix sums, and a sort by them; the sums do not depend on threads."""

from wavetank.compiler import qd

SCAN_BLOCK = 1024  # values that one thread sums up; the kernel spells it out


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
    key: qd.template(), order: qd.template(), start: qd.template(), fill: qd.template(), blocks: qd.template(), keys,
    count, shared: qd.template(),
):  # fmt: skip
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
def sum_up(values: qd.template(), blocks: qd.template(), count, shared: qd.template()):
    """Replace the first `count` values by the sums of those before them, and write the total behind.

    One thread does it, or all threads share it where `shared`. To be called at the top level of a kernel.
    """
    if qd.static(shared):
        for b in range((count + 1023) // 1024):
            total = 0
            for k in range(b * 1024, qd.min((b + 1) * 1024, count)):
                total += values[k]
            blocks[b] = total
        qd.loop_config(serialize=True)
        for _ in range(1):
            total = 0
            for b in range((count + 1023) // 1024):
                own = blocks[b]
                blocks[b] = total
                total += own
            values[count] = total
        for b in range((count + 1023) // 1024):
            total = blocks[b]
            for k in range(b * 1024, qd.min((b + 1) * 1024, count)):
                own = values[k]
                values[k] = total
                total += own
    else:
        # A processor is done with it before other threads have started, or nearly so.
        qd.loop_config(serialize=True)
        for _ in range(1):
            total = 0
            for k in range(count):
                own = values[k]
                values[k] = total
                total += own
            values[count] = total
