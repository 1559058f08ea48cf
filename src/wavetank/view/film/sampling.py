"""Points for the samples of a pixel: well spread pairs of numbers that belong to pixel, sample and purpose.

B. Burley, "Practical Hash-based Owen Scrambling", JCGT 9 (2020): Sobol's first two dimensions, shuffled and scrambled
again for every pair of numbers that a path needs. Nothing depends on threads.
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec2, vec3
from wavetank.view.optics.hash_noise import scrambled


@qd.func
def reversed_bits(x):
    """The bits of a number in the opposite order."""
    x = ((x >> 1) & qd.u32(0x55555555)) | ((x & qd.u32(0x55555555)) << 1)
    x = ((x >> 2) & qd.u32(0x33333333)) | ((x & qd.u32(0x33333333)) << 2)
    x = ((x >> 4) & qd.u32(0x0F0F0F0F)) | ((x & qd.u32(0x0F0F0F0F)) << 4)
    x = ((x >> 8) & qd.u32(0x00FF00FF)) | ((x & qd.u32(0x00FF00FF)) << 8)
    return (x >> 16) | (x << 16)


@qd.func
def nested(x, seed):
    """Owen's nested scrambling of a reversed number (Laine and Karras 2011, constants of Burley's)."""
    x += seed
    x ^= x * qd.u32(0x6C50B47C)
    x ^= x * qd.u32(0xB82F1E52)
    x ^= x * qd.u32(0xC7AFE638)
    x ^= x * qd.u32(0x8D22F6E6)
    return x


@qd.func
def pair(seed, index, purpose):
    """Two numbers from 0 to 1 (vec2) of sample `index`, below 4096, for a purpose."""
    own = scrambled(seed ^ (qd.cast(purpose, qd.u32) * qd.u32(0x9E3779B9) + qd.u32(0x7F4A7C15)))
    i = reversed_bits(nested(reversed_bits(qd.cast(index, qd.u32)), own)) & qd.u32(4095)
    y, v, rest = qd.u32(0), qd.u32(0x80000000), i
    for _ in range(12):
        if rest & qd.u32(1) == qd.u32(1):
            y ^= v
        rest = rest >> 1
        v ^= v >> 1
    x = reversed_bits(nested(i, scrambled(own + qd.u32(1))))
    y = reversed_bits(nested(reversed_bits(y), scrambled(own + qd.u32(2))))
    per = 1.0 / 16777216.0
    return vec2(qd.cast(x >> 8, qd.f32) * per, qd.cast(y >> 8, qd.f32) * per)


@qd.func
def frame_of(n):
    """Two unit vectors across a unit vector (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 6, 2017)."""
    sign = qd.select(n.z < 0.0, -1.0, 1.0)
    a = -1.0 / (sign + n.z)
    b = n.x * n.y * a
    return vec3(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), vec3(b, sign + n.y * n.y * a, -n.y)


@qd.func
def disc(u):
    """A uniformly distributed point of the unit disc (Shirley and Chiu 1997)."""
    a, b = 2.0 * u.x - 1.0, 2.0 * u.y - 1.0
    r, turn = 0.0, 0.0
    if qd.abs(a) > qd.abs(b):
        r, turn = a, 0.785398163 * b / a
    elif b != 0.0:
        r, turn = b, 1.570796327 - 0.785398163 * a / b
    return vec2(r * qd.cos(turn), r * qd.sin(turn))


@qd.func
def cosine_direction(n, u):
    """A cosine-distributed direction around the normal `n`."""
    p = disc(u)
    across, up = frame_of(n)
    return (p.x * across + p.y * up + qd.sqrt(qd.max(1.0 - p.x * p.x - p.y * p.y, 0.0)) * n).normalized(1e-12)


@qd.func
def lamp_direction(axis, wide, u):
    """A direction to a round lamp in the direction `axis` whose radius has the tangent `wide`."""
    p = wide * disc(u)
    across, up = frame_of(axis)
    return (axis + p.x * across + p.y * up).normalized(1e-12)


@qd.func
def uniform_direction(u):
    """A direction, all of them equally probable."""
    up, turn = 1.0 - 2.0 * u.x, 6.283185307 * u.y
    flat = qd.sqrt(qd.max(1.0 - up * up, 0.0))
    return vec3(flat * qd.cos(turn), up, flat * qd.sin(turn))
