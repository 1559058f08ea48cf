"""Emitters and drains at work, at the end of every frame: drains first, as what they took may come out again.

Each place in a mouth lets a particle out whenever the volume of a row has passed, neighbours by turns. Where it is at
the end of the frame follows from when it left: it has flown freely since. Flow is right to a particle, whatever the
frames are. What finds no room, because water stands in the mouth, is owed and comes as soon as there is.
`jets.py` has what leaves a mouth.
"""

import dataclasses
import math
from typing import Any, Protocol

import numpy as np

from wavetank.device.compiler import download
from wavetank.foundation.errors import WavetankError
from wavetank.physics.world import World
from wavetank.scene.drains import Drain
from wavetank.scene.emitters import Emitter
from wavetank.scene.forces import Attract, Force
from wavetank.scene.gauges import Gauge
from wavetank.scene.scene import Scene
from wavetank.simulation.jets import flown, jet_of, particles_due, row

GAP = 0.8  # d: room that new particles have from others
PRESSED = 0.45  # d: the same for those that water under pressure has kept waiting, more than a row
PATIENCE = 0.5  # s: flow of so long is owed at most; the rest is given up, and said
MOST_DUE = 5_000_000  # particles of an emitter in a frame
SPARSE = 50.0  # d: a mouth whose particles come farther apart is refused
REACH = 4.0  # radii: how far the suction of a drain is felt


class Water(Protocol):
    """What sources need of a running world; `Simulation` has it."""

    scene: Scene
    world: World
    notes: list[str]
    time_steps: int

    @property
    def count(self) -> int:
        """Number of particles."""

    def add(self, positions: Any, velocities: Any = None, dyes: Any = None, materials: Any = None) -> np.ndarray:
        """Add particles; return their ids."""

    def remove(self, ids: Any) -> int:
        """Remove the particles with these ids; return how many there were."""

    def remove_inside(self, start: np.ndarray, end: np.ndarray, radius: float) -> int:
        """Remove the particles within `radius` [m] of a segment; return how many."""

    def free_places(self, places: np.ndarray, gap: float, wall: float) -> np.ndarray:
        """Say which places keep these distances [m] to particles and solids."""


@dataclasses.dataclass
class Source:
    """What is known of one emitter or drain besides the scene."""

    phase: float = 0.0  # of a row, or particles of a drain
    owed: int = 0  # particles that found no room yet
    total: int = 0  # particles that came, or went
    withheld: int = 0  # particles that were given up
    flows: bool = False  # whether an emitter lets water out
    store: int = 0  # particles that a drain took and no emitter has let out again


def rows_due(way: float, more: float, pitch: float) -> tuple[np.ndarray, float]:
    """Return how far [m] each of the rows is that leave while the jet goes `more` [m], and how far the next one is.

    `way` is what this returned last.
    """
    way += more
    rows = int(way / pitch)
    way -= rows * pitch
    return way + pitch * np.arange(rows), way


