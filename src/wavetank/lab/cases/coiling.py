"""A thin jet of very thick syrup coils like a rope where it falls far, and stands where it does not.

Cruickshank and Munson 1981, J. Fluid Mech. 113, 221: a slow round jet buckles where it falls more than about 7.2
diameters. Ribe 2004, Proc. R. Soc. Lond. A 460, 3223, doi:10.1098/rspa.2004.1353: where viscosity alone decides, the
coil's width follows the height H of the fall alone, so that it turns at a rate of the order of Q / (H a^2).

The jet is fed from above, ring by ring, by a nozzle that holds its speed. It starts with a slight screw, because a
straight jet folds for long before it coils.
"""

import math
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.compiler import qd
from wavetank.device.state import Particles
from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.physics.forces.regions import in_space
from wavetank.scene.fluids import Points
from wavetank.scene.forces.force import Force
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation
from wavetank.solids.distance import vec3

RADIUS, SPEED, VISCOSITY, DENSITY = 0.001, 0.3, 200.0, 1400.0  # m, m/s, Pa s, kg/m^3
LONG, SHORT = 9.0, 3.0  # falls, in diameters
FRAME = 1 / 720  # s
SCREW = 0.06  # of the fall, how far the jet is off its axis at the start


@qd.kernel(fastcache=True)
def hold_speed(particles: Particles, height: qd.f32, velocity: vec3, count: qd.i32):
    """Give everything above `height` the velocity of the nozzle."""
    for i in range(count):
        if particles.x[i][1] > height:
            v = particles.v[i]
            for k in qd.static(range(v.n)):
                v[k] = velocity[k]
            particles.v[i] = v


class Nozzle(Force):
    """A straight outlet above `height` [m]."""

    kind: str = "nozzle"
    height: float

    @override
    def apply(self, particles: Particles, count: int, dt: float, time: float) -> None:
        hold_speed(particles, self.height, in_space((0.0, -SPEED, 0.0)), count)


