"""The force of still water on an upright wall with water on one side, in two and three dimensions.

A gate T thick stands from the floor to above the water, which is H deep on one side of it; behind it there is air. The
water pushes with rho g H^2 / 2 a metre, at H / 3 above the floor (hydrostatics), whatever the thickness and wherever
the gate stands in the cells of the pressure grid. It is a body that is held; its `force` and its `torque` about the
middle of its foot are means over a quarter of a second of still water. The bound of 4 % holds for the worst place, of
up to four that are a quarter of a spacing apart.
"""

from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.shapes import Box

DEPTH, LONG, HIGH, DEEP = 0.4, 0.6, 0.6, 0.2  # m: of the water; of the tank: length, height, in 3-D depth
DENSITY, GRAVITY = 1000.0, 9.81  # kg/m^3, m/s^2
BEHIND = 0.2  # m: air behind a gate
CALM, READ = 0.75, 0.25  # s: until it is read, for so long
THICK = (0.5, 1.0, 2.0, 4.0)  # d
MOVED = (0.0, 0.25, 0.5, 0.75)  # d
SOURCE = "hydrostatics"


def scene(dim: int, spacing: float, thick: float, moved: float) -> Scene:
    """Return the gate `thick` and `moved` spacings; its face is then so far from where it meets whole spacings."""
    across = (DEEP,) * (dim - 2)
    face = LONG - BEHIND + moved * spacing
    middle = (face + 0.5 * thick * spacing, 0.5 * HIGH, *(0.5 * edge for edge in across))
    gate = Box(name="gate", center=middle, size=(thick * spacing, HIGH, *across), density=DENSITY, held=True)
    water = Block(lower=(0.0,) * dim, upper=(LONG - BEHIND, DEPTH, *across))
    tank = Tank(size=(LONG, HIGH, *across))
    return Scene(
        spacing=spacing, gravity=(0.0, -GRAVITY, 0.0)[:dim], tank=tank, fluids=[water], solids=[gate], foam=0.0
    )


def push(world: Scene, arch: str) -> tuple[float, float]:
    """Return the force and its moment about the gate's foot, over what hydrostatics has for the depth that is there."""
    sim = Simulation(world, arch)
    dim, gate = world.dim, sim.bodies["gate"]
    sim.advance(CALM)
    forces, moments = [], []
    while sim.time < CALM + READ:
        sim.step()
        force, torque = np.asarray(gate.force, float), np.atleast_1d(np.asarray(gate.torque, float))
        forces.append(float(force[0]))
        moments.append(0.5 * HIGH * float(force[0]) - float(torque[-1]))
    face = float(gate.position[0]) - 0.5 * float(np.asarray(world.solids[0].size)[0])  # type: ignore[union-attr]
    deep = DEEP ** (dim - 2)
    depth = sim.count * world.spacing**dim / (deep * face)
    whole = 0.5 * DENSITY * GRAVITY * depth**2 * deep
    return float(np.mean(forces)) / whole, float(np.mean(moments)) / (whole * depth / 3.0)


def run(quick: bool, arch: str) -> Outcome:
    """Read the push on all gates in two to four places, in 2-D at two spacings and in 3-D (quick: two gates)."""
    worlds: dict[str, tuple[int, float, tuple[float, ...]]] = {"2-D, d = H / 20": (2, DEPTH / 20, MOVED)}
    thicknesses: tuple[float, ...] = THICK
    if quick:
        worlds, thicknesses = {"2-D, d = H / 20": (2, DEPTH / 20, MOVED[:1])}, THICK[2:]
    else:
        worlds |= {"2-D, d = H / 40": (2, DEPTH / 40, MOVED[:2]), "3-D, d = H / 16": (3, DEPTH / 16, MOVED[:2])}
    found: dict[str, np.ndarray] = {}
    for name, (dim, spacing, moved) in worlds.items():
        found[name] = np.array([[push(scene(dim, spacing, t, m), arch) for m in moved] for t in thicknesses])
    figures = []
    for name, pushes in found.items():
        for thick, rows in zip(thicknesses, pushes, strict=True):
            off = 100.0 * (rows - 1.0)
            worst = off[np.argmax(np.abs(off[:, 0])), 0]
            arm = off[np.argmax(np.abs(off[:, 1])), 1]
            label = f"{name}: {thick:g} d thick"
            figures += [
                Figure(f"{label}: force, error at the worst place", worst, "%", -4.0, 4.0, "rho g H^2 / 2", SOURCE),
                Figure(f"{label}: moment, error at the worst place", arm, "%", -4.0, 4.0, "rho g H^3 / 6", SOURCE),
            ]

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, sharey=True)
        for axis, number, title in ((left, 0, "force"), (right, 1, "moment about the foot")):
            for (name, pushes), color in zip(found.items(), (BLUE, "0.5", "0.1"), strict=False):
                for place in range(pushes.shape[1]):
                    label = name if place == 0 else None
                    axis.plot(thicknesses, pushes[:, place, number], "o-", color=color, ms=3, lw=0.8, label=label)
            axis.axhline(1.0, color=RED, lw=0.8, ls="--", label="hydrostatics")
            axis.set(title=title, xlabel="thickness / d", xscale="log", xticks=thicknesses, xticklabels=thicknesses)
            axis.minorticks_off()
            tidy(axis)
        left.set_ylabel("over hydrostatics")
        left.legend(frameon=False)

    series: dict[str, Any] = {"thickness": list(thicknesses)}
    for name, pushes in found.items():
        series |= {f"force, {name}, {place}": pushes[:, place, 0].tolist() for place in range(pushes.shape[1])}
        series |= {f"moment, {name}, {place}": pushes[:, place, 1].tolist() for place in range(pushes.shape[1])}
    return Outcome(figures, series, draw)


CASE = Case("gate", "A gate with water on one side", run)
