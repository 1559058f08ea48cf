"""Bodies as the water sees them: pieces that it would have filled."""

import dataclasses

import numpy as np

from wavetank.device.compiler import qd, upload
from wavetank.device.state import integers, scalars, vectors


@dataclasses.dataclass(frozen=True, eq=False)
class Pieces:
    """Small pieces of all bodies, on the device."""

    place: qd.types.ndarray()  # vec3 [pieces], m: in the frame of the solid
    solid: qd.types.ndarray()  # i32 [pieces]: number of the solid
    edges: qd.types.ndarray()  # vec3 [pieces], m: of the box that it is cut from
    volume: qd.types.ndarray()  # f32 [pieces]: over that of a particle
    count: qd.i32
    reach: qd.f32  # m: radius of the largest body


def new_pieces(bodies: dict[int, tuple[np.ndarray, np.ndarray, np.ndarray]], reach: float) -> Pieces:
    """Put the pieces of bodies, none of which has a larger `reach` [m], on the device.

    By number of the solid: places [n, 3] [m], edges [3] [m], volumes [n] over that of a particle.
    """
    sizes = [len(places) for places, _, _ in bodies.values()]
    count = sum(sizes)
    place, solid, edges, volume = vectors(3, count), integers(count), vectors(3, count), scalars(count)
    if count:
        upload(place, np.concatenate([places for places, _, _ in bodies.values()]))
        upload(solid, np.repeat(list(bodies), sizes))
        upload(edges, np.repeat([edges for _, edges, _ in bodies.values()], sizes, axis=0))
        upload(volume, np.concatenate([volumes for _, _, volumes in bodies.values()]))
    return Pieces(place, solid, edges, volume, count, reach)