def run(quick: bool, arch: str) -> Outcome:
    """Feed a jet of nine diameters for 0.22 s and one of three for 0.07 s (quick: coarser, shorter)."""
    rings, seconds = (1, 0.1) if quick else (2, 0.22)
    times, path, shots = pour(LONG, rings, seconds, arch)
    _, still, _ = pour(SHORT, rings, 0.07, arch)
    fall = 2.0 * RADIUS * LONG
    # The first third is spent on the way from the start to a coil.
    angle = np.unwrap(np.arctan2(path[:, 1], path[:, 0]))
    late = np.array(times) > seconds / 3.0
    rate = abs(float(np.polyfit(np.array(times)[late], angle[late], 1)[0]))
    width = float(np.linalg.norm(path[late], axis=1).mean())
    offset = float(np.linalg.norm(still[len(still) // 2 :], axis=1).max())
    scale = math.pi * SPEED / fall  # Q / (H a^2)
    turned = abs(float(angle[-1] - angle[late][0])) / (2.0 * math.pi)
    buckles, coils = "Cruickshank and Munson 1981", "Ribe 2004"
    figures = [
        Figure("9 diameters: turns of the jet", turned, "", 0.3 if quick else 1.0, None, "coils above 7.2", buckles),
        Figure("its rate over Q / (H a^2)", rate / scale, "", 0.5, 2.0, "of the order of 1", coils),
        Figure("its offset over the fall", width / fall, "", 0.1, 0.4, "of the order of 1", coils),
        Figure(
            "3 diameters: offset over the fall",
            offset / (2.0 * RADIUS * SHORT),
            "",
            None,
            0.1,
            "stands below 7.2",
            buckles,
        ),
    ]

    def draw(plot: Any) -> None:
        panels = plot.subplots(1, 5)
        for panel, (moment, x) in zip(panels[:4], shots, strict=True):
            order = np.argsort(x[:, 2])
            panel.scatter(x[order, 0], x[order, 1], c=x[order, 2], s=6, cmap="Blues", vmin=-0.02, vmax=0.008)
            panel.set(
                title=f"{moment:.2f} s", aspect="equal", xlim=(-0.009, 0.009), ylim=(0, fall), xticks=[], yticks=[]
            )
        panels[4].plot(1e3 * path[:, 0], 1e3 * path[:, 1], color=BLUE, label="falls 9 diameters")
        panels[4].plot(1e3 * still[:, 0], 1e3 * still[:, 1], color=RED, label="falls 3 diameters")
        panels[4].set(title="at 0.4 of the fall", xlabel="x [mm]", ylabel="z [mm]", aspect="equal")
        panels[4].set(xlim=(-6, 6), ylim=(-9, 6))
        panels[4].legend(frameon=False, loc="lower center")
        tidy(panels[4])

    return Outcome(figures, {"time": times, "x": path[:, 0].tolist(), "z": path[:, 1].tolist()}, draw)


def pour(
    diameters: float, rings: int, seconds: float, arch: str
) -> tuple[list[float], np.ndarray, list[tuple[float, np.ndarray]]]:
    """Let a jet fall; return times, where its middle is [m] at 0.4 of the fall [n, 2], and four moments."""
    disc = layer(rings)
    d = RADIUS / math.sqrt(len(disc) / math.pi)
    disc *= d
    fall, room = 2.0 * RADIUS * diameters, 24.0 * RADIUS
    top = fall + 4.0 * d
    heights = np.arange(top - 0.5 * d, 0.4 * d, -d)
    x = np.concatenate([disc + (0.0, y, 0.0) for y in heights])
    share = np.clip(x[:, 1] / fall, 0.0, 1.0)
    screw = SCREW * fall * np.sin(math.pi * share)
    x[:, 0] += screw * np.cos(2.0 * math.pi * share)
    x[:, 2] += screw * np.sin(2.0 * math.pi * share)
    middle = np.array((0.5 * room, 0.0, 0.5 * room))
    down = np.array((0.0, -SPEED, 0.0))
    scene = Scene(
        spacing=d,
        tank=Tank(size=(room, top + 4.0 * d, room)),
        rest_density=DENSITY,
        dynamic_viscosity=VISCOSITY,
        frame_time=FRAME,
        substeps=2,
        courant=3.0,
        wave_courant=100.0,  # the jet is not a column that carries its weight by pressure
        fluids=[Points(positions=x + middle, velocities=np.tile(down, (len(x), 1)))],
    )
    sim = Simulation(scene, arch)
    sim.forces.append(Nozzle(height=fall))
    times, path, shots = [], [], []
    highest, frames = heights[0], round(seconds / FRAME)
    for number in range(1, frames + 1):
        sim.step()
        x = sim.positions.astype(float) - middle
        near = np.abs(x[:, 1] - 0.4 * fall) < d
        if near.any():
            times.append(sim.time)
            path.append(x[near][:, [0, 2]].mean(axis=0))
        if number * 4 % frames < 4:
            shots.append((sim.time, x))
        highest -= SPEED * FRAME
        while highest < top - 0.5 * d:
            highest += d
            sim.add(disc + middle + (0.0, highest, 0.0), np.tile(down, (len(disc), 1)))
    return times, np.array(path), shots[-4:]


def layer(rings: int) -> np.ndarray:
    """Return a round layer of the jet in spacings [n, 3]: six more places in every ring, alike in all directions."""
    places = [np.zeros((1, 3))]
    for ring in range(1, rings + 1):
        angle = math.pi / (3 * ring) * (np.arange(6 * ring) + 0.25 * ring)
        places.append(ring * np.stack([np.cos(angle), 0.0 * angle, np.sin(angle)], -1))
    return np.concatenate(places)


CASE = Case("coiling", "A thin jet of syrup coils", run)
