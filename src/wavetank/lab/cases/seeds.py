"""Random worlds do not blow up: block, spacing, gravity up to 10 g in any direction, tanks down to three spacings wide.

A world blew up if a position is not finite or outside of the tank, or a particle is faster than a free fall along every
edge of the tank, added to its start: v^2 = v_0^2 + 2 sum_k |g_k| L_k. The default `speed_limit` cuts off just there, so
that the same worlds are also run without it; what is faster then is told for information.
"""

import math
from typing import Any

import numpy as np

from wavetank.lab.cases.case import Case, Figure, Outcome
from wavetank.lab.plots import BLUE, RED, tidy
from wavetank.scene.fluids import Block
from wavetank.scene.scene import Scene
from wavetank.scene.tank import Tank
from wavetank.simulation.simulation import Simulation

ROUNDING = 1.0 + 1e-4  # of a speed, in single precision


def world(seed: int, **parameters: Any) -> Scene:
    """Return the world of that seed: at most some 2,000 particles, every third world in two dimensions."""
    random = np.random.default_rng(seed)
    dim = 2 if seed % 3 == 0 else 3
    d = 10.0 ** random.uniform(-3.0, 0.0)
    cells = random.integers(3, 40 if dim == 2 else 14, dim)
    size = d * (cells + random.uniform(0.0, 1.0, dim))
    lower = random.uniform(0.0, 0.6, dim) * (size - d)
    upper = np.minimum(size, lower + np.maximum(1.01 * d, random.uniform(0.2, 1.0, dim) * size))
    direction = random.normal(size=dim)
    gravity = 98.1 * random.uniform() * direction / np.linalg.norm(direction)
    velocity = random.normal(size=dim) * 0.5 * math.sqrt(98.1 * float(size.max()))
    return Scene(
        spacing=d,
        tank=Tank(size=tuple(size)),
        gravity=tuple(gravity),
        fluids=[Block(lower=tuple(lower), upper=tuple(upper), velocity=tuple(velocity))],
        **parameters,
    )


def fastest(scene: Scene, frames: int, arch: str) -> float:
    """Run a world; return the largest speed in units of the allowed one, infinite if a particle left the tank."""
    assert scene.tank is not None
    size = np.array(scene.tank.size, np.float32)
    sim = Simulation(scene, arch)
    start = float((sim.velocities.astype(float) ** 2).sum(1).max(initial=0.0))
    fall = 2.0 * sum(abs(g) * edge for g, edge in zip(scene.gravity, scene.tank.size, strict=True))
    most = 0.0
    for _ in range(frames):
        sim.step()
        x, v = sim.positions, sim.velocities.astype(float)
        if not (np.isfinite(x).all() and np.isfinite(v).all() and np.all((x >= 0.0) & (x <= size))):
            return math.inf
        most = max(most, float(np.sqrt((v**2).sum(1).max(initial=0.0) / (start + fall))))
    return most


def run(quick: bool, arch: str) -> Outcome:
    """Run 100 worlds for 30 frames, and again without the limit of speed (quick: 5)."""
    seeds = list(range(5 if quick else 100))
    limited = [fastest(world(seed), 30, arch) for seed in seeds]
    free = [fastest(world(seed, speed_limit=1e6), 30, arch) for seed in seeds]
    blown = sum(speed > ROUNDING for speed in limited)
    lost = sum(math.isinf(speed) for speed in free)
    figures = [
        Figure(f"blow-ups of {len(seeds)}", blown, "", 0.0, 0.0, "15 of 115", "an SPH reference set"),
        Figure("without the limit: not finite or outside", lost, "", 0.0, 0.0, "0"),
        Figure("without the limit: faster than a fall", sum(s > ROUNDING for s in free) - lost, "", reference="0"),
        Figure("without the limit: fastest", max(free), "of a fall", reference="1"),
    ]

    def draw(plot: Any) -> None:
        axis = plot.subplots()
        axis.plot(seeds, free, "o", color=RED, ms=4, mfc="none", label="without the limit of speed")
        axis.plot(seeds, limited, ".", color=BLUE, label="default")
        axis.axhline(1.0, color="0.4", lw=0.8)
        axis.set(xlabel="seed", ylabel="fastest particle / free fall", ylim=(0, None))
        axis.legend(frameon=False)
        tidy(axis)

    return Outcome(figures, {"seed": seeds, "default": limited, "without_limit": free}, draw)


CASE = Case("seeds", "Random worlds", run)
