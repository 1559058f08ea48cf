"""Counting and prefix sums: the places of what is many times there, in an order that does not depend on threads."""

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
