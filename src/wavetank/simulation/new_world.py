"""An empty world for a scene: all its arrays, allocated once."""

from wavetank.device import compiler
from wavetank.device.periods import NONE
from wavetank.device.state import Fluids, Walls, new_particles, new_temporaries, vectors
from wavetank.physics.bodies import Pieces
from wavetank.physics.neighbors import list_room, new_grid
from wavetank.physics.pressure.grid import OPEN_CELLS, new_pressure_grid
from wavetank.physics.smoothing import half_space_table
from wavetank.physics.world import World
from wavetank.scene.scene import Scene
from wavetank.simulation.moving_solids import MovingSolids


def new_world(scene: Scene, capacity: int, solids: MovingSolids, pieces: Pieces | None) -> World:
    """Return an empty world with room for `capacity` particles, and with these solids and `pieces` of bodies."""
    dim, h = scene.dim, scene.support * scene.spacing
    table = half_space_table(scene.kernel, dim, scene.support)
    walls = Walls(vectors(2, len(table)))
    compiler.upload(walls.table, table)
    size = scene.tank.size if scene.tank else None
    periods = scene.tank.periods() if scene.tank else NONE
    return World(
        grid=new_grid(dim, capacity, size, h, list_room(dim, scene.support), periods),  # first: it may be refused
        particles=new_particles(dim, capacity),
        spare=new_particles(dim, capacity),
        temporaries=new_temporaries(capacity),
        solids=solids.device,
        walls=walls,
        fluids=Fluids(capacity, rows=vectors(4, len(scene.materials) + 1)),
        materials={},
        count=0,
        has_friction=solids.has_friction,
        pressure=new_pressure_grid(scene.tank.beyond(OPEN_CELLS * h), h, periods.axes) if scene.tank else None,
        pieces=pieces,
    )
