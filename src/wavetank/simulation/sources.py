"""Emitters and drains of a running world, which act at the end of every frame: drains first, as they may feed emitters.

Each place of an inlet emits a particle whenever the volume of a row has passed, neighbors alternately. Its position at
the end of the frame follows from the time when it left: it has flown freely since. The flow is exact to a particle for
any length of frames. Particles without free space, because water stands in the inlet, are pending and come as soon as
there is. `inflow.py` computes what leaves an inlet.
"""

import dataclasses
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.device.compiler import download
from wavetank.foundation.arguments import KnownAttributes, instance_of
from wavetank.foundation.errors import WavetankError
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter
from wavetank.scene.forces import Attract, Force
from wavetank.scene.gauges import Gauge
from wavetank.scene.scene import Scene
from wavetank.simulation.inflow import fly_freely, jet_force, one_row, particles_due
from wavetank.simulation.particles import ParticleSystem, check_newcomers

GAP = 0.8  # d: distance of new particles from others, at least
PRESSED = 0.45  # d: the same where more than a row is pending because of water under pressure
LONGEST_PENDING = 0.5  # s: flow of this time can be pending; the rest is withheld, with a note
MOST_DUE = 5_000_000  # particles of an emitter in a frame
SPARSE = 50.0  # d: inlets with particles farther apart are refused
REACH = 4.0  # radii: range of the suction of a drain


@dataclasses.dataclass
class Source:
    """An emitter or a drain of a running world."""

    name: str  # of the scene, or "emitter 1", "drain 1" and so on
    on: bool = True  # whether it acts when the scene lets it
    rate: float = 0.0  # m^3/s, in 2-D m^2/s: flow in the last frame
    phase: float = 0.0  # of a row; of a drain: fraction of the next particle
    pending: int = 0  # particles that found no free space yet
    total: int = 0  # particles that it emitted or removed
    withheld: int = 0  # particles that an emitter could not emit
    flows: bool = False  # whether an emitter emits now
    store: int = 0  # particles that a drain removed and no emitter has emitted again

    def plain(self) -> dict[str, Any]:
        """Return what a saved state has of this."""
        stored = {key: getattr(self, name) for name, key in STORED.items()}
        return stored if self.on else {**stored, "on": False}

    def read(self, plain: Mapping[str, Any]) -> None:
        """Restore what `plain` returned."""
        for name, key in STORED.items():
            setattr(self, name, plain.get(key, getattr(self, name)))
        self.on = bool(plain.get("on", True))


class LiveSource(KnownAttributes):
    """An emitter or a drain of a running world by name, in `sim.sources`."""

    def __init__(self, source: Source) -> None:
        self._source = source

    def __repr__(self) -> str:
        return f"<source {self.name!r}: {'on' if self.on else 'off'}, {self.rate:g} m^3/s, {self.total:,} particles>"

    @property
    def name(self) -> str:
        """Name in the scene, or "emitter 1", "drain 1" and so on."""
        return self._source.name

    @property
    def on(self) -> bool:
        """Whether it acts when the scene lets it; writable."""
        return self._source.on

    @on.setter
    def on(self, value: bool) -> None:
        self._source.on = instance_of("on", value, bool, "True or False")

    @property
    def rate(self) -> float:
        """Flow in the last frame [m^3/s], in 2-D [m^2/s]."""
        return self._source.rate

    @property
    def total(self) -> int:
        """Number of particles that it emitted or removed."""
        return self._source.total

    @property
    def withheld(self) -> int:
        """Number of particles that an emitter could not emit."""
        return self._source.withheld


#: Attributes of a source that decide how it continues, and their keys in saved states.
STORED = {
    "phase": "phase",
    "pending": "owed",
    "total": "total",
    "withheld": "withheld",
    "flows": "flows",
    "store": "store",
}


def rows_due(way: float, more: float, pitch: float) -> tuple[np.ndarray, float]:
    """Return how far [m] the rows are that leave while a jet moves by `more` [m], and the distance of the next one.

    `way` is the distance that this returned last.
    """
    way += more
    rows = int(way / pitch)
    way -= rows * pitch
    return way + pitch * np.arange(rows), way


