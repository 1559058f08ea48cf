"""wavetank: real-time, interactive, position-based fluids.

import wavetank as wt

sim = wt.Simulation(wt.Scene.load("obstacle-tank"))
sim.advance(0.5)
image = wt.render(sim)
"""

from importlib.metadata import version as _version
from typing import TYPE_CHECKING, Any

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.params import PARAMETERS, PRESETS
from wavetank.scene.fluids import Ball, Block, Points
from wavetank.scene.scene import Scene, Tank, bundled_scenes
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.shapes import Box, Capsule, Cylinder, Difference, HalfSpace, Intersection, Sphere, Union

if TYPE_CHECKING:
    from wavetank.front.notebook import show
    from wavetank.session.session import Session
    from wavetank.simulation.simulation import Simulation
    from wavetank.view.camera import Camera
    from wavetank.view.renderer import render

__version__ = _version("wavetank")

__all__ = [
    "PARAMETERS", "PRESETS", "Ball", "Block", "Box", "Camera", "Capsule", "Cylinder", "Difference", "HalfSpace",
    "Intersection", "Mesh", "Points", "Scene", "Session", "Simulation", "Sphere", "Tank", "Union", "WavetankError",
    "bundled_scenes", "render", "show",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Import what needs the kernels' sources only when it is first used: data alone should load fast."""
    if name == "Simulation":
        from wavetank.simulation.simulation import Simulation

        return Simulation
    if name == "Session":
        from wavetank.session.session import Session

        return Session
    if name == "show":
        from wavetank.front.notebook import show

        return show
    if name == "Camera":
        from wavetank.view.camera import Camera

        return Camera
    if name == "render":
        from wavetank.view.renderer import render

        return render
    raise AttributeError(f"module 'wavetank' has no attribute {name!r}")
