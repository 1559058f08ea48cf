"""A path-traced picture: instants of the open shutter, photons and samples for each, until all samples are there."""

import dataclasses
import hashlib
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from wavetank.device.compiler import download, qd, synchronize, upload
from wavetank.device.state import interned
from wavetank.view.buffers import Buffers
from wavetank.view.film import balls, denoise, field, light, paths
from wavetank.view.film.march import World
from wavetank.view.film.medium import Medium, medium_of
from wavetank.view.film.samples import Watch, digest_of, load, store
from wavetank.view.film.shifted import shifted
from wavetank.view.lens import vec2, vec3, vec4, vector
from wavetank.view.look import Look
from wavetank.view.optics.radiance import background
from wavetank.view.paints import finishes_of, traced_colors
from wavetank.view.passes import ellipsoids, solids
from wavetank.view.shot import Shot
from wavetank.view.style import Style
from wavetank.view.water_buffers import water_of
from wavetank.view.weights import under_water

PHOTONS, ROUNDS = 1_600_000, 16  # of a picture, and the rounds in which they are traced
TEXELS_A_SPACING, MOST_TEXELS = 4.0, 1400  # of the photon map of the floor
BRIGHTEST = 8.0
SLICES, TURNS = 8, (0, 2, 4, 6, 1, 3, 5, 7)  # instants of an open shutter: both halves of the samples see all of it


