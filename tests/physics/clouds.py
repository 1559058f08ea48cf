"""Random clouds of particles, and the report's equations over all pairs in double precision."""

import dataclasses

import numpy as np

import wavetank as wt
from wavetank.physics.coefficients import coefficients, method_number
from wavetank.physics.smoothing import NAMES, kernel_shape, sigma
from wavetank.simulation.simulation import Simulation


class Cloud:
    """A world without walls, and the same world as arrays of all pairs."""

    def __init__(self, dim: int, count: int = 200, seed: int = 0, **settings) -> None:
        rng = np.random.default_rng(seed)
        d = 0.1
        side = d * count ** (1 / dim)
        x = rng.uniform(-side / 2, side / 2, (count, dim)).astype(np.float32)
        v = rng.normal(0, 1, (count, dim)).astype(np.float32)
        self.scene = wt.Scene(spacing=d, fluids=[wt.Points(positions=x, velocities=v)], **settings)
        self.sim = Simulation(self.scene)
        self.frame = self.sim.frame()  # sorts the particles and lists the neighbours
        self.world = self.sim.world
        # Clouds overlap far more than water does; the equations are checked without the safety stop.
        self.c = dataclasses.replace(coefficients(self.scene, 1 / 240), largest_correction=1e9, relaxation=1.0)
        self.method = method_number(self.scene)
        self.dim, self.count, self.h = dim, count, self.scene.support * d
        self.x = self.predictions(self.world.particles)
        self.v = self.world.particles.v.to_numpy()[:count].astype(np.float64)
        self.r = self.x[:, None, :] - self.x[None, :, :]
        self.distance = np.linalg.norm(self.r, axis=-1)

    def predictions(self, particles) -> np.ndarray:
        """Predicted positions [m], float64 [count, dim]."""
        components = [particles.px, particles.py, particles.pz][: self.dim]
        return np.stack([p.to_numpy()[: self.count] for p in components], axis=1).astype(np.float64)

    def mass_over_rest_density(self) -> float:
        """m / rho_0 for which the rest lattice has density rho_0."""
        return float(self.c.density_scale * self.h**self.dim / sigma(NAMES[self.scene.kernel][0], self.dim))

    def w(self) -> np.ndarray:
        """W_ij [1/m^dim] for all pairs."""
        name = NAMES[self.scene.kernel][0]
        return sigma(name, self.dim) / self.h**self.dim * kernel_shape(name, self.distance / self.h)[0]

    def grad_w(self) -> np.ndarray:
        """grad_i W_ij [1/m^(dim + 1)] for all pairs, zero for i = j."""
        name = NAMES[self.scene.kernel][1]
        slope = sigma(name, self.dim) / self.h ** (self.dim + 1) * kernel_shape(name, self.distance / self.h)[1]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.distance[..., None] > 0, slope[..., None] * self.r / self.distance[..., None], 0.0)
