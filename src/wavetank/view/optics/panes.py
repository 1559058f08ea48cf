"""Where the surface of the water meets the walls of the tank.

The surface is splatted and smoothed as if the water went on behind the panes (`passes/ellipsoids.py`), so that it
crosses them as smoothly as it is anywhere else. What of a line of sight lies outside of the tank is then left out here:
where the surface is met before the tank is entered, the water begins at the pane; where it is met behind the tank,
there is none. Both happen along a line in the picture, and a pixel on that line has a share of both.

    code        symbol   meaning                                                             unit
    first, last          depths at which a ray enters and leaves the tank                    m
    into, out            their change to the next column and to the next row                 m
    wet                  share of a pixel whose water begins at the pane                     1
    there                share of a pixel that shows water at all                            1
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens, vec2, vec3, vec4
from wavetank.view.optics.rays import Box


@qd.func
def tank_interval(lens: Lens, origin, direction, walls: Box):
    """(first, last), (into, out), and the normal of the wall through which the ray comes in; first > last: no tank."""
    first, last = -1e9, 1e9
    into, out, n = vec2(0.0, 0.0), vec2(0.0, 0.0), vec3(0.0, 0.0, 0.0)
    for k in qd.static(range(3)):
        slope = direction[k]
        if qd.abs(slope) < 1e-9:
            slope = 1e-9
        per = 1.0 / slope
        a, b = (walls.lower[k] - origin[k]) * per, (walls.upper[k] - origin[k]) * per
        near, far = qd.min(a, b), qd.max(a, b)
        turn = (lens.pixel * per) * vec2(-lens.right[k], lens.up[k])
        if near > first:
            first, into, n = near, turn, vec3(0.0, 0.0, 0.0)
            n[k] = qd.select(slope > 0.0, -1.0, 1.0)
        if far < last:
            last, out = far, turn
    into *= 1.0 + lens.perspective * (first - 1.0)
    out *= 1.0 + lens.perspective * (last - 1.0)
    return vec2(first, last), vec4(into.x, into.y, out.x, out.y), n


@qd.func
def share_behind(depth, limit, rise, limit_rise):
    """Share of a pixel in which a surface lies deeper than a limit; both are planes with a change per pixel."""
    change = rise - limit_rise
    return qd.min(qd.max(0.5 + (depth - limit) / qd.max(change.norm(), 1e-9), 0.0), 1.0)


@qd.func
def share_before_wall(gap):
    """Share that a wall leaves of what is spread smoothly over a ball or a disc, its middle `gap` radii before it."""
    t = qd.min(gap, 1.0)
    return 0.5 + t * (15.0 - t * t * (10.0 - 3.0 * t * t)) / 16.0
