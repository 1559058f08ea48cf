"""A scene: plain validated data that describes a world, from Python or from a TOML file."""

import dataclasses
import difflib
import functools
import importlib.resources
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BeforeValidator, model_validator

from wavetank.foundation.arguments import array_of, brief, finite, path_of
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, parse_toml, printable, read_text
from wavetank.foundation.materials import COLORS, Material, Properties
from wavetank.foundation.model import Model, is_length
from wavetank.foundation.params import PRESETS, QUALITIES, Parameters
from wavetank.foundation.tracks import scaled
from wavetank.scene.bounds import check_bodies, check_numbers, check_periodic, check_scales
from wavetank.scene.filled import AnyFluid, Filled
from wavetank.scene.film import Film
from wavetank.scene.fluids import Earlier, Points, boxes_of
from wavetank.scene.forces import AnyForce
from wavetank.scene.goal import Goal
from wavetank.scene.joints import AnyJoint, check_joints
from wavetank.scene.lattice import covered
from wavetank.scene.light import Light
from wavetank.scene.probes import Probe, check_probes
from wavetank.scene.schedule import Timetable
from wavetank.scene.summary import summary
from wavetank.scene.tank import Tank
from wavetank.scene.upward import TURNS, Up, upward_of
from wavetank.solids.shapes import AnySolid

MAX_PARTICLES = 100_000_000
_TOLERANCE = 1e-6  # of a spacing: how far a fluid may reach beyond a wall by rounding


def _tagged(values: Any, default: str) -> Any:
    """Give tables without `shape` the default one."""
    if not isinstance(values, list | tuple):
        return values
    return [{"shape": default, **v} if isinstance(v, dict) and "shape" not in v else v for v in values]


@dataclasses.dataclass(frozen=True)
class Lattice:
    """The particles of a scene's fluids."""

    positions: np.ndarray  # m, float32 [n, dim]
    velocities: np.ndarray  # m/s, float32 [n, dim]
    kinds: np.ndarray  # number of the material, int32 [n]
    has_own_place: np.ndarray  # whether it is placed one by one, as those of `Points`, bool [n]


