"""Several fluids along a line of sight: which is in front, how much there is of each, and what they do to light.

What absorbs does so in any order, so its thickness decides; what scatters is seen where it lies in front. The fluid in
front is found by the sums of discs next behind the surface, and these are smooth: raised to a high power their shares
change from one fluid to the other within half a spacing, along a line that is as smooth as the sums.

    code      symbol   meaning                                                     unit
    shares             share of each fluid in the thickness                        1
    front              share of each in what lies in front, sharpened              1
    swallow   sigma_a  absorption per colour                                       1/m
    murk      sigma_s  scattering that hides what is behind                        1/m
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, to_pixel, to_view, vec2, vec3
from wavetank.view.look import Look
from wavetank.view.optics.bilinear import corners
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.probes import sun_share
from wavetank.view.optics.radiance import smoothstep, surface_radiance
from wavetank.view.optics.water_volume import depth_below
from wavetank.view.water_buffers import SunlitWater, Thickness


@qd.func
def share_at(map: qd.template(), place, k):
    """Entry `k` at a place in texels, between the four nearest."""
    r, c, r1, c1, v, u = corners(place, map.shape[0], map.shape[1], 1.001)
    top = map[r, c, k] * (1.0 - u) + map[r, c1, k] * u
    return top + ((map[r1, c, k] * (1.0 - u) + map[r1, c1, k] * u) - top) * v


@qd.func
def swallow_of(fluids: qd.template(), optics: Optics, k):
    """What fluid `k` absorbs [1/m]: what its colour lacks, in a layer thinner than is usual."""
    matter, result = fluids[k], optics.absorption
    if matter.x >= 0.0:
        result = -qd.log(vec3(matter.x, matter.y, matter.z)) * (2.5 / optics.usual)
    return result


@qd.func
def color_of_fluid(fluids: qd.template(), look: Look, optics: Optics, k):
    """Linear colour of fluid `k`."""
    matter = fluids[k]
    result = vec3(matter.x, matter.y, matter.z)
    if matter.x < 0.0:
        result = optics.glow / look.glow
    return result


@qd.func
def along_sun(thickness: Thickness, optics: Optics, place):
    """(what swallows, murk) [1/m] of the fluids along a ray of the sun, packed in four."""
    total, swallow, murk = 1e-6, vec3(0.0, 0.0, 0.0), 0.0
    for k in range(thickness.fluids):
        share = share_at(thickness.shares, place, k)
        total += share
        swallow += share * swallow_of(thickness.matter, optics, k)
        murk += share * thickness.matter[k][3]
    return qd.Vector([swallow.x, swallow.y, swallow.z, murk]) / total


@qd.func
def mixed(thickness: Thickness, look: Look, optics: Optics, pixel, tau, plane: qd.template()):
    """(absorption, tint, colour in front, share that it hides, own light, share that what is behind it hides, its
    colour) at a place in pixels.

    `tau` [m] is the thickness of all; in a plane nothing lies behind anything.
    """
    place, fine = pixel / optics.coarse, pixel / optics.fine
    total, ahead = 1e-6, 1e-6
    for k in range(thickness.fluids):
        total += share_at(thickness.shares, place, k)
        ahead += share_at(thickness.front, fine, k)
    sharp = 1e-12
    for k in range(thickness.fluids):
        share = share_at(thickness.front, fine, k) / ahead
        if ahead < 1.0:
            share = share_at(thickness.shares, place, k) / total
        sharp += share**8
    swallow, tint, color = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0)
    glow, behind, cover, depth = vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), 0.0, 0.0
    for k in range(thickness.fluids):
        all = share_at(thickness.shares, place, k) / total
        share = share_at(thickness.front, fine, k) / ahead
        if ahead < 1.0:
            share = all
        share = share**8 / sharp
        own = color_of_fluid(thickness.matter, look, optics, k)
        passing = share if qd.static(plane) else 0.5 * (all + share)
        swallow += passing * swallow_of(thickness.matter, optics, k)
        tint += share * own
        murk = thickness.matter[k][3]
        hides = share * (1.0 - qd.exp(-murk * tau))
        cover += hides
        # What shines of itself is dark in the light of others, as embers are.
        shine = thickness.shine[k]
        color += hides * own / (1.0 + 2.0 * shine.max())
        glow += hides * shine
        if qd.static(not plane):
            veil = all * (1.0 - share) * tau * murk
            depth += veil
            behind += veil * (own + shine)
    per = 1.0 / qd.max(cover, 1e-6)
    return swallow, look.glow * tint, per * color, cover, per * glow, 1.0 - qd.exp(-depth), behind / qd.max(depth, 1e-6)


@qd.func
def murky(
    sunlit: SunlitWater,
    shade: qd.template(),
    sun: Lens,
    look: Look,
    optics: Optics,
    color,
    glow,
    at,
    n,
    seen,
    plane: qd.template(),
):
    """Radiance of a fluid that one does not see into, at the point `at` of its surface, shaded by itself and by the
    solids that the sun's map of depths `shade` holds.
    """
    share = 1.0
    if qd.static(not plane):  # in a plane nothing casts a shadow
        above = at + (0.5 * optics.spacing) * n
        under = depth_below(sun, sunlit.depth, above)
        share = 1.0 - smoothstep((under - 0.75 * optics.spacing) / (2.5 * optics.spacing))
        if share > 0.0:
            # Shadows are the same as elsewhere; both maps show the same, in texels of their own.
            c, fine = to_view(sun, above), qd.cast(shade.shape[0], qd.f32) / sunlit.depth.shape[0]
            share *= sun_share(
                shade,
                fine * to_pixel(sun, c),
                c.z - 0.5 * optics.spacing,
                vec2(0.0, 0.0),
                fine * sun.focal,
                look.sun_size,
                vec2(1.0, 0.0),
                16,
            )
    return surface_radiance(look, color, n, seen, vec2(share, 1.0), 0.45, 0.0) + glow