class Sources(Mapping[str, LiveSource]):
    """The emitters and drains of a world by name. Raises `WavetankError` for an unknown name."""

    def __init__(self, scene: Scene, notes: list[str]) -> None:
        """Begin as the scene says; sentences for people are appended to `notes`."""
        self.emitters = _named_sources("emitter", scene.emitters)
        self.drains = _named_sources("drain", scene.drains)
        self.notes = notes
        self._said: set[str] = set()  # notes that were given

    @override
    def __getitem__(self, name: str) -> LiveSource:
        for source in (*self.emitters, *self.drains):
            if source.name == name:
                return LiveSource(source)
        raise WavetankError(f"there is no emitter or drain named {name!r}; there are: {', '.join(self) or 'none'}.")

    @override
    def __contains__(self, name: object) -> bool:
        return any(source.name == name for source in (*self.emitters, *self.drains))

    @override
    def __iter__(self) -> Iterator[str]:
        return iter([source.name for source in (*self.emitters, *self.drains)])

    @override
    def __len__(self) -> int:
        return len(self.emitters) + len(self.drains)

    def forces(self, scene: Scene, time: float, duration: float) -> list[Force]:
        """Return the suction of drains and the jets in inlets for a frame of `duration` [s] from `time` [s] on."""
        begin, found = time + scene.start_time, list[Force]()
        clock = begin + 0.5 * duration
        for drain, source in zip((drain.at(clock) for drain in scene.drains), self.drains, strict=True):
            if drain.suction and source.on and acts(drain, begin, duration):
                found.append(suction_of(drain))
        for emitter, source in zip(scene.emitters, self.emitters, strict=True):
            if source.flows and source.on and emitter.mesh is None and acts(emitter, begin, duration):
                found.append(jet_force(scene, emitter.at(clock), clock))
        return found

    def act(self, particles: ParticleSystem, time: float, duration: float, dt: float) -> None:
        """Remove and add particles at the end of a frame of `duration` [s] from `time` [s] on, in steps of `dt` [s]."""
        scene, begin = particles.scene, time + particles.scene.start_time
        before = [source.total for source in (*self.drains, *self.emitters)]
        for number, source in enumerate(self.drains):
            if source.on:
                self._drain(particles, scene.drains[number], source, begin, begin + duration)
        for number, source in enumerate(self.emitters):
            if source.on:
                self._emit(particles, number, source, (begin, begin + duration), dt)
        for source, total in zip((*self.drains, *self.emitters), before, strict=True):
            source.rate = (source.total - total) * scene.spacing**scene.dim / duration

    def figures(self) -> dict[str, int]:
        """Return numbers of particles emitted, drained and withheld, for `Simulation.stats`."""
        return {
            "emitted": sum(source.total for source in self.emitters),
            "drained": sum(source.total for source in self.drains),
            "withheld": sum(source.withheld for source in self.emitters),
        }

    def plain(self) -> dict[str, Any]:
        """Return what a saved state has of this; nothing without emitters and drains."""
        if not self:
            return {}
        return {
            "emitters": [source.plain() for source in self.emitters],
            "drains": [source.plain() for source in self.drains],
        }

    def read(self, plain: dict[str, Any]) -> None:
        """Restore what `plain` returned; sources that it lacks begin as new ones."""
        for name in ("emitters", "drains"):
            for source, stored in zip(getattr(self, name), plain.get(name, []), strict=False):
                source.read(stored)

    # --- drains ---

    def _drain(self, particles: ParticleSystem, drain: Drain, source: Source, begin: float, end: float) -> None:
        drain = drain.at(0.5 * (begin + end))
        first, last = span(drain, begin, end)
        if last <= first or not particles.count:
            return
        scene, most = particles.scene, particles.count
        if drain.flow is not None:
            unit = 1.0 if scene.dim == 2 else 1e-3
            source.phase += drain.flow * unit * (last - first) / scene.spacing**scene.dim
            most = int(source.phase)
        if drain.level is not None:
            most = min(most, max(0, -missing_particles(particles, drain, drain.level)))
        taken = drain_particles(particles, drain, most) if most else 0
        source.total += taken
        source.store += taken
        if drain.flow is not None:  # particles that were not there are not removed later
            source.phase = min(source.phase - taken, 1.0)

    # --- emitters ---

    def _emit(
        self, particles: ParticleSystem, number: int, source: Source, frame: tuple[float, float], dt: float
    ) -> None:
        emitter, (begin, end) = particles.scene.emitters[number], frame
        first, last = span(emitter, begin, end)
        if last <= first:
            return
        scene, spacing = particles.scene, particles.scene.spacing
        now = emitter.at(0.5 * (first + last))
        inlet = now.inlet(spacing)
        volume = len(inlet) * spacing**scene.dim
        rows = now.rate(inlet) * (last - first) / volume
        source.flows = rows > 0.0
        if not source.flows:
            return
        if rows * len(inlet) > MOST_DUE:
            raise WavetankError(
                f"emitters[{number}] lets out {rows * len(inlet):,.3g} particles in a frame; at most {MOST_DUE:,} are "
                "allowed: lower its speed or flow, or make the spacing larger."
            )
        due, source.phase = particles_due(inlet, source.phase, rows)
        keep = self._allowed(particles, now, len(due.place), source)
        if keep < len(due.place):
            due, source.pending, source.flows = due.first(keep), 0, keep > 0
        x, v = fly_freely(scene, emitter, inlet, due.aged(end - last, (last - first) / rows), end, dt)
        most_pending = max(len(inlet), math.ceil(now.rate(inlet) * LONGEST_PENDING / spacing**scene.dim))
        gap = PRESSED if source.pending > len(inlet) else GAP
        came = self._put(particles, now, x, v, gap) if len(x) else 0
        source.pending += len(x) - came
        if source.pending:  # in the inlet, wherever there is free space by now
            x, v = fly_freely(scene, emitter, inlet, one_row(inlet), end, dt)
            late = self._put(particles, now, x, v, gap, source.pending)
            source.pending -= late
            came += late
        if source.pending > most_pending:
            source.withheld += source.pending - most_pending
            source.pending = most_pending
            self._note(f"{_name(emitter, number)} is blocked by water or a solid: less comes out than it should.")
        source.total += came
        if emitter.feed:
            self._fed(scene, emitter).store -= came

    def _allowed(self, particles: ParticleSystem, emitter: Emitter, due: int, source: Source) -> int:
        """Return how many of the `due` particles may come, by the drain that feeds them, the level and the capacity."""
        allowed = due
        if emitter.feed:
            allowed = min(allowed, self._fed(particles.scene, emitter).store - source.pending)
        if emitter.level is not None and due:
            allowed = min(allowed, missing_particles(particles, emitter, emitter.level))
        most = particles.scene.most_particles
        if most is not None and particles.scene.when_full == "stop" and particles.count + allowed > most:
            fit = max(0, most - particles.count)
            source.withheld += allowed - fit
            allowed = fit
            self._note(
                f"There are {particles.count:,} particles and most_particles = {most:,}: emitters wait for room."
            )
        return max(0, allowed)

    def _put(
        self,
        particles: ParticleSystem,
        emitter: Emitter,
        x: np.ndarray,
        v: np.ndarray,
        gap: float,
        most: int | None = None,
    ) -> int:
        """Add the particles with free space, `most` at most, and return their number; the oldest may be recycled."""
        scene = particles.scene
        free = np.flatnonzero(particles.free_places(x, gap * scene.spacing, scene.wall_gap * scene.spacing))[:most]
        if not len(free):
            return 0
        full = 0 if scene.most_particles is None else particles.count + len(free) - scene.most_particles
        if full > 0 and scene.when_full == "recycle":
            ids = download(particles.world.particles.id)[: particles.count]
            particles.remove(np.sort(ids)[:full])
        names = [None, *(material.name for material in scene.materials)]
        kinds = np.full(len(free), names.index(emitter.material), np.int32)
        dyes = np.full(len(free), emitter.dye_number, np.int32)
        particles.add(check_newcomers(scene, x[free], v[free], dyes, kinds))
        return len(free)

    def _fed(self, scene: Scene, emitter: Emitter) -> Source:
        return self.drains[[drain.name for drain in scene.drains].index(emitter.feed)]

    def _note(self, sentence: str) -> None:
        if sentence.split(":")[-1] not in self._said:
            self._said.add(sentence.split(":")[-1])
            self.notes.append(sentence)


