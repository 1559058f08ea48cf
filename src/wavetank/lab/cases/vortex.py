"""A vortex as large as its full tank, in two dimensions: how long it keeps turning.

It starts as (Taylor and Green 1937) u = U sin(k x) cos(k y), v = -U cos(k x) sin(k y) with k = pi / L, which is at rest
with the walls' normals, steady without viscosity, and with it keeps exp(-4 nu k^2 t) of its energy where walls are
smooth: of water 0.9997 after eight seconds. The loss is therefore also given as the viscosity that would cause it. Its
water starts as a lattice. Once it has a surface (which the vortex bends by U^2 / 2 g, 2.5 cm), and once it is full to
the lid of its tank, where nothing may bring energy either. Known: an eighth goes as the lattice melts, XSPH takes most
of the rest; in a full tank the pressure grid brings energy, and without the grid none comes.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome, columns
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.physics.measure import kinetic_energy
from wavetank.scene.fluids import Points
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

LENGTH, SPEED, AIR = 1.0, 0.7, 0.1  # m, m/s, m
K = math.pi / LENGTH
WATER = 1e-6  # m^2/s


def scene(layers: int, air: float) -> Scene:
    """Return the vortex in so many layers, below so much air [m]."""
    spacing = LENGTH / layers
    along = (np.arange(layers) + 0.5) * spacing
    x = np.stack(np.meshgrid(along, along, indexing="ij"), axis=-1).reshape(-1, 2)
    (a, b) = (K * x).T
    v = SPEED * np.stack([np.sin(a) * np.cos(b), -np.cos(a) * np.sin(b)], axis=1)
    fluid = Points(positions=x, velocities=v)
    return Scene(spacing=spacing, tank=Tank(size=(LENGTH, LENGTH + air)), fluids=[fluid], foam=0.0)


def follow(layers: int, seconds: float, arch: str, air: float = AIR) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times [s], kinetic energies over the start's, and where the particles end, [n, 2]."""
    sim = Simulation(scene(layers, air), arch)
    mass = sim.scene.particle_mass
    times, energies = [0.0], [kinetic_energy(sim.velocities, mass)]
    for frame in sim.frames(seconds, 60.0):
        times.append(sim.time)
        energies.append(kinetic_energy(frame.velocities, mass))
    return np.array(times), np.array(energies) / energies[0], sim.positions


def run(quick: bool, arch: str) -> Outcome:
    """Let the vortex turn for eight seconds at two spacings, and below a lid for one (quick: without a lid for one)."""
    seconds = 1.0 if quick else 8.0
    found = {layers: follow(layers, seconds, arch) for layers in ((50,) if quick else (50, 100))}
    bounds = {1.0: 0.6 if quick else 0.9, 8.0: 0.65}
    figures = []
    for layers, (t, energy, _) in found.items():
        for instant, low in bounds.items():
            if instant <= seconds:
                name = f"{layers} layers: energy after {instant:.0f} s, of the start's"
                figures.append(
                    Figure(name, float(np.interp(instant, t, energy)), "", low, 1.0, "1", "Taylor and Green 1937")
                )
        loss = -math.log(float(energy[-1])) / (4.0 * K**2 * float(t[-1]) * WATER)
        figures.append(Figure(f"{layers} layers: viscosity that would do so", loss, "times water's", reference="1"))

    lids = {} if quick else {layers: follow(layers, 1.0, arch, air=0.0) for layers in found}
    for layers, (_, energy, _) in lids.items():
        name = f"{layers} layers below a lid: most energy in 1 s, of the start's"
        figures.append(Figure(name, float(energy.max()), "", None, 1.01, "1", "conservation of energy"))

    def draw(plot: Any) -> None:
        left, right = plot.subplots(1, 2, width_ratios=(2, 1))
        for (layers, (t, energy, _)), color in zip(found.items(), (BLUE, "0.5"), strict=False):
            left.plot(t, energy, color=color, label=f"{layers} layers")
        for (layers, (t, energy, _)), color in zip(lids.items(), (BLUE, "0.5"), strict=False):
            left.plot(t, energy, color=color, ls=":", label=f"{layers} layers below a lid")
        t = next(iter(found.values()))[0]
        left.plot(t, np.exp(-4.0 * WATER * K**2 * t), color=RED, lw=0.8, ls="--", label="water")
        left.set(xlabel="time [s]", ylabel="kinetic energy, of the start's", ylim=(0, 2))
        left.legend(frameon=False)
        x = next(iter(found.values()))[2]
        right.plot(x[:, 0], x[:, 1], ".", color=BLUE, ms=1)
        right.set(title="end", xlabel="x [m]", ylabel="y [m]", aspect="equal")
        for axis in (left, right):
            tidy(axis)

    series: dict[str, Sequence[float]] = {}
    for layers, (t, energy, _) in found.items():
        series |= columns(layers, time=t, energy=energy)
    return Outcome(figures, series, draw)


CASE = Case("vortex", "A vortex as large as its tank", run)
