import dataclasses

import numpy as np
import pytest
from clouds import Cloud

from wavetank.device.compiler import qd, upload
from wavetank.device.state import Air, Births, Coefficients, Grid, Particles, Walls, integers, scalars
from wavetank.device.sums import blocks_of, sum_up
from wavetank.physics.clusters import chunks, cluster_count, end_cluster, end_of, first_cluster
from wavetank.physics.foam.noise import stream, uniform
from wavetank.physics.foam.pool import new_pool
from wavetank.physics.foam.potentials import add_potentials, find_normals, limited
from wavetank.physics.foam.update import air
from wavetank.solids.distance import SolidSet


@qd.kernel
def find_surface(
    births: Births,
    particles: Particles,
    grid: Grid,
    solids: SolidSet,
    walls: Walls,
    c: Coefficients,
    a: Air,
    count: qd.i32,
    method: qd.template(),
):
    for cluster in range(cluster_count(grid, count)):
        find_normals(births, cluster, particles, grid, solids, walls, c, a, count, method)


@qd.kernel
def scan(values: qd.types.ndarray(), blocks: qd.types.ndarray(), count: qd.i32, shared: qd.template()):
    sum_up(values, blocks, count, shared)


@qd.kernel
def fill_potentials(
    out: qd.types.ndarray(),
    births: Births,
    particles: Particles,
    grid: Grid,
    c: Coefficients,
    a: Air,
    count: qd.i32,
    method: qd.template(),
):
    for chunk in range(chunks(grid, count)):
        for cluster in range(first_cluster(chunk, grid, count), end_cluster(chunk, grid, count)):
            sums = qd.Matrix.zero(qd.f32, 1, grid.lanes)
            add_potentials(sums, cluster, births, particles, grid, c, a, count, method)
            for i in range(cluster * grid.lanes, end_of(cluster, grid, count)):
                out[i] = sums[0, i - cluster * grid.lanes]


@qd.kernel
def fill_limited(out: qd.types.ndarray(), values: qd.types.ndarray(), low: qd.f32, high: qd.f32):
    for i in range(out.shape[0]):
        out[i] = limited(values[i], low, high)


@qd.kernel
def fill_uniform(out: qd.types.ndarray(), seed: qd.i32, frame: qd.i32, k: qd.i32):
    for i in range(out.shape[0]):
        out[i] = uniform(stream(seed, frame, i), k)


def potentials(cloud: Cloud, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Normals and potentials of a cloud whose U is `speed`, in device order."""
    world, births = cloud.world, new_pool(cloud.dim, 1, cloud.count).births
    a = dataclasses.replace(air(cloud.scene, cloud.count, 1 / 60), speed=speed)
    particles, grid = world.particles, world.grid
    find_surface(births, particles, grid, world.solids, world.walls, cloud.c, a, cloud.count, cloud.method)
    out = scalars(cloud.count)
    fill_potentials(out, births, particles, grid, cloud.c, a, cloud.count, cloud.method)
    return births.normal.to_numpy()[: cloud.count], out.to_numpy()


def ramp(value: np.ndarray, low: float, high: float) -> np.ndarray:
    return np.clip((value - low) / (high - low), 0.0, 1.0)


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("speed", [0.8, 2.0])
def test_potentials_are_those_of_ihmsen(dim, speed):
    """Eq. 1 to 8 over all pairs in double precision, velocities in units of U, sums as means over the support."""
    cloud = Cloud(dim, count=300, seed=2)
    normal, value = potentials(cloud, speed)
    gradient = cloud.c.density_scale * cloud.grad_w().sum(axis=1) * cloud.mass_over_rest_density()
    gradient /= cloud.c.density_scale
    steep = np.linalg.norm(gradient, axis=1)
    fast = np.linalg.norm(cloud.v, axis=1) > 0.1 * speed
    expected = np.where(((cloud.h * steep > 0.5) & fast)[:, None], -gradient / steep[:, None], 0.0)
    np.testing.assert_allclose(normal, expected, atol=2e-4)

    w = np.maximum(1 - cloud.distance / cloud.h, 0) * (cloud.distance > 0)
    mean = 1 / (np.pi / 3 * (cloud.h / cloud.scene.spacing) ** dim)
    v_ij = cloud.v[:, None] - cloud.v[None]
    away = cloud.r / np.maximum(cloud.distance, 1e-12)[..., None]
    trapped = mean * np.sum((np.linalg.norm(v_ij, axis=-1) - np.sum(v_ij * away, axis=-1)) * w, axis=1) / speed
    convex = (np.einsum("ijk,ik->ij", cloud.r, expected) > 0) & np.any(expected != 0, axis=1)[None, :]
    bend = mean * np.sum((1 - expected @ expected.T) * convex * w, axis=1)
    outwards = np.einsum("ik,ik->i", cloud.v, expected) > 0.6 * np.linalg.norm(cloud.v, axis=1)
    energy = np.sum(cloud.v**2, axis=1) / speed**2
    full = ramp(energy, 0.05, 0.5) * (ramp(trapped, 0.12, 0.5) + 2 * outwards * ramp(bend, 0.2, 0.6))
    np.testing.assert_allclose(value, full, atol=2e-3)
    assert (full > 0.1).sum() > 20


def test_the_ramp_between_two_thresholds():
    values = np.array([-1.0, 0.0, 0.2, 0.5, 0.8, 1.0, 7.0])
    device, out = scalars(len(values)), scalars(len(values))
    upload(device, values)
    fill_limited(out, device, 0.2, 0.8)
    np.testing.assert_allclose(out.to_numpy(), ramp(values, 0.2, 0.8), atol=1e-6)


def test_random_numbers_are_even_and_independent():
    def numbers(*key: int) -> np.ndarray:
        out = scalars(100_000)
        fill_uniform(out, *key)
        return out.to_numpy().astype(float)

    rows = [numbers(*key) for key in ((0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (7, 123456, 9))]
    for row in rows:
        assert row.min() >= 0.0
        assert row.max() < 1.0
        assert np.abs(np.histogram(row, 20, (0, 1))[0] / 5000 - 1).max() < 0.06
        assert abs(np.corrcoef(row[:-1], row[1:])[0, 1]) < 0.015
    correlation = np.corrcoef(rows)
    assert np.abs(correlation - np.eye(5)).max() < 0.015


@pytest.mark.parametrize("shared", [0, 1])
@pytest.mark.parametrize("count", [0, 1, 127, 128, 129, 16_384, 16_385, 70_000])
def test_the_scan_is_a_prefix_sum(count, shared):
    values = np.random.default_rng(count).integers(0, 5, count)
    device, blocks = integers(count + 1), integers(blocks_of(count))
    upload(device, values)
    scan(device, blocks, count, shared)
    np.testing.assert_array_equal(device.to_numpy()[: count + 1], np.concatenate([[0], np.cumsum(values)]))
