"""An instant as it is: densities and neighbours on the device; figures in double precision on the host."""

import numpy as np

from wavetank.foundation.params import Parameters
from wavetank.physics.coefficients import coefficients, method_number
from wavetank.physics.density_constraint import measure_density
from wavetank.physics.integrate import find_cells, predict
from wavetank.physics.mixture import blend
from wavetank.physics.near_solids import query_solids
from wavetank.physics.neighbors import find_neighbors
from wavetank.physics.pairs import count_neighbors
from wavetank.physics.sorting import sort_particles
from wavetank.physics.terms.tension import prepare_fluids
from wavetank.physics.world import World


def update_densities(world: World, params: Parameters) -> None:
    """Measure the densities [kg/m^3] of `world` as it stands. The order of particles changes, the motion does not."""
    c, count, kinds = coefficients(params, 0.0), world.count, blend(world.materials, params)
    world.keep_solids()
    predict(world.particles, world.temporaries, world.grid, world.solids, c, count, int(world.has_solids))
    find_cells(world.particles, world.grid, c, count)
    sort_particles(world.particles, world.spare, world.grid, count)
    world.swap()
    world.grid = find_neighbors(world.particles, world.grid, c, count)
    prepare_fluids(world, kinds, params, params.frame_time)
    if world.has_solids:
        query_solids(world.temporaries, world.particles, world.solids, c, count)
    measure_density(
        world.temporaries,
        world.particles,
        world.grid,
        world.solids,
        world.walls,
        c,
        kinds.largest_density,
        count,
        method_number(params),
    )


def neighbor_numbers(world: World, params: Parameters) -> np.ndarray:
    """Return how many neighbours every particle had in the last search, int32 [count], in device order."""
    return count_neighbors(world.particles, world.grid, coefficients(params, 0.0), world.count)


def density_error(densities: np.ndarray, rest_density: float | np.ndarray) -> np.ndarray:
    """Return the compression of each particle, max(rho / rho_0 - 1, 0), float64 [n].

    A free surface lacks neighbours, so its density reads low without being wrong; only too much density is an error
    that the solver could have mended.
    """
    return np.maximum(densities.astype(np.float64) / rest_density - 1.0, 0.0)


def kinetic_energy(velocities: np.ndarray, mass: float | np.ndarray) -> float:
    """Return the sum of m v^2 / 2 [J] (per metre of depth in a 2-D world)."""
    return 0.5 * float(np.sum(mass * np.sum(velocities.astype(np.float64) ** 2, axis=1)))


def potential_energy(positions: np.ndarray, mass: float | np.ndarray, gravity: tuple[float, ...]) -> float:
    """Return the sum of -m g x [J], zero at the origin (per metre of depth in a 2-D world)."""
    return -float(np.sum(mass * (positions.astype(np.float64) @ np.array(gravity))))


def statistics(
    positions: np.ndarray,
    velocities: np.ndarray,
    densities: np.ndarray,
    neighbors: np.ndarray,
    params: Parameters,
    rest_densities: np.ndarray,
) -> dict[str, float]:
    """Return the figures of an instant as plain numbers; every array has one row for each particle."""
    count = len(positions)
    mass = rest_densities * params.spacing**params.dim
    error = density_error(densities, rest_densities) if count else np.zeros(1)
    densities = densities if count else np.array([0.0], np.float32)
    speed = np.linalg.norm(velocities.astype(np.float64), axis=1)
    return {
        "count": count,
        "density_mean": float(densities.mean(dtype=np.float64)),
        "density_max": float(densities.max()),
        "density_error_mean": float(error.mean()),
        "density_error_p99": float(np.percentile(error, 99)),
        "density_error_max": float(error.max()),
        "kinetic_energy": kinetic_energy(velocities, mass),
        "potential_energy": potential_energy(positions, mass, params.gravity),
        "speed_max": float(speed.max(initial=0.0)),
        "speed_rms": float(np.sqrt(np.mean(speed**2))) if count else 0.0,
        "neighbors_mean": float(neighbors.mean()) if count else 0.0,
        "neighbors_max": int(neighbors.max(initial=0)),
    }
