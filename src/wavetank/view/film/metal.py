"""Metal as a rough conductor: B. Walter et al., "Microfacet models for refraction through rough surfaces" (2007).

Directions are drawn from the facets that the eye sees (E. Heitz, "Sampling the GGX distribution of visible normals",
JCGT 7, 2018); what a facet mirrors is C. Schlick's approximation of Fresnel's equations (1994).

    code      symbol   meaning                                                 unit
    rough     alpha    slope of the facets                                     1
    seen      v        unit vector to the eye                                  1
    h                  normal of a facet                                       1
"""

from wavetank.device.compiler import qd
from wavetank.view.film.sampling import disc, frame_of
from wavetank.view.lens import vec3


@qd.func
def rough():
    """Slope of the facets of all metal: cast, and polished once."""
    return 0.18


@qd.func
def facet(n, seen, u):
    """Normal of a visible facet, from two uniform random numbers `u`."""
    across, up = frame_of(n)
    v = vec3(rough() * seen.dot(across), rough() * seen.dot(up), seen.dot(n)).normalized(1e-12)
    one, two = vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)
    flat = v.x * v.x + v.y * v.y
    if flat > 1e-12:
        one = vec3(-v.y, v.x, 0.0) / qd.sqrt(flat)
        two = v.cross(one)
    p = disc(u)
    s = 0.5 * (1.0 + v.z)
    y = (1.0 - s) * qd.sqrt(qd.max(1.0 - p.x * p.x, 0.0)) + s * p.y
    h = p.x * one + y * two + qd.sqrt(qd.max(1.0 - p.x * p.x - y * y, 0.0)) * v
    h = vec3(rough() * h.x, rough() * h.y, qd.max(h.z, 1e-6)).normalized(1e-12)
    return h.x * across + h.y * up + h.z * n


@qd.func
def unhidden(cosine):
    """Share of the facets that is visible in a direction (Smith)."""
    square = qd.max(cosine * cosine, 1e-8)
    return 2.0 / (1.0 + qd.sqrt(1.0 + rough() * rough() * (1.0 - square) / square))


@qd.func
def mirror_of(color, cosine):
    """Reflectance of a facet, per colour (Schlick)."""
    return color + (1.0 - color) * (1.0 - qd.min(qd.max(cosine, 0.0), 1.0)) ** 5


@qd.func
def towards_lamp(color, n, seen, lamp):
    """Radiance of metal in a light from the direction `lamp`, over that of a white surface that faces it."""
    result = vec3(0.0, 0.0, 0.0)
    out, into = n.dot(seen), n.dot(lamp)
    if out > 0.0 and into > 0.0:
        h = (seen + lamp).normalized(1e-12)
        square, a = n.dot(h) ** 2, rough() * rough()
        steep = square * (a - 1.0) + 1.0
        # D G / (4 cos cos) times the cosine; pi of the distribution and of the white surface cancel.
        facets = a / (steep * steep)
        result = mirror_of(color, h.dot(seen)) * (facets * unhidden(out) * unhidden(into) / (4.0 * out))
    return result