class Sources:
    """The emitters and drains of a world."""

    def __init__(self, scene: Scene) -> None:
        self.emitters = [Source() for _ in scene.emitters]
        self.drains = [Source() for _ in scene.drains]
        self.said: set[str] = set()  # notes that were given

    def __bool__(self) -> bool:
        return bool(self.emitters or self.drains)

    def forces(self, scene: Scene, time: float, duration: float) -> list[Force]:
        """Return what drains pull and jets push with in a frame that begins at `time` [s]."""
        begin, found = time + scene.start_time, list[Force]()
        clock = begin + 0.5 * duration
        for drain in (drain.at(clock) for drain in scene.drains):
            if drain.suction and acts(drain, begin, duration):
                found.append(suction_of(drain))
        for emitter, source in zip(scene.emitters, self.emitters, strict=True):
            if source.flows and emitter.mesh is None and acts(emitter, begin, duration):
                found.append(jet_of(scene, emitter.at(clock), clock))
        return found

    def act(self, sim: Water, time: float, duration: float) -> None:
        """Let water go and come, at the end of a frame of `duration` [s] that began at `time` [s]."""
        begin = time + sim.scene.start_time
        for number, source in enumerate(self.drains):
            self._drain(sim, sim.scene.drains[number], source, begin, begin + duration)
        for number, source in enumerate(self.emitters):
            self._emit(sim, number, source, begin, begin + duration)

    def figures(self) -> dict[str, int]:
        """Return how many particles came, went and found no room, for `Simulation.stats`."""
        return {
            "emitted": sum(source.total for source in self.emitters),
            "drained": sum(source.total for source in self.drains),
            "withheld": sum(source.withheld for source in self.emitters),
        }

    def plain(self) -> dict[str, Any]:
        """Return what a file holds of this."""
        return {
            "emitters": [dataclasses.asdict(source) for source in self.emitters],
            "drains": [dataclasses.asdict(source) for source in self.drains],
        }

    def read(self, plain: dict[str, Any]) -> None:
        """Take what `plain` wrote; what is missing begins anew."""
        for name in ("emitters", "drains"):
            for source, numbers in zip(getattr(self, name), plain.get(name, []), strict=False):
                source.__dict__.update(numbers)

    # --- drains ---

    def _drain(self, sim: Water, drain: Drain, source: Source, begin: float, end: float) -> None:
        drain = drain.at(0.5 * (begin + end))
        first, last = span(drain, begin, end)
        if last <= first or not sim.count:
            return
        scene, most = sim.scene, sim.count
        if drain.flow is not None:
            unit = 1.0 if scene.dim == 2 else 1e-3
            source.phase += drain.flow * unit * (last - first) / scene.spacing**scene.dim
            most = int(source.phase)
        if drain.level is not None:
            most = min(most, max(0, -missing(sim, drain, drain.level)))
        taken = take(sim, drain, most) if most else 0
        source.total += taken
        source.store += taken
        if drain.flow is not None:  # what was not there to be taken is not made up for
            source.phase = min(source.phase - taken, 1.0)

    # --- emitters ---

    def _emit(self, sim: Water, number: int, source: Source, begin: float, end: float) -> None:
        emitter = sim.scene.emitters[number]
        first, last = span(emitter, begin, end)
        if last <= first:
            return
        scene, spacing = sim.scene, sim.scene.spacing
        now = emitter.at(0.5 * (first + last))
        mouth = now.mouth(spacing)
        volume = len(mouth) * spacing**scene.dim
        rows = now.rate(mouth) * (last - first) / volume
        source.flows = rows > 0.0
        if not source.flows:
            return
        if rows * len(mouth) > MOST_DUE:
            raise WavetankError(
                f"emitters[{number}] lets out {rows * len(mouth):,.3g} particles in a frame; at most {MOST_DUE:,} are "
                "allowed: lower its speed or flow, or make the spacing larger."
            )
        due, source.phase = particles_due(mouth, source.phase, rows)
        keep = self._allowed(sim, now, len(due.place), source)
        if keep < len(due.place):
            due, source.owed, source.flows = due.first(keep), 0, keep > 0
        x, v = flown(scene, emitter, mouth, due.aged(end - last, (last - first) / rows), end, _step(sim))
        patience = max(len(mouth), math.ceil(now.rate(mouth) * PATIENCE / spacing**scene.dim))
        gap = PRESSED if source.owed > len(mouth) else GAP
        came = self._put(sim, now, x, v, gap) if len(x) else 0
        source.owed += len(x) - came
        if source.owed:  # in the mouth, wherever there is room by now
            x, v = flown(scene, emitter, mouth, row(mouth), end, _step(sim))
            late = self._put(sim, now, x, v, gap, source.owed)
            source.owed -= late
            came += late
        if source.owed > patience:
            source.withheld += source.owed - patience
            source.owed = patience
            self._say(sim, f"{_name(emitter, number)} is blocked by water or a solid: less comes out than it should.")
        source.total += came
        if emitter.feed:
            self._fed(scene, emitter).store -= came

    def _allowed(self, sim: Water, emitter: Emitter, due: int, source: Source) -> int:
        """Return how many of the particles that are due may come, by what feeds them, the level and the room."""
        allowed = due
        if emitter.feed:
            allowed = min(allowed, self._fed(sim.scene, emitter).store - source.owed)
        if emitter.level is not None and due:
            allowed = min(allowed, missing(sim, emitter, emitter.level))
        most = sim.scene.most_particles
        if most is not None and sim.scene.when_full == "stop" and sim.count + allowed > most:
            fit = max(0, most - sim.count)
            source.withheld += allowed - fit
            allowed = fit
            self._say(sim, f"There are {sim.count:,} particles and most_particles = {most:,}: emitters wait for room.")
        return max(0, allowed)

    def _put(
        self, sim: Water, emitter: Emitter, x: np.ndarray, v: np.ndarray, gap: float, most: int | None = None
    ) -> int:
        """Add the particles that have room, at most so many, and return how many; the world's oldest may go for it."""
        scene = sim.scene
        free = np.flatnonzero(sim.free_places(x, gap * scene.spacing, scene.wall_gap * scene.spacing))[:most]
        if not len(free):
            return 0
        full = 0 if scene.most_particles is None else sim.count + len(free) - scene.most_particles
        if full > 0 and scene.when_full == "recycle":
            ids = download(sim.world.particles.id)[: sim.count]
            sim.remove(np.sort(ids)[:full])
        names = [None, *(material.name for material in scene.materials)]
        kinds = np.full(len(free), names.index(emitter.material), np.int32)
        sim.add(x[free], v[free], np.full(len(free), emitter.dye_number, np.int32), kinds)
        return len(free)

    def _fed(self, scene: Scene, emitter: Emitter) -> Source:
        return self.drains[[drain.name for drain in scene.drains].index(emitter.feed)]

    def _say(self, sim: Water, sentence: str) -> None:
        if sentence.split(":")[-1] not in self.said:
            self.said.add(sentence.split(":")[-1])
            sim.notes.append(sentence)