class Tracer:
    """Traces the pictures of one size."""

    def __init__(self, buffers: Buffers) -> None:
        self.buffers = buffers
        shape = (buffers.rows, buffers.columns)
        self.film = paths.Film(
            mean=qd.ndarray(vec3, shape=shape),
            half=qd.ndarray(vec3, shape=shape),
            albedo=qd.ndarray(vec3, shape=shape),
            shape=qd.ndarray(vec4, shape=shape),
        )
        self._sky: Any = qd.ndarray(vec3, shape=(1, 1))
        self._seen = ""  # hash of the panorama; empty without one
        self._arrays: field.FieldArrays | None = None
        self._photons: light.Photons | None = None
        self._spare: tuple[Any, Any, Any] | None = None

    def draw(self, shot: Shot, style: Style, watch: Watch) -> None:
        """Fill `color` with the picture of a style; stopped, with what there is of it."""
        options = (style.samples, style.aperture, style.focus, style.shutter)
        self._set_sky(style.sky())
        about = (*options, self.buffers.rows, self.buffers.columns, self._seen)
        digest = digest_of(shot, about) if watch.path else ""
        watch.begun = watch.done = load(watch.path, self.film, digest) if watch.path else 0

        def tell(done: int) -> bool:
            watch.done = done
            return watch.tell is None or watch.tell(done, style.samples)

        watch.done = self.trace(
            shot,
            style.samples,
            aperture=style.aperture,
            focus=style.focus,
            shutter=style.shutter,
            first=watch.begun,
            tell=tell,
        )
        watch.whole = watch.done >= style.samples
        if watch.path and not watch.whole:
            store(watch.path, self.film, digest, watch.done)
        elif watch.path:
            watch.path.unlink(missing_ok=True)
        if self._spare is None:
            shape = (self.buffers.rows, self.buffers.columns)
            self._spare = (qd.ndarray(vec3, shape=shape), qd.ndarray(vec3, shape=shape), qd.ndarray(vec2, shape=shape))
        self.buffers.pixels.color.copy_from(denoise.denoised(self.film, self._spare))

    def _set_sky(self, sky: np.ndarray | None) -> None:
        """Use a panorama as the sky, or none."""
        seen = "" if sky is None else hashlib.sha256(sky.tobytes()).hexdigest()
        if seen == self._seen:
            return
        self._sky, self._seen = qd.ndarray(vec3, shape=(1, 1) if sky is None else sky.shape[:2]), seen
        if sky is not None:
            upload(self._sky, sky)

    def trace(
        self,
        shot: Shot,
        samples: int,
        *,
        aperture: float = 0.0,
        focus: float | None = None,
        shutter: float = 0.0,
        first: int = 0,
        tell: Callable[[int], bool] | None = None,
    ) -> int:
        """Take the samples from `first` on and return how many are done: fewer where `tell` stops them.

        `aperture` is the radius of the lens [m], `focus` the depth that is sharp [m], `shutter` for how long it is open
        [s]. `tell` is called regularly with the number of samples done, and stops by returning False.
        """
        slices = [0.0] if shutter == 0.0 else [shutter * ((k + 0.5) / SLICES - 0.5) for k in TURNS]
        setting = self.setting(shot, aperture, focus)
        done = first
        for number, moved in enumerate(slices):
            end = samples * (number + 1) // len(slices)
            if done >= end:
                continue
            now = shot if moved == 0.0 else dataclasses.replace(shot, frame=shifted(shot.frame, moved))
            world = self._world(now, shutter, moved)
            medium = medium_of(now, world.field.grid)
            photons = self._trace_photons(now, world, medium, number, len(slices))
            around = interned(dataclasses.replace(setting, under=under_water(now, self.buffers)))
            while done < end:
                count = min(self._at_once(), end - done)
                paths.trace(
                    self.film, world, photons, shot.lens, shot.look, medium, around, done, count, max(1, samples // 2)
                )
                synchronize()
                done += count
                if tell is not None and not tell(done):
                    return done
        return done

    def _at_once(self) -> int:
        return max(1, min(16, 1_500_000 // (self.buffers.rows * self.buffers.columns)))

    def setting(self, shot: Shot, aperture: float, focus: float | None) -> paths.Setting:
        """Return what surrounds the water, and how it is looked at."""
        extent, lens = shot.extent, shot.lens
        depth = float((extent.middle - lens.eye) @ lens.forward) if focus is None else focus
        distance = max(float(np.linalg.norm(extent.middle - lens.eye)), 0.2 * extent.radius)
        pixels = self.buffers.rows / self.buffers.supersample
        edge = 0.5 * max(1.0, pixels / 420.0) * distance / float(lens.focal) if shot.frame.scene.tank else 0.0
        fill = vector(1.0, 1.0, 1.0) if self._seen else sky_fill(shot.look)
        return paths.Setting(
            fill=fill,
            middle=vector(extent.middle[0], 0.0, extent.middle[2]),
            size=extent.radius,
            tank=shot.walls,
            edge=float(edge),
            aperture=float(aperture),
            focus=max(float(depth), 1e-3),
            under=0,
            brightest=BRIGHTEST,
            sky=self._sky,
            has_panorama=int(bool(self._seen)),
        )

    def _world(self, shot: Shot, shutter: float, moved: float) -> World:
        """Return all that rays may hit at an instant."""
        speed = float(np.abs(shot.frame.velocities).max()) if shutter and shot.frame.count else 0.0
        ellipsoids.draw(shot, self.buffers)
        water = water_of(self.buffers, shot)
        grid = field.grid_around(shot, 0.0 if not shutter else speed * shutter)
        if self._arrays is None or self._arrays.grid is not grid:
            self._arrays = None
            self._arrays = field.allocate(grid)
        spheres, touched = balls.balls_of(shot, water, grid, moved)
        upload(self._arrays.near, touched)
        paints = self.buffers.paints.of(traced_colors(shot))
        finish = qd.ndarray(qd.i32, shape=(max(shot.frame.solids.count, 1),))
        upload(finish, finishes_of(shot))
        return World(
            field=field.build(self._arrays, water, shot),
            balls=spheres,
            solids=shot.frame.solids,
            window=solids.window(shot),
            paints=paints,
            finish=finish,
        )

    def _trace_photons(self, shot: Shot, world: World, medium: Medium, slice: int, slices: int) -> light.Photons:
        """Return the photon maps of an instant."""
        grid, look, d = world.field.grid, shot.look, shot.extent.spacing
        lower, upper = np.asarray(grid.lower, float), np.asarray(grid.upper, float)
        corners = np.array([[(lower, upper)[k >> axis & 1][axis] for axis in range(3)] for k in range(8)])
        to_sun = np.asarray(look.to_sun, float)
        side = np.cross([0.0, 1.0, 0.0] if abs(to_sun[1]) < 0.99 else [1.0, 0.0, 0.0], to_sun)
        side /= np.linalg.norm(side)
        top = np.cross(to_sun, side)
        a, b, c = corners @ side, corners @ top, corners @ to_sun
        begin = side * a.min() + top * b.min() + to_sun * (c.max() + 0.05 * shot.extent.radius)
        wide, tall = float(np.ptp(a)), float(np.ptp(b))
        rounds = max(1, ROUNDS // slices)
        together = min(PHOTONS, 8 * self.buffers.rows * self.buffers.columns) / (slices * rounds)
        across = max(8, round(math.sqrt(together * wide / tall)))
        rows = max(8, round(together / across))
        margin = 1.2 * (upper[1] - lower[1]) + 4.0 * d
        size = upper[[0, 2]] - lower[[0, 2]] + 2.0 * margin
        texel = max(d / TEXELS_A_SPACING, float(size.max()) / MOST_TEXELS)
        texels = [math.ceil(length / texel) for length in size]
        solid = shot.frame.solids.count > shot.frame.solids.tank_count
        has_flow = bool(medium.is_turbid) or solid or int(world.balls.list.shape[0]) > 1
        cells = grid.nx * grid.ny * grid.nz // 8 if has_flow else 1
        shapes = ((texels[1], texels[0], 3), (cells, 6))
        kept = self._photons
        if kept is None or (tuple(kept.floor.shape), tuple(kept.flow.shape)) != shapes:
            floor, flow = (qd.ndarray(qd.i32, shape=shape) for shape in shapes)
        else:
            floor, flow = kept.floor, kept.flow
            floor.fill(0)
            flow.fill(0)
        photons = light.Photons(
            floor=floor,
            flow=flow,
            corner=vector(lower[0] - margin, texel, lower[2] - margin),
            begin=vector(*begin),
            right=vector(*(side * wide)),
            up=vector(*(top * tall)),
            across=across,
            rows=rows,
            power=wide * tall / (across * rows * rounds),
            has_flow=int(has_flow),
        )
        self._photons = photons
        if float(np.max(look.sun)) > 0.0:
            for number in range(rounds):
                light.trace_photons(photons, world, look, medium, slice * rounds + number)
        return photons


@qd.kernel(fastcache=True)
def sample_sky(found: qd.types.ndarray(), directions: qd.types.ndarray(), look: Look, count: qd.i32):
    """Write the radiance of the sky in every direction."""
    for k in range(count):
        found[k] = background(look, directions[k])


def sky_fill(look: Look) -> Any:
    """Return the factor on sky light for matte surfaces with which a white one shows `Look.sky`."""
    count = 2048
    up = np.sqrt((np.arange(count) + 0.5) / count)  # by the cosine
    turn, flat = 2.3999632297 * np.arange(count), np.sqrt(1.0 - up * up)
    directions, found = qd.ndarray(vec3, shape=(count,)), qd.ndarray(vec3, shape=(count,))
    upload(directions, np.stack([flat * np.cos(turn), up, flat * np.sin(turn)], axis=1).astype(np.float32))
    sample_sky(found, directions, look, count)
    mean = download(found).mean(axis=0)
    return vector(*(np.asarray(look.sky) / np.maximum(mean, 1e-6)))
