"""Random numbers without a state: hashed from what they are for, so that they do not depend on who asks first.

The finaliser is a 32-bit mix of two multiplications in the form found by Chris Wellons, "Prospecting for hash
functions" (2018).
"""

from wavetank.device.compiler import qd


@qd.func
def mixed(x):
    """Scramble the bits of an unsigned number."""
    x ^= x >> 16
    x *= qd.u32(0x7FEB352D)
    x ^= x >> 15
    x *= qd.u32(0x846CA68B)
    return x ^ (x >> 16)


@qd.func
def stream(seed, frame, number):
    """Return the state of the random numbers of particle `number` in `frame`."""
    state = mixed(qd.cast(seed, qd.u32) + qd.u32(0x9E3779B9))
    state = mixed(state + qd.cast(frame, qd.u32))
    return mixed(state + qd.cast(number, qd.u32))


@qd.func
def uniform(state, k):
    """The k-th number from 0 to (not including) 1 of a stream."""
    return qd.cast(mixed(state + qd.cast(k, qd.u32) * qd.u32(0x9E3779B9)) >> 8, qd.f32) / 16777216.0
