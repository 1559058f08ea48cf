"""What a smooth surface of water does to a ray: Snell's law and Fresnel's equations for light without polarisation.

code      symbol   meaning                                                        unit
n                  unit normal against the ray                                    1
eta                refractive index on the ray's side over that on the other      1
mirror    F        share of the light that is reflected                           1
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import vec4


@qd.func
def index_of_water():
    """Refractive index of water over that of air."""
    return 1.33


@qd.func
def bent(ahead, n, eta):
    """(direction behind the surface, share that is reflected), vec4; a share of 1 is total reflection."""
    cosi = qd.min(qd.max(-ahead.dot(n), 0.0), 1.0)
    square = 1.0 - eta * eta * (1.0 - cosi * cosi)
    result = vec4(0.0, 0.0, 0.0, 1.0)
    if square > 0.0:
        cost = qd.sqrt(square)
        along = (eta * cosi - cost) / (eta * cosi + cost)
        across = (cosi - eta * cost) / (cosi + eta * cost)
        out = (eta * ahead + (eta * cosi - cost) * n).normalized(1e-12)
        result = vec4(out.x, out.y, out.z, 0.5 * (along * along + across * across))
    return result


@qd.func
def mirrored(ahead, n):
    """Direction of the reflected ray."""
    return (ahead - 2.0 * ahead.dot(n) * n).normalized(1e-12)


@qd.func
def through_drop(ball, at, n, inner, ahead):
    """(where a ray leaves a ball of water that it entered at `at` along `inner`, and its way in it; its direction)."""
    chord = -2.0 * ball.w * inner.dot(n)
    out = (2.0 * inner.dot(ahead) * inner - ahead).normalized(1e-12)
    p = at + chord * inner + 1e-4 * ball.w * out
    return vec4(p.x, p.y, p.z, chord), out
