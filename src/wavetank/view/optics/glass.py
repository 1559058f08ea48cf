"""The tank as it is laid over a picture: a breath of glass, and the lines along its edges.

code      symbol   meaning                                                unit
slack              depth by which a line wins against what it touches     m
"""

from wavetank.device.compiler import qd
from wavetank.view.lens import Lens
from wavetank.view.look import Look
from wavetank.view.optics.edge_coverage import line_depth
from wavetank.view.optics.rays import Box, box_interval
from wavetank.view.shot import Shot


def slack(shot: Shot) -> float:
    """Depth [m] by which a line wins."""
    return 2.0 * shot.radius


@qd.func
def line_cover(line, depth, slack):
    """Share of a pixel that a line covers, unless something at `depth` hides it."""
    cover = 0.0
    if line > 0:
        if line_depth(line) - slack < depth:
            cover = (line >> 23) / 255.0
    return cover


@qd.func
def behind_panes(lens: Lens, look: Look, box: Box, origin, direction, depth, radiance):
    """Radiance with the panes of the tank laid over it that lie before `depth` [m]; without panes what it was."""
    result = radiance
    if look.glass > 0.0:
        panes = box_interval(origin, direction, box)
        if panes[0] <= panes[1]:
            for k in qd.static(range(2)):
                if panes[k] > lens.near and panes[k] < depth:
                    result += look.glass * (look.pane - result)
        elif look.glass == 1.0:  # a plane: particles are wider than their distance to the wall
            result = look.horizon
    return result


@qd.func
def with_lines(look: Look, line, radiance):
    """Radiance with an edge of the tank laid over it, given as in `edge_coverage`."""
    cover = look.line_strength * line_cover(line, 1e30, 1e30)
    return radiance + cover * (look.line - radiance)