def check_places(particles: ParticleSystem, dt: float) -> None:
    """Raise `WavetankError` where an emitter starts inside of a solid or outside of the tank."""
    scene = particles.scene
    for number, emitter in enumerate(scene.emitters):
        now = emitter.at(scene.start_time)
        inlet = now.inlet(scene.spacing)
        x, _ = fly_freely(scene, emitter, inlet, one_row(inlet), scene.start_time, dt)
        if inlet.pitch > SPARSE * scene.spacing:
            raise WavetankError(
                f"emitters[{number}] has an inlet so small that its particles are {inlet.pitch:.3g} m apart; make it "
                f"larger, not much less than spacing = {scene.spacing:g} m, or the spacing smaller."
            )
        lower, upper = scene.tank.box() if scene.tank else (-np.inf, np.inf)
        x = scene.tank.within(x) if scene.tank else x
        inside = np.all((x >= lower) & (x <= upper), axis=1)
        if not (particles.free_places(x, 0.0, scene.wall_gap * scene.spacing) & inside).any():
            raise WavetankError(
                f"emitters[{number}] is inside of a solid or outside of the tank, and nothing can come out; move its "
                "position to where there is room, or turn its direction."
            )


def acts(source: Emitter | Drain, begin: float, duration: float) -> bool:
    """Return whether an emitter or a drain acts in a frame that begins at `begin` [s] of the scene's clock."""
    first, last = span(source, begin, begin + duration)
    return last > first


