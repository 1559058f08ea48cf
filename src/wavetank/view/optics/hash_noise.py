"""Numbers that look random and belong to what they are asked for, so that they do not flicker."""

from wavetank.device.compiler import qd


@qd.func
def scrambled(x):
    """Scramble the bits of an unsigned number (Chris Wellons, "Prospecting for hash functions", 2018)."""
    x ^= x >> 16
    x *= qd.u32(0x7FEB352D)
    x ^= x >> 15
    x *= qd.u32(0x846CA68B)
    return x ^ (x >> 16)


@qd.func
def bits_of(number, k):
    """32 bits of entry `k`, 0 to 63, of what has that number."""
    return scrambled(qd.cast(number, qd.u32) * qd.u32(64) + qd.cast(k, qd.u32) + qd.u32(0x9E3779B9))


@qd.func
def share_of_bits(bits, part: qd.template()):
    """A number from 0 to 1 out of ten of 32 bits: part 0, 1 or 2."""
    return qd.cast((bits >> qd.static(10 * part)) & qd.u32(1023), qd.f32) / 1024.0
