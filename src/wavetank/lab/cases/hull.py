"""An open boat of boards floats at its draft and stays dry inside, in two dimensions; and a bowl, a mesh, in space.

Three boards, T thick, make a tub B wide; it weighs as much as the water that B times its draft takes (Archimedes),
boards and air together, whatever the boards are made of. It starts at that draft beside still water and is left alone
for 20 s, at the finer spacing for 5 s. Water inside counts where it is lower than the rim and between the boards; the
level outside is that of the water that is not inside. The bowl is half a hollow ball, and has the draft h at which a
cap of the ball displaces its weight, pi h^2 (R - h / 3).
"""

import dataclasses
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.filled import Filled
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Difference, Sphere, Union

BEAM, SIDE, LONG, HIGH, DEPTH, DRAFT = 0.4, 0.4, 1.2, 1.1, 0.5, 0.2  # m: boat's beam and height, tank, water
BOARDS = (1, 2, 4)  # d
SECONDS, FINER = 20.0, 5.0  # s: at the coarser spacing, at the finer
RADIUS, ROOM, POOL, CAP = 0.25, 0.9, 0.45, 0.125  # m: of the bowl; tank, water, and the bowl's draft
WALLS = {0.03: (1, 3), 0.02: (2,)}  # d, by spacing [m]
AFLOAT = 5.0  # s


@dataclasses.dataclass
class Float:
    """How a boat floats."""

    times: np.ndarray  # s
    drafts: np.ndarray  # over that which it should have
    inside: np.ndarray  # m^2 of water
    end: np.ndarray  # m, where its water is in the end, [n, 2]


def scene(spacing: float, boards: int) -> Scene:
    """Return the boat of boards that are so many spacings thick, in still water."""
    thick, bottom = boards * spacing, DEPTH - DRAFT
    aside = 0.5 * (BEAM - thick)
    parts = [
        Box(center=(0.0, -0.5 * (SIDE - thick)), size=(BEAM, thick)),
        Box(center=(-aside, 0.0), size=(thick, SIDE)),
        Box(center=(aside, 0.0), size=(thick, SIDE)),
    ]
    boat = Union(name="boat", center=(0.5 * LONG, bottom + 0.5 * SIDE), parts=parts, mass=1000.0 * BEAM * DRAFT)
    left, right = 0.5 * (LONG - BEAM), 0.5 * (LONG + BEAM)
    fluids = [
        Block(lower=(0.0, 0.0), upper=(LONG, bottom)),
        Block(lower=(0.0, bottom), upper=(left, DEPTH)),
        Block(lower=(right, bottom), upper=(LONG, DEPTH)),
    ]
    return Scene(spacing=spacing, tank=Tank(size=(LONG, HIGH)), fluids=fluids, solids=[boat], foam=0.0)


def follow(world: Scene, boards: int, seconds: float, arch: str) -> Float:
    """Follow the boat for so many seconds, ten times a second."""
    sim = Simulation(world, arch)
    boat, area = sim.bodies["boat"], world.spacing**2
    times, drafts, inside = [0.0], [1.0], [0.0]
    for frame in sim.frames(seconds, 10.0):
        low = float(boat.position[1]) - 0.5 * SIDE
        x = frame.positions - np.asarray(boat.position[:2], np.float32)
        angle = 2.0 * float(np.arctan2(boat.rotation[3], boat.rotation[0]))
        across, up = (
            np.cos(angle) * x[:, 0] + np.sin(angle) * x[:, 1],
            np.cos(angle) * x[:, 1] - np.sin(angle) * x[:, 0],
        )
        held = int(np.sum((np.abs(across) < 0.5 * BEAM - boards * world.spacing) & (np.abs(up) < 0.5 * SIDE)))
        level = ((sim.count - held) * area - BEAM * low) / (LONG - BEAM)
        times.append(sim.time)
        drafts.append((level - low) / DRAFT)
        inside.append(held * area)
    return Float(np.array(times), np.array(drafts), np.array(inside), sim.positions)


