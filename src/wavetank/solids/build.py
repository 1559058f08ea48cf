"""Puts solids on the device: their programs, poses and grids of distances."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.foundation.errors import WavetankError
from wavetank.solids.distance import SolidSet, deepest, parts, vec2, vec3, vec4
from wavetank.solids.meshes.on_device import put_grids
from wavetank.solids.solid import Node, Solid


def build(
    solids: Sequence[Solid], tank_count: int, friction: float, spacing: float, repeats: tuple[int, Any] = (0, ())
) -> SolidSet:
    """Put `solids` on the device, for particles of that spacing [m]; the first `tank_count` are the tank's walls.

    `repeats`: bits of the axes along which the world is periodic, and the result of `seams.seen_periods`.
    Raises `WavetankError` for set operations that are nested too deep and for meshes that cannot be measured.
    """
    programs = [solid.program() for solid in solids]
    for solid, program in zip(solids, programs, strict=True):
        _check_depth(solid, program)
    nodes = [node for program in programs for node in program] or [Node(0)]
    codes, grid, samples = put_grids(nodes, spacing)
    count = max(len(solids), 1)
    first = np.concatenate([[0], np.cumsum([len(program) for program in programs], dtype=int)])
    position = np.array([s.origin for s in solids]).reshape(-1, 3)
    rotation = np.array([s.quaternion for s in solids]).reshape(-1, 4)
    frictions = [friction if s.friction is None else s.friction for s in solids]

    def array(values: Any, kind: Any, length: int) -> Any:
        result = qd.ndarray(kind, shape=(length,))
        upload(result, values)
        return result

    return SolidSet(
        op=array(codes, qd.i32, len(nodes)),
        size=array([n.size for n in nodes], vec4, len(nodes)),
        offset=array([n.offset for n in nodes], vec3, len(nodes)),
        turn=array([n.turn for n in nodes], vec4, len(nodes)),
        first=array(first, qd.i32, count + 1),
        reach=array([s.reach() for s in solids], qd.f32, count),
        friction=array(frictions, qd.f32, count),
        position=array(position, vec3, count),
        rotation=array(rotation, vec4, count),
        old_position=array(position, vec3, count),
        old_rotation=array(rotation, vec4, count),
        plane=array([], vec4, count),
        sweep=array([], vec2, count),
        center=array(position, vec3, count),
        unit=array([], qd.f32, count),
        grip=array(np.ones(count), qd.f32, count),
        reaction=array([], qd.i32, parts.fn() * count),
        grid=grid,
        samples=samples,
        period=array(repeats[1], vec3, count),
        count=len(solids),
        tank_count=tank_count,
        repeats=repeats[0],
        has_grids=any(node.mesh is not None for node in nodes),
        has_operations=any(len(program) > 1 for program in programs),
    )


def _check_depth(solid: Solid, program: list[Node]) -> None:
    """Raise `WavetankError` for a solid whose program needs more than the stack on the device holds."""
    depth = most = 0
    for node in program:
        depth += 1 if node.op >= 0 else -1
        most = max(most, depth)
    if most > deepest.fn():
        raise WavetankError(
            f"solid {solid.name or type(solid).__name__!r} nests set operations {most} deep; "
            f"at most {deepest.fn()} are allowed: build it from several solids."
        )


def resize(device: SolidSet, solids: Sequence[Solid], scales: Sequence[float]) -> None:
    """Scale the solids on the device by these factors around their origins."""
    nodes = [(node, scale) for solid, scale in zip(solids, scales, strict=True) for node in solid.program()]
    for array, values in (
        (device.size, [scale * node.size for node, scale in nodes]),
        (device.offset, [scale * node.offset for node, scale in nodes]),
    ):
        upload(array, values)