class Scene(Timetable, Parameters):
    """A world as data. Lengths in metres, up against gravity; those of `params.py` are keys of the scene itself."""

    title: str = ""
    preset: Literal["standard", "paper"] = "standard"
    quality: Literal["draft", "standard", "high"] = "standard"
    up: Up | None = None  # in levels, pictures, tools and files; the axis against the first gravity where None
    tank: Tank | None = None
    fluids: Annotated[list[AnyFluid], BeforeValidator(lambda v: _tagged(v, "block"))] = []
    materials: list[Material] = []
    solids: Annotated[list[AnySolid], BeforeValidator(lambda v: _tagged(v, "box"))] = []
    joints: list[AnyJoint] = []
    forces: list[AnyForce] = []
    probes: list[Probe] = []
    goal: Goal | None = None
    light: Light | None = None
    film: Film | None = None

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, values: Any) -> Any:
        if not isinstance(values, dict):
            return values
        check_numbers(values)
        chosen = {name: value for name, value in _chosen(values).items() if name not in values}
        return cls.spread_gravity({**values, **chosen})  # given keys keep their order, which digests see

    @model_validator(mode="after")
    def _consistent(self) -> "Scene":
        if "gravity" not in self.model_fields_set:
            self.__dict__["gravity"] = self.gravity[: self._world_dim()]
        dim = self._world_dim()
        for number, solid in enumerate(self.solids):
            solid.stand(self.upright)
            if dim == 2 and solid.is_spatial:
                raise ValueError(f"solids[{number}] is (or has) a mesh, and a mesh needs a 3-D world; this one is 2-D.")
        for name, vector in self._vectors():
            if len(vector) != dim:
                raise ValueError(
                    f"{name} = {tuple(vector)} has {len(vector)} components in a {dim}-D world; give {dim}."
                )
        if dim == 2 and self.up in ("z", "-z"):
            raise ValueError(f"up = {self.up!r} is not an axis of a 2-D world; use x, y, -x or -y.")
        check_scales(self.spacing, self.gravity)
        check_periodic(self.tank, self.spacing, self.support, self.gravity, self.solids)
        self._check_count()
        self._check_inside()
        self._check_names()
        self._check_probes()
        self.check_sources()
        return self

    def __repr__(self) -> str:
        return summary(self)

    __str__ = __repr__

    def _world_dim(self) -> int:
        """Number of dimensions that the tank has, else the first fluid, else gravity."""
        if self.tank is not None:
            return len(self.tank.size)
        first = next((vector for fluid in self.fluids for _, vector in fluid.vectors()), None)
        return len(first if first is not None else self.gravity)

    @property
    def upward(self) -> str:
        """The axis that points up: "x", "y", "z", "-x", "-y" or "-z"."""
        return self.up or upward_of(self.gravity, self.tank.periodic_axes if self.tank else [])

    @property
    def upright(self) -> np.ndarray:
        """Rotation matrix [3, 3] that turns this world so that y is up."""
        return TURNS[self.upward]

    def _vectors(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        yield "gravity", self.gravity
        for kind in ("fluids", "solids", "joints", "forces", "emitters", "drains", "probes"):
            for number, member in enumerate(getattr(self, kind)):
                motion = getattr(member, "motion", None)
                moving = [(f"motion.{name}", vector) for name, vector in motion.vectors()] if motion else []
                for name, vector in [*member.vectors(), *moving]:
                    yield f"{kind}[{number}].{name}", tuple(vector)
        for name, vector in self.goal.vectors() if self.goal else ():
            yield f"goal.{name}", tuple(vector)

    def _check_count(self) -> None:
        count = sum(fluid.estimate(self.spacing) for fluid in self.fluids)
        if count > MAX_PARTICLES:
            raise ValueError(
                f"spacing = {self.spacing} makes {count:.3g} particles; "
                f"at most {MAX_PARTICLES:,} are allowed: use a larger spacing or less fluid."
            )
        if self.tank is not None and np.abs(self.tank.box()).max() / self.spacing > 1e6:
            raise ValueError(
                f"spacing = {self.spacing} divides the tank of {self.tank.size} m, or its way from the origin, into "
                "more than 1e6 spacings; single precision cannot tell such particles apart: use a larger spacing."
            )

    def _check_inside(self) -> None:
        if self.tank is None:
            return
        slack, (first, last) = _TOLERANCE * self.spacing, self.tank.box()
        for number, fluid in enumerate(self.fluids):
            if isinstance(fluid, Filled) or (isinstance(fluid, Points) and not len(fluid.positions)):
                continue  # checked when their shape is measured
            lower, upper = fluid.bounds()
            if np.any(lower < first - slack) or np.any(upper > last + slack):
                where = f"fluids[{number}] reaches from {_numbers(lower)} to {_numbers(upper)}, outside the tank; "
                raise ValueError(f"{where}it must lie between {_numbers(first)} and {_numbers(last)}.")

    def _check_names(self) -> None:
        for kind in ("solids", "joints", "materials", "emitters", "drains", "probes"):
            names = [member.name for member in getattr(self, kind) if member.name]
            twice = next((name for name in names if names.count(name) > 1), None)
            if twice is not None:
                raise ValueError(f"{kind}: the name {twice!r} is used twice; a name must be unique.")
        check_bodies(self.solids, self.tank, self.goal)
        check_joints(self.joints, {solid.name: solid.is_body for solid in self.solids if solid.name})
        if any(not material.name for material in self.materials):
            raise ValueError("materials: every material needs a name, so that a fluid can ask for it.")
        known = [material.name for material in self.materials]
        askers = [(f"fluids[{number}]", fluid.material) for number, fluid in enumerate(self.fluids)]
        askers += [(f"emitters[{number}]", emitter.material) for number, emitter in enumerate(self.emitters)]
        askers += [
            (f"goal.aims[{k}]", aim.material or None) for k, aim in enumerate(self.goal.aims if self.goal else [])
        ]
        for where, material in askers:
            if material is not None and material not in known:
                raise ValueError(
                    f"{where}.material = {material!r} is not one of the scene's materials; "
                    f"they are: {', '.join(known) or 'none; add one under [[materials]]'}."
                )

    def _check_probes(self) -> None:
        named = {solid.name: solid for solid in self.solids if solid.name}
        walls = [wall.name for wall in self.tank.walls()] if self.tank else []
        check_probes(self.probes, named, walls, has_grid=self.tank is not None and self.grid_pressure > 0.0)

    def palette(self) -> list[Material]:
        """Return the materials by their numbers: 0 is the scene's own fluid, then `materials` in their order.

        Every one has a colour.
        """
        own = Material(name="fluid")
        return [
            material if material.color else material.model_copy(update={"color": COLORS[number % len(COLORS)]})
            for number, material in enumerate([own, *self.materials])
        ]

    def properties(self) -> list[Properties]:
        """Return the properties of the materials by their numbers."""
        return [material.properties(self) for material in self.palette()]

    def materials_of(self, kinds: np.ndarray) -> dict[int, Material]:
        """Return the materials with these numbers."""
        palette = self.palette()
        return {number: palette[number] for number in np.unique(kinds).tolist()}

    def first_kind(self) -> int:
        """Return the number of the material of the first fluid; 0 without any."""
        first = self.fluids[0].material if self.fluids else None
        return 0 if first is None else 1 + [material.name for material in self.materials].index(first)

    def checked_kinds(self, numbers: Any, count: int, default: int) -> np.ndarray:
        """Return the numbers of the materials of `count` particles, int32; all are `default` for None.

        Raises `WavetankError` for numbers that are not in the palette.
        """
        if numbers is None:
            return np.full(count, default, np.int32)
        kind = array_of("materials", numbers, np.int32, f"[{count}]")
        if kind.shape != (count,) or not np.isin(kind, np.arange(len(self.materials) + 1)).all():
            raise WavetankError(
                f"materials must be {count} numbers, from 0 for the scene's own fluid to {len(self.materials)}."
            )
        return kind

    def kinds(self) -> np.ndarray:
        """Return the number of the material of each particle, int32 [n], in the order of `particles`."""
        return self.lattice().kinds

    def particles(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions [m] and velocities [m/s], float32 [n, dim], of `lattice`."""
        lattice = self.lattice()
        return lattice.positions, lattice.velocities

    def lattice(self) -> "Lattice":
        """Return the particles of the fluids; a simulation leaves out those in solids.

        Where fluids overlap, the first one wins.
        """
        numbers = {None: 0} | {material.name: k for k, material in enumerate(self.materials, 1)}
        boxes, earlier = boxes_of(self.fluids, self.solids, self.dim), Earlier(self.dim)
        positions, velocities = [np.empty((0, self.dim))], [np.empty((0, self.dim))]
        points: list[np.ndarray] = []  # of those that are given one by one
        kinds, placed = [np.empty(0, np.int32)], [np.empty(0, bool)]
        for fluid in self.fluids:
            x = fluid.placed(self.spacing, self.tank, boxes)
            x = x.reshape(-1, self.dim)  # an empty array has no width of its own
            v = np.zeros_like(x) if fluid.velocity is None else np.tile(np.array(fluid.velocity, float), (len(x), 1))
            if isinstance(fluid, Points):
                v = v if fluid.velocities is None else fluid.velocities.reshape(x.shape)
            free = ~earlier.contain(x)
            for other in points if not isinstance(fluid, Points) else []:
                free &= ~covered(x, other, self.spacing)
            x, v = x[free], v[free]
            if isinstance(fluid, Points):
                points.append(x)
            else:
                earlier.append(fluid)
            positions.append(x)
            velocities.append(v)
            kinds.append(np.full(len(x), numbers[fluid.material], np.int32))
            placed.append(np.full(len(x), isinstance(fluid, Points | Filled)))
        x, v = np.concatenate(positions), np.concatenate(velocities)
        if not len(x) and any(not isinstance(fluid, Points) for fluid in self.fluids):
            raise WavetankError(
                f"the fluids of this scene hold no particle at spacing = {self.spacing:g} m; use a smaller spacing or "
                "larger fluids."
            )
        return Lattice(x.astype(np.float32), v.astype(np.float32), np.concatenate(kinds), np.concatenate(placed))

    # --- files ---

    @staticmethod
    def checked(scene: Any) -> "Scene":
        """Return `scene` as it is now, checked as one that is made; raises `WavetankError` for anything else.

        Its lists, and what is in them, may have changed since it was made.
        """
        if not isinstance(scene, Scene):
            raise WavetankError(f"{scene!r} is not a Scene; use wt.Scene.load(name) for a bundled one or a TOML file.")
        known = type(scene).model_fields
        fields = {
            name: value
            for name, value in scene.__dict__.items()
            if name in scene.model_fields_set or value != known[name].default
        }
        checked: Scene = type(scene).parse(fields)
        return checked

    @classmethod
    def load(cls, name: str | Path) -> "Scene":
        """Read a bundled scene by name, or a TOML file by path."""
        text, origin, folder = _read(name)
        return cls.from_text(text, origin, folder=folder)

    @classmethod
    def from_text(cls, text: str, origin: str = "scene", **context: Any) -> "Scene":
        """Read the text of a TOML file; errors begin with `origin`; `context` as in `parse`."""
        with explain_errors(origin, "scene"):
            scene: Scene = cls.parse(parse_toml(text, origin), origin, **context)
        return scene

    def save(self, path: str | Path) -> None:
        """Write this scene as TOML; a file of that name is replaced in one move."""
        with atomic_write(path) as partial:
            partial.write_text(self.text(), encoding="utf-8")

    def text(self) -> str:
        """Return this scene as TOML."""
        return tomli_w.dumps(Scene.checked(self).table())

    def table(self) -> dict[str, Any]:
        """Return what was set (not the defaults) as plain data that `parse` reads back to an equal scene."""
        return self._table(1.0)

    def _table(self, scale: float) -> dict[str, Any]:
        """Return `table` with every length multiplied by `scale`."""
        result = _set_values(self, scale) | {name: getattr(self, name) for name in _chosen(self.__dict__)}
        if "gravity_track" in result:
            result["gravity"] = result.pop("gravity_track")
        return {key: result[key] for key in sorted(result, key=lambda k: isinstance(result[k], list | dict))}

    def changed(self, **values: Any) -> "Scene":
        """Return a copy with these keys changed, validated as a whole; a new preset or quality replaces the old.

        A key may lead into tables and lists, by numbers or names: "tank.size", "solids[0].size", "solids[gate].size".
        """
        table = self.table()
        if values.keys() & {"preset", "quality"}:
            table = {k: v for k, v in table.items() if (k, v) not in _chosen(self.__dict__).items()}
        for key, value in values.items():
            _put(table, key, value)
        return type(self).parse(table)

    def scaled(self, factor: float) -> "Scene":
        """Return the same scene with every length multiplied by `factor` (velocities and gravity stay)."""
        if finite("factor", factor, 0.0) == 0.0:
            raise WavetankError("factor = 0 is not allowed; it must be a positive number.")
        return type(self).parse(self._table(factor))


def _put(table: dict[str, Any], key: str, value: Any) -> None:
    """Set what a key leads to in plain data, as in "tank.size" and "solids[0].size"; raises `WavetankError`."""
    if not re.fullmatch(r"\w+(\.\w+|\[[^][]+\])+", key):
        table[key] = value
        return
    *path, last = re.findall(r"[^][.]+", key)
    place: Any = table
    for part in path:
        place = place.setdefault(part, {}) if isinstance(place, dict) else place[_number_of(part, place, key)]
        if not isinstance(place, dict | list):
            raise WavetankError(f"{key}: {part} = {brief(place)} has no keys.")
    place[last if isinstance(place, dict) else _number_of(last, place, key)] = value


def _number_of(part: str, members: list[Any], key: str) -> int:
    """Return which of `members` is meant by a number or a name."""
    names = [member.get("name", "") if isinstance(member, dict) else "" for member in members]
    number = names.index(part) if part in names else int(part) if part.isdecimal() else len(members)
    if number >= len(members):
        named = ", ".join(filter(None, names))
        raise WavetankError(
            f"{key}: there is no [{part}]; there are {len(members)}, from [0] on"
            + (f", named {named}." if named else ".")
        )
    return number


def with_particles(scene: Scene, wanted: int) -> Scene:
    """Return the scene with a spacing that makes about `wanted` particles; one without fluid as it is."""
    count = sum(fluid.estimate(scene.spacing) for fluid in scene.fluids)
    if not count:
        return scene
    return scene.changed(spacing=float(f"{scene.spacing * (count / wanted) ** (1.0 / scene.dim):.3g}"))


def _chosen(values: dict[str, Any]) -> dict[str, Any]:
    """Return the parameters that the preset and the quality among `values` stand for."""
    preset, quality = values.get("preset", "standard"), values.get("quality", "standard")
    known = isinstance(preset, str) and isinstance(quality, str)
    return {**PRESETS.get(preset, {}), **QUALITIES.get(quality, {})} if known else {}


def _set_values(value: Any, scale: float = 1.0) -> Any:
    """Reduce a model to plain data: the keys that differ from their defaults, and the shape that names a kind.

    Lengths are multiplied by `scale`.
    """
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_set_values(member, scale) for member in value]
    if not isinstance(value, Model):
        return value
    result = {}
    for name, field in type(value).model_fields.items():
        member = getattr(value, name)
        default = None if isinstance(member, np.ndarray) else field.default
        if name in ("shape", "kind") or (member is not None and (isinstance(member, np.ndarray) or member != default)):
            plain = _set_values(member, scale)
            result[name] = scaled(plain, scale) if scale != 1.0 and is_length(field) else plain
    # What changes with time is written where it was given.
    for name, plain in result.pop("over_time", {}).items():
        result[name] = scaled(plain, scale) if scale != 1.0 and is_length(type(value).model_fields[name]) else plain
    if scale != 1.0 and "flow" in result:
        result["flow"] = scaled(result["flow"], scale**value.flow_power)  # type: ignore[attr-defined]
    return result


def bundled_scenes() -> list[str]:
    """Names of the scenes that come with the package, sorted; levels not among them."""
    return _names("scenes")


@functools.cache
def bundled_levels() -> tuple[str, ...]:
    """Names of the levels that come with the package, in the order in which they are played."""
    goals = {name: Scene.load(name).goal for name in _names("levels")}
    return tuple(sorted(goals, key=lambda name: (goal.number if (goal := goals[name]) else 0, name)))


def _names(folder: str) -> list[str]:
    entries = (importlib.resources.files("wavetank.scene") / folder).iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in entries if entry.name.endswith(".toml"))


def scene_schema() -> str:
    """JSON Schema of a scene file, for editors."""
    return json.dumps(Scene.model_json_schema(), indent=2)


def _read(name: str | Path) -> tuple[str, str, Path]:
    """Return the text of a scene, its name and the folder of its files."""
    for folder in ("scenes", "levels"):
        if str(name) in _names(folder):
            file = importlib.resources.files("wavetank.scene") / folder / f"{name}.toml"
            return file.read_text("utf-8"), str(name), Path()
    path = Path(path_of(name, "scene"))
    if not _is_there(path):
        near = difflib.get_close_matches(str(name)[:100], [*_names("scenes"), *_names("levels")], 1)
        raise WavetankError(
            f"there is no file {printable(name)!r}, and no bundled scene of that name; "
            + (f"did you mean {near[0]!r}? B" if near else "b")
            + f"undled are: {', '.join(_names('scenes'))}; levels: {', '.join(_names('levels'))}."
        )
    return read_text(path, "scene"), printable(path), path.parent


def _is_there(path: Path) -> bool:
    try:
        return path.exists() or path.is_symlink()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{float(v):g}" for v in values) + ")"
