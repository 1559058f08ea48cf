"""wavetank: real-time, interactive, position-based fluids.

import wavetank as wt

sim = wt.Simulation(wt.Scene.load("obstacle-tank"))
sim.advance(0.5)
image = wt.render(sim)
"""

import importlib
from typing import TYPE_CHECKING, Any

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.materials import Material
from wavetank.foundation.params import PARAMETERS, PRESETS
from wavetank.foundation.version import VERSION
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter
from wavetank.scene.filled import Filled
from wavetank.scene.fluids import Ball, Block, Points
from wavetank.scene.gauges import Gauge
from wavetank.scene.joints import BallJoint, Hinge, Rope, Slider, Spring, Weld
from wavetank.scene.probes import Probe
from wavetank.scene.scene import Scene, bundled_scenes
from wavetank.scene.tank import Tank
from wavetank.solids.ground.height_field import HeightField
from wavetank.solids.ground.polygon import Polygon
from wavetank.solids.meshes.mesh import Mesh
from wavetank.solids.motion import Keyframe, Motion, sampled
from wavetank.solids.shapes import Box, Capsule, Cylinder, Difference, HalfSpace, Intersection, Sphere, Union

if TYPE_CHECKING:
    from wavetank.device.compiler import qd
    from wavetank.device.state import Particles
    from wavetank.formats.dualsphysics import load_dualsphysics
    from wavetank.formats.robots import load_mjcf, load_robot, load_urdf
    from wavetank.formats.splishsplash import load_splishsplash
    from wavetank.page.notebook.show import show
    from wavetank.physics.terms.term import Hook, Term
    from wavetank.scene.forces import Attract, Burst, Drag, Force, Sway, Vortex, Wind
    from wavetank.session import commands
    from wavetank.session.recording import Recording, replay
    from wavetank.session.session import Session
    from wavetank.simulation.simulation import Simulation
    from wavetank.view.camera import Camera
    from wavetank.view.renderer import render

__version__ = VERSION

__all__ = [
    "PARAMETERS",
    "PRESETS",
    "Attract",
    "Ball",
    "BallJoint",
    "Block",
    "Box",
    "Burst",
    "Camera",
    "Capsule",
    "Cylinder",
    "Difference",
    "Drag",
    "Drain",
    "Emitter",
    "Filled",
    "Force",
    "Gauge",
    "HalfSpace",
    "HeightField",
    "Hinge",
    "Hook",
    "Intersection",
    "Keyframe",
    "Material",
    "Mesh",
    "Motion",
    "Particles",
    "Points",
    "Polygon",
    "Probe",
    "Recording",
    "Rope",
    "Scene",
    "Session",
    "Simulation",
    "Slider",
    "Sphere",
    "Spring",
    "Sway",
    "Tank",
    "Term",
    "Union",
    "Vortex",
    "WavetankError",
    "Weld",
    "Wind",
    "__version__",
    "bundled_scenes",
    "commands",
    "load_dualsphysics",
    "load_mjcf",
    "load_robot",
    "load_splishsplash",
    "load_urdf",
    "qd",
    "render",
    "replay",
    "sampled",
    "show",
]

#: what needs the kernels' sources is imported when it is first used: data alone should load fast
LATER = {
    **dict.fromkeys(("Attract", "Burst", "Drag", "Force", "Sway", "Vortex", "Wind"), "wavetank.scene.forces"),
    "Particles": "wavetank.device.state",
    "qd": "wavetank.device.compiler",
    "Camera": "wavetank.view.camera",
    "Recording": "wavetank.session.recording",
    "Session": "wavetank.session.session",
    "Simulation": "wavetank.simulation.simulation",
    **dict.fromkeys(("Hook", "Term"), "wavetank.physics.terms.term"),
    "commands": "wavetank.session.commands",
    "load_dualsphysics": "wavetank.formats.dualsphysics",
    "load_splishsplash": "wavetank.formats.splishsplash",
    "load_mjcf": "wavetank.formats.robots",
    "load_robot": "wavetank.formats.robots",
    "load_urdf": "wavetank.formats.robots",
    "render": "wavetank.view.renderer",
    "replay": "wavetank.session.recording",
    "show": "wavetank.page.notebook.show",
}


def __getattr__(name: str) -> Any:
    """Import a name of `LATER`."""
    if name not in LATER:
        raise AttributeError(f"module 'wavetank' has no attribute {name!r}")
    module = importlib.import_module(LATER[name])
    return module if name == "commands" else getattr(module, name)


def __dir__() -> list[str]:
    """Name what there is, imported or not yet."""
    return sorted({*globals(), *LATER})