def check_places(sim: Water) -> None:
    """Raise `WavetankError` where an emitter begins inside of a solid or outside of the tank."""
    scene = sim.scene
    for number, emitter in enumerate(scene.emitters):
        now = emitter.at(scene.start_time)
        mouth = now.mouth(scene.spacing)
        x, _ = flown(scene, emitter, mouth, row(mouth), scene.start_time, _step(sim))
        if mouth.pitch > SPARSE * scene.spacing:
            raise WavetankError(
                f"emitters[{number}] has a mouth so small that its particles are {mouth.pitch:.3g} m apart; make it "
                f"larger, not much less than spacing = {scene.spacing:g} m, or the spacing smaller."
            )
        lower, upper = scene.tank.box() if scene.tank else (-np.inf, np.inf)
        x = scene.tank.within(x) if scene.tank else x
        inside = np.all((x >= lower) & (x <= upper), axis=1)
        if not (sim.free_places(x, 0.0, scene.wall_gap * scene.spacing) & inside).any():
            raise WavetankError(
                f"emitters[{number}] is inside of a solid or outside of the tank, and nothing can come out; move its "
                "position to where there is room, or turn its direction."
            )


def acts(source: Emitter | Drain, begin: float, duration: float) -> bool:
    """Say whether an emitter or a drain acts in a frame that begins when the scene's clock shows `begin` [s]."""
    first, last = span(source, begin, begin + duration)
    return last > first


def span(source: Emitter | Drain, begin: float, end: float) -> tuple[float, float]:
    """Return the part of the time from `begin` to `end` [s] in which this acts; of no length where it does not."""
    stop = math.inf if source.duration is None else source.start + source.duration
    first = min(max(begin, source.start), end)
    return first, max(first, min(end, stop))


def take(sim: Water, drain: Drain, most: int | None = None) -> int:
    """Remove the particles that a drain takes, at most so many, and return how many."""
    if drain.shape == "sphere" and (most is None or most >= sim.count):
        assert drain.center is not None
        assert drain.radius is not None
        center = np.array([*drain.center, 0.0][:3], float)
        return sim.remove_inside(center, center, drain.radius)
    most = sim.count if most is None else most
    x = download(sim.world.particles.x)[: sim.count].astype(np.float64)
    middle = drain.middle()
    if sim.scene.tank and middle is not None:
        x = sim.scene.tank.beside(x, middle)
    depth = drain.depths(x, sim.scene.spacing)
    chosen = np.flatnonzero(np.isfinite(depth))
    if not len(chosen) or most <= 0:
        return 0
    ids = download(sim.world.particles.id)[: sim.count]
    if len(chosen) > most:
        order = np.lexsort((ids[chosen], depth[chosen]))
        chosen = chosen[order[:most]]
    return sim.remove(ids[chosen])


def suction_of(drain: Drain) -> Attract:
    """Return the pull of a drain."""
    assert drain.center is not None
    assert drain.radius is not None
    return Attract(center=drain.center, radius=REACH * drain.radius, strength=drain.suction, drag=0.0)


def missing(sim: Water, source: Emitter | Drain, level: float) -> int:
    """Return how many particles are missing to the level [m]; what is too much is negative."""
    scene, gauge = sim.scene, source.gauge
    x = download(sim.world.particles.x)[: sim.count].astype(np.float64)
    if gauge is None:
        lower, upper = scene.tank.box() if scene.tank else (np.zeros(scene.dim), np.ones(scene.dim))
        gauge = Gauge.parse({"lower": lower.tolist(), "upper": upper.tolist()})
    lack = (level - gauge.level(x, scene.spacing)) * gauge.base() / scene.spacing**scene.dim
    return math.floor(lack + 0.5)


def _step(sim: Water) -> float:
    """Return the length of a time step [s], as far as the last frame tells."""
    return sim.scene.frame_time / max(sim.time_steps, 1)


def _name(emitter: Emitter, number: int) -> str:
    return f"The emitter {emitter.name or number + 1!r}"
