"""Worlds made by hand: frames without a simulation."""

import numpy as np

from wavetank.device import compiler
from wavetank.simulation.frame import Frame
from wavetank.solids.build import build

compiler.start("cpu")
from wavetank.device.compiler import qd  # noqa: E402


def device(values, kind, length):
    array = qd.ndarray(kind, shape=(length,))
    host = array.to_numpy()
    host[...] = 0
    host[: len(values)] = values
    array.from_numpy(host)
    return array


def frame_of(scene, positions, velocities=None, densities=None, spare=3, kinds=None):
    """A frame of `scene` with particles at `positions`; its arrays are `spare` entries too long, as a simulation's."""
    x = np.asarray(positions, np.float32).reshape(-1, scene.dim)
    count = len(x)
    v = np.zeros_like(x) if velocities is None else np.asarray(velocities, np.float32)
    rho = np.full(count, scene.rest_density) if densities is None else np.asarray(densities)
    walls = scene.tank.walls() if scene.tank is not None else []
    vector = qd.types.vector(scene.dim, qd.f32)
    return Frame(
        scene=scene,
        number=0,
        time=0.0,
        count=count,
        x=device(x, vector, count + spare),
        v=device(v, vector, count + spare),
        rho=device(rho, qd.f32, count + spare),
        id=device(np.arange(count), qd.i32, count + spare),
        solids=build([*walls, *scene.solids], len(walls), 0.0, scene.spacing),
        dye=device([], qd.i32, count + spare),
        material=device(np.zeros(count) if kinds is None else kinds, qd.i32, count + spare),
    )
