"""The sheet that a world in a plane is: its thickness and its normal.

A wall and a solid leave a share of a particle's disc, by which what the map holds is divided.
"""

from wavetank.device.compiler import qd
from wavetank.solids.distance import SolidSet, signed_distance
from wavetank.view.lens import Lens, from_view, point_at, vec2, vec3
from wavetank.view.optics.bilinear import thickness_at
from wavetank.view.optics.fluid import Optics
from wavetank.view.optics.panes import share_before_wall
from wavetank.view.optics.rays import Box
from wavetank.view.optics.water_volume import Inside


@qd.func
def wall_share(at, walls: Box, disc):
    """Share of a disc around `at` that the walls of a plane leave; behind them nothing adds to a thickness."""
    share = 1.0
    for k in qd.static(range(2)):
        for side in qd.static(range(2)):
            gap = (at[k] - walls.lower[k]) / disc
            if qd.static(side == 1):
                gap = (walls.upper[k] - at[k]) / disc
            share *= share_before_wall(qd.max(gap, 0.0))
    return share


@qd.func
def solid_share(at, solids: SolidSet, disc):
    """Share of a disc around `at` that the solids of a plane leave, each taken for a straight wall."""
    share = 1.0
    for k in range(solids.tank_count, solids.count):
        if (solids.position[k] - at).norm() < solids.reach[k] + disc or solids.reach[k] > 1e4:
            share *= share_before_wall(qd.max(signed_distance(solids, k, at).w / disc, 0.0))
    return share


@qd.func
def sheet_at(thickness: qd.template(), lens: Lens, optics: Optics, inside: Inside, place, among: qd.template()):
    """Thickness of the sheet that a 2-D world is, at a place in the picture [m]; `among` solids or not."""
    at = lens.eye + from_view(lens, point_at(lens, place.y - 0.5, place.x - 0.5, 1.0))
    thick = thickness_at(thickness, place / optics.coarse, optics.unit) / wall_share(at, inside.walls, optics.disc)
    if qd.static(among):  # beside corners less is missing than beside a wall: no more than a whole sheet
        left = solid_share(vec3(at.x, at.y, 0.0), inside.solids, optics.disc)
        thick = qd.max(thick, qd.min(thick / qd.max(left, 0.2), optics.spacing))
    return thick


@qd.func
def sheet_normal(thickness: qd.template(), lens: Lens, optics: Optics, inside: Inside, place, among: qd.template()):
    """Normal of the sheet: a plane has no shape in depth and gets that of a drop between two panes."""
    dx, dy = vec2(optics.coarse, 0.0), vec2(0.0, optics.coarse)
    right = sheet_at(thickness, lens, optics, inside, place + dx, among)
    right -= sheet_at(thickness, lens, optics, inside, place - dx, among)
    below = sheet_at(thickness, lens, optics, inside, place + dy, among)
    below -= sheet_at(thickness, lens, optics, inside, place - dy, among)
    bulge = optics.disc / (2.0 * optics.coarse * lens.pixel * optics.spacing)
    return from_view(lens, vec3(-bulge * right, bulge * below, -1.0).normalized())