def bowl(spacing: float, wall: float, draft: float) -> Scene:
    """Return half a hollow ball, open above, whose wall is so many spacings thick, in still water at its draft [m]."""
    import trimesh

    angle = np.linspace(-0.5 * np.pi, 0.0, 25)
    turned = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    profile = np.concatenate([RADIUS * turned, (RADIUS - wall * spacing) * turned[::-1]])
    profile[[0, -1], 0] = 0.0
    mesh = trimesh.creation.revolve(
        profile, sections=48, transform=trimesh.transformations.rotation_matrix(-0.5 * np.pi, [1, 0, 0])
    )
    mesh.fix_normals()
    middle = (0.5 * ROOM, POOL - draft + RADIUS, 0.5 * ROOM)
    solid = Mesh.of(
        mesh.vertices,
        mesh.faces,
        name="boat",
        mass=1000.0 * np.pi * draft**2 * (RADIUS - draft / 3.0),
        size=(2.0 * RADIUS, RADIUS, 2.0 * RADIUS),
        center=(middle[0], middle[1] - 0.5 * RADIUS, middle[2]),
    )
    pool = Box(center=(0.5 * ROOM, 0.5 * POOL, 0.5 * ROOM), size=(ROOM, POOL, ROOM))
    water = Filled(inside=Difference(parts=[pool, Sphere(center=middle, radius=RADIUS)]))
    return Scene(spacing=spacing, tank=Tank(size=(ROOM,) * 3), fluids=[water], solids=[solid], foam=0.0)


def draft_of_bowl(spacing: float, wall: float, draft: float, seconds: float, arch: str) -> tuple[float, float]:
    """Return the draft of a bowl after so long over that which it should have, and its water over its room."""
    sim = Simulation(bowl(spacing, wall, draft), arch)
    sim.advance(seconds)
    middle = np.asarray(sim.bodies["boat"].position, float) + (0.0, 0.5 * RADIUS, 0.0)
    x, level = sim.positions - middle, POOL
    inner = RADIUS - wall * spacing
    inside = int(np.sum((np.linalg.norm(x, axis=1) < inner) & (x[:, 1] < 0.0))) * spacing**3
    for _ in range(50):
        deep = level - float(middle[1]) + RADIUS
        level = (sim.count * spacing**3 - inside + np.pi * deep**2 * (RADIUS - deep / 3.0)) / ROOM**2
    return (level - float(middle[1]) + RADIUS) / draft, inside / (2.0 / 3.0 * np.pi * inner**3)


def run(quick: bool, arch: str) -> Outcome:
    """Leave boats of thin and thick boards alone at two spacings (quick: of thick ones, for 2 s)."""
    ways = {(d, boards): seconds for d, seconds in ((0.02, SECONDS), (0.01, FINER)) for boards in BOARDS}
    if quick:
        ways = {(0.02, 4): 2.0}
    found = {(d, boards): follow(scene(d, boards), boards, seconds, arch) for (d, boards), seconds in ways.items()}
    figures = []
    for (d, boards), one in found.items():
        name = f"B / d = {BEAM / d:.0f}, boards of {boards} d"
        wet = 100.0 * float(one.inside[-1]) / (BEAM * SIDE)
        off = 100.0 * (float(np.mean(one.drafts[-10:])) - 1.0)
        figures += [
            Figure(f"{name}: draft, error", off, "%", -4.0, 4.0, f"{DRAFT} m", "Archimedes"),
            Figure(f"{name}: water inside, of its room", wet, "%", None, 0.0, "0", "it floats"),
        ]

    for d, walls in {} if quick else WALLS.items():
        for wall in walls:
            draft, wet = draft_of_bowl(d, wall, CAP, AFLOAT, arch)
            name = f"bowl, R / d = {RADIUS / d:.3g}, wall of {wall} d"
            figures += [
                Figure(f"{name}: draft, error", 100.0 * (draft - 1.0), "%", -4.0, 4.0, f"{CAP} m", "Archimedes"),
                Figure(f"{name}: water inside, of its room", 100.0 * wet, "%", None, 0.0, "0", "it floats"),
            ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 1))
        for number, ((d, boards), one) in enumerate(found.items()):
            color, style = (BLUE, "0.5", "0.1")[number % 3], ("-", ":")[number // 3]
            label = f"B / d = {BEAM / d:.0f}, {boards} d"
            left.plot(one.times, one.drafts, color=color, ls=style, lw=1.2, label=label)
        left.axhline(1.0, color=RED, lw=0.8, ls="--", label="Archimedes")
        left.set(xlabel="time [s]", ylabel="draft, over that of its weight", ylim=(0, None))
        left.legend(frameon=False, fontsize=8)
        (d, boards), one = next(iter(found.items()))
        right.plot(one.end[:, 0], one.end[:, 1], ".", color=BLUE, ms=1)
        right.set(title=f"boards of {boards} d, end", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        right.set(xlim=(0, LONG), ylim=(0, HIGH))
        for axis in (left, right):
            tidy(axis)

    series: dict[str, list[float]] = {}
    for (d, boards), one in found.items():
        series[f"time_{d}"] = one.times.tolist()
        series |= {f"draft_{d}_{boards}": one.drafts.tolist(), f"inside_{d}_{boards}": one.inside.tolist()}
    return Outcome(figures, series, draw)


CASE = Case("hull", "An open boat of boards", run)
