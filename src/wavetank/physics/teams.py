"""The loop over teams that passes over pairs share among threads.

A team is `grid.lanes` particles that follow each other in sorted order and are computed together (`pairs.py`), eight on
a processor and one on a graphics card:

    for turn in range(turns(grid, count)):
        for team in range(first_team(turn, grid, count), end_team(turn, grid, count)):
            for i in range(team * grid.lanes, end_of(team, grid, count)):

Particles that share a neighbour list (`neighbors.py`) are a group, eight of them everywhere.
"""

from wavetank.device.compiler import qd
from wavetank.device.state import Grid


@qd.func
def turn_bits():
    """Bits that number the turns of a part on a processor: the first takes the whole part, the others nothing.

    The compiler gives a thread 512 turns at least, which are too many teams to share them out evenly.
    """
    return 9


@qd.func
def turns_over(number, parts, lanes: qd.template()):
    """Turns of a loop over so many things in equal `parts`."""
    if qd.static(lanes == 1):
        return number
    return parts << turn_bits()


@qd.func
def part_of(turn):
    """Number of the part that a turn takes, if any, on a processor."""
    return turn >> turn_bits()


@qd.func
def first_of_part(turn, number, parts, lanes: qd.template()):
    """The first of so many things that a turn takes."""
    if qd.static(lanes == 1):
        return turn
    return part_of(turn) * ((number + parts - 1) // parts)


@qd.func
def end_of_part(turn, number, parts, lanes: qd.template()):
    """The one behind the last of so many things that a turn takes; the first where it takes none."""
    if qd.static(lanes == 1):
        return turn + 1
    end = part_of(turn) * ((number + parts - 1) // parts)
    if turn & ((1 << turn_bits()) - 1) == 0:
        end = qd.min(end + (number + parts - 1) // parts, number)
    return end


@qd.func
def groups(count):
    """Number of groups of so many particles."""
    return (count + 7) >> 3


@qd.func
def group_of(i):
    """Number of the group of particle `i`."""
    return i >> 3


@qd.func
def place_in_group(i):
    """Which of the eight of its group particle `i` is."""
    return i & 7


@qd.func
def teams(grid: Grid, count):
    """Number of teams of so many particles."""
    if qd.static(grid.lanes == 1):
        return count
    return (count + grid.lanes - 1) // grid.lanes


@qd.func
def turns(grid: Grid, count):
    """Turns of the loop over the teams of so many particles."""
    return turns_over(teams(grid, count), grid.parts, grid.lanes)


@qd.func
def first_team(turn, grid: Grid, count):
    """The first team of a turn."""
    return first_of_part(turn, teams(grid, count), grid.parts, grid.lanes)


@qd.func
def end_team(turn, grid: Grid, count):
    """The team behind the last one of a turn."""
    return end_of_part(turn, teams(grid, count), grid.parts, grid.lanes)


@qd.func
def end_of(team, grid: Grid, count):
    """The particle behind the last one of a team."""
    return qd.min(team * grid.lanes + grid.lanes, count)
