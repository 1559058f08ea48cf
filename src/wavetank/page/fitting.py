"""Predicts how many particles of a scene this machine runs in real time.

The time of a frame is its number of time steps times the time of a step, which is measured in the current world. The
number of steps of another scene is estimated from the speed of water that falls through a third of its height.
"""

import functools
import math
import types
from typing import Any

import numpy as np

from wavetank.foundation.params import Parameters
from wavetank.physics.time_step import steps_needed
from wavetank.scene.scene import Scene, bundled_scenes, with_particles
from wavetank.session.session import Session
from wavetank.simulation.cost import PER_STEP
from wavetank.view.extent import extent_of

DEFAULT_COST = 1.2e-6  # s per particle and time step in 3-D, until measured
FLAT = 0.4  # factor in 2-D, with fewer neighbours
VISCOUS = 2.0  # factor with implicit viscosity
WATER_SHARE = 0.6  # of the time; the rest is for pictures
FEWEST = 400  # particles that still look like water
CHOICES = 9  # of the slider


def expected_pace(scene: Scene, particles: float, seconds_per_particle: float) -> float:
    """Return seconds of water in a second for a scene with `particles`, 1 at most.

    `seconds_per_particle` is the time [s] that a particle in 3-D takes in a step.
    """
    world, spacing = _facts(scene), _spacing(scene, particles)
    table = {**vars(world.params), "spacing": spacing}
    frame = world.params.frame_time
    steps = steps_needed(types.SimpleNamespace(**table), frame, world.speed, world.depth, on_grid=world.on_grid)  # type: ignore[arg-type]
    step = PER_STEP + particles * seconds_per_particle * (FLAT if scene.dim == 2 else 1.0) * (
        VISCOUS if world.viscous else 1.0
    )
    return min(1.0, WATER_SHARE * frame / (max(1.0, steps) * step))


def real_time_particles(scene: Scene, seconds_per_particle: float) -> int:
    """Return the approximate number of particles that run in real time, at most those of the scene."""
    count = _count(scene)
    low, high = math.log(min(FEWEST, max(count, 1.0))), math.log(max(count, 1.0))
    if expected_pace(scene, count, seconds_per_particle) >= 1.0:
        return round(count)
    for _ in range(24):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if expected_pace(scene, math.exp(middle), seconds_per_particle) >= 1.0 else (low, middle)
        )
    return int(float(f"{math.exp(low):.2g}"))


def measure_cost(session: Session) -> float:
    """Return the time [s] per particle and time step, measured in the current world and scaled to 3-D."""
    sim = session.sim
    took = sim.seconds_per_frame / max(sim.time_steps, 1) - PER_STEP
    if sim.count < FEWEST or not math.isfinite(took) or took <= 0.0 or sim.frame_number < 10:
        return session.seconds_per_particle or DEFAULT_COST
    factor = (FLAT if sim.scene.dim == 2 else 1.0) * (VISCOUS if sim.scene.dynamic_viscosity else 1.0)
    now = took / (sim.count * factor)
    session.seconds_per_particle = (
        now if not session.seconds_per_particle else 0.5 * (session.seconds_per_particle + now)
    )
    return session.seconds_per_particle


def fits(session: Session) -> dict[str, Any]:
    """Return particles and pace of each bundled scene on this machine, and choices for the current scene."""
    cost = measure_cost(session)
    scenes = {}
    for name in bundled_scenes():
        scene = _bundled(name)
        fit = real_time_particles(scene, cost)
        scenes[name] = {
            "particles": fit,
            "pace": expected_pace(scene, fit, cost),
            "full": expected_pace(scene, _count(scene), cost),
        }
    return {"type": "fit", "scenes": scenes, "here": _choices(session, cost)}


def _choices(session: Session, cost: float) -> list[dict[str, Any]]:
    """Return numbers of particles, from few to twice those of the scene, with spacings and paces."""
    scene, count = session.scene, _count(session.scene)
    if count < FEWEST or session.sim.scene.goal or any(fluid.shape == "points" for fluid in scene.fluids):
        return []
    most = min(2.0 * max(count, _bundled_count(session)), session.most_particles)
    result = []
    for particles in np.geomspace(FEWEST, max(most, 2 * FEWEST), CHOICES):
        about = int(float(f"{particles:.2g}"))
        spacing = with_particles(scene, about).spacing
        result.append({"particles": about, "spacing": spacing, "pace": expected_pace(scene, about, cost)})
    return result


def _bundled_count(session: Session) -> float:
    """Return the particles of the current bundled scene at its own spacing; 0 for other scenes."""
    titles = {_bundled(name).title: name for name in bundled_scenes()}
    name = titles.get(session.scene.title)
    return _count(_bundled(name)) if name else 0.0


@functools.cache
def _bundled(name: str) -> Scene:
    return Scene.load(name)


def _count(scene: Scene) -> float:
    return sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)


def _spacing(scene: Scene, particles: float) -> float:
    return float(scene.spacing) * (max(_count(scene), 1.0) / max(particles, 1.0)) ** (1.0 / scene.dim)


def _facts(scene: Scene) -> Any:
    """Return what time steps depend on."""
    extent = extent_of(scene).turned(scene.upright)
    height = float(extent.upper[1] - extent.lower[1])
    speed = math.sqrt(2.0 / 3.0 * math.hypot(*scene.gravity) * height)
    return types.SimpleNamespace(
        params=types.SimpleNamespace(**{name: getattr(scene, name) for name in Parameters.model_fields}),
        speed=speed,
        depth=0.5 * height,
        viscous=bool(scene.dynamic_viscosity),
        on_grid=scene.tank is not None and bool(scene.grid_pressure),
    )