def span(source: Emitter | Drain, begin: float, end: float) -> tuple[float, float]:
    """Return the part of the time from `begin` to `end` [s] in which a source acts; empty where it does not."""
    stop = math.inf if source.duration is None else source.start + source.duration
    first = min(max(begin, source.start), end)
    return first, max(first, min(end, stop))


def drain_particles(particles: ParticleSystem, drain: Drain, most: int | None = None) -> int:
    """Remove the particles inside a drain, `most` at most, and return their number."""
    if drain.shape == "sphere" and (most is None or most >= particles.count):
        assert drain.center is not None
        assert drain.radius is not None
        center = np.array([*drain.center, 0.0][:3], float)
        return particles.remove_inside(center, center, drain.radius)
    most = particles.count if most is None else most
    x = download(particles.world.particles.x)[: particles.count].astype(np.float64)
    middle = drain.middle()
    if particles.scene.tank and middle is not None:
        x = particles.scene.tank.beside(x, middle)
    depth = drain.depths(x, particles.scene.spacing)
    chosen = np.flatnonzero(np.isfinite(depth))
    if not len(chosen) or most <= 0:
        return 0
    ids = download(particles.world.particles.id)[: particles.count]
    if len(chosen) > most:
        order = np.lexsort((ids[chosen], depth[chosen]))
        chosen = chosen[order[:most]]
    return particles.remove(ids[chosen])


def suction_of(drain: Drain) -> Attract:
    """Return the suction of a drain as a force."""
    assert drain.center is not None
    assert drain.radius is not None
    return Attract(center=drain.center, radius=REACH * drain.radius, strength=drain.suction, drag=0.0)


def missing_particles(particles: ParticleSystem, source: Emitter | Drain, level: float) -> int:
    """Return how many particles are missing to a level [m]; negative where there are too many."""
    scene, gauge = particles.scene, source.gauge
    x = download(particles.world.particles.x)[: particles.count].astype(np.float64)
    if gauge is None:
        lower, upper = scene.tank.box() if scene.tank else (np.zeros(scene.dim), np.ones(scene.dim))
        gauge = Gauge.parse({"lower": lower.tolist(), "upper": upper.tolist()})
    up = scene.upward
    lack = (level - gauge.level(x, scene.spacing, up)) * gauge.base(up) / scene.spacing**scene.dim
    return math.floor(lack + 0.5)


def _named_sources(kind: str, sources: Sequence[Emitter | Drain]) -> list[Source]:
    return [Source(source.name or f"{kind} {number}") for number, source in enumerate(sources, 1)]


def _name(emitter: Emitter, number: int) -> str:
    return f"The emitter {emitter.name or number + 1!r}"
