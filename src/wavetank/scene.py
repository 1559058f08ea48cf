"""A scene: plain validated data that says what a world is made of, from Python or from a TOML file."""

import importlib.resources
import json
import math
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BeforeValidator, ValidationError, model_validator

from wavetank.errors import WavetankError
from wavetank.fluids import AnyFluid, Points
from wavetank.model import Model, Size, sentence
from wavetank.params import PRESETS, Parameters
from wavetank.solids import AnySolid, HalfSpace, Solid

MAX_PARTICLES = 100_000_000
_TOLERANCE = 1e-6  # of a spacing: how far a fluid may reach beyond a wall by rounding


class Tank(Model):
    """The container: its inner size [m], the lower corner at the origin. Two numbers make a 2-D world."""

    size: Size

    def walls(self) -> list[Solid]:
        """Return the walls as half-spaces, lower and upper for each axis."""
        result: list[Solid] = []
        for axis, (name, edge) in enumerate(zip("xyz", self.size, strict=False)):
            normal = tuple(float(k == axis) for k in range(len(self.size)))
            point = tuple(edge * n for n in normal)
            result.append(HalfSpace(name=f"tank {name} lower", point=tuple(0.0 for _ in normal), normal=normal))
            result.append(HalfSpace(name=f"tank {name} upper", point=point, normal=tuple(-n for n in normal)))
        return result


def _tagged(values: Any, default: str) -> Any:
    """Let a table without `shape` mean the usual one."""
    if not isinstance(values, list | tuple):
        return values
    return [{"shape": default, **v} if isinstance(v, dict) and "shape" not in v else v for v in values]


class Scene(Parameters):
    """A world as data. Lengths in metres, y up; parameters of `params.py` are keys of the scene itself."""

    title: str = ""
    preset: Literal["standard", "paper"] = "standard"
    tank: Tank | None = None
    fluids: Annotated[list[AnyFluid], BeforeValidator(lambda v: _tagged(v, "block"))] = []
    solids: Annotated[list[AnySolid], BeforeValidator(lambda v: _tagged(v, "box"))] = []

    @model_validator(mode="before")
    @classmethod
    def _from_preset(cls, values: Any) -> Any:
        if isinstance(values, dict) and isinstance(values.get("preset"), str):
            return {**PRESETS.get(values["preset"], {}), **values}
        return values

    @model_validator(mode="after")
    def _consistent(self) -> "Scene":
        if "gravity" not in self.model_fields_set:
            self.__dict__["gravity"] = self.gravity[: self._world_dim()]
        dim = self._world_dim()
        for name, vector in self._vectors():
            if len(vector) != dim:
                raise ValueError(
                    f"{name} = {tuple(vector)} has {len(vector)} components in a {dim}-D world; give {dim}."
                )
        self._check_count()
        self._check_inside()
        names = [solid.name for solid in self.solids if solid.name]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise ValueError(f"solids: the name {twice!r} is used twice; a name must be unique.")
        return self

    def assign(self, name: str, value: Any) -> None:
        """Set one key in place, validated; raise `WavetankError` and change nothing where it is not allowed."""
        before = dict(self.__dict__)
        try:
            setattr(self, name, value)
        except ValidationError as report:
            # A whole-scene check runs after the value is in place.
            self.__dict__.update(before)
            raise WavetankError(sentence(report, type(self))) from None

    def _world_dim(self) -> int:
        """Number of dimensions that the tank has, else the first fluid, else gravity."""
        if self.tank is not None:
            return len(self.tank.size)
        first = next((vector for fluid in self.fluids for _, vector in fluid.vectors()), None)
        return len(first if first is not None else self.gravity)

    def _vectors(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        yield "gravity", self.gravity
        for kind, members in (("fluids", self.fluids), ("solids", self.solids)):
            for number, member in enumerate(members):
                for name, vector in member.vectors():
                    yield f"{kind}[{number}].{name}", tuple(vector)

    def _check_count(self) -> None:
        count = sum(fluid.estimate(self.spacing) for fluid in self.fluids)
        if count > MAX_PARTICLES:
            raise ValueError(
                f"spacing = {self.spacing} makes {count:.3g} particles; "
                f"at most {MAX_PARTICLES:,} are allowed: use a larger spacing or less fluid."
            )
        if self.tank is not None and max(self.tank.size) / self.spacing > 1e6:
            raise ValueError(
                f"spacing = {self.spacing} divides the tank of {self.tank.size} m into more than 1e6 spacings; "
                "single precision cannot tell such particles apart: use a larger spacing."
            )

    def _check_inside(self) -> None:
        if self.tank is None:
            return
        slack = _TOLERANCE * self.spacing
        for number, fluid in enumerate(self.fluids):
            if isinstance(fluid, Points) and not len(fluid.positions):
                continue
            lower, upper = fluid.bounds()
            if np.any(lower < -slack) or np.any(upper > np.array(self.tank.size) + slack):
                raise ValueError(
                    f"fluids[{number}] reaches from {_numbers(lower)} to {_numbers(upper)}, outside the tank; "
                    f"it must lie between {_numbers(np.zeros(self.dim))} and {_numbers(self.tank.size)}."
                )

    def particles(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions [m] and velocities [m/s], float32 [n, dim], of the fluids outside of the solids.

        Where fluids overlap, the first one wins.
        """
        positions, velocities = [np.empty((0, self.dim))], [np.empty((0, self.dim))]
        for number, fluid in enumerate(self.fluids):
            x = fluid.particles(self.spacing)
            v = np.zeros_like(x) if fluid.velocity is None else np.tile(np.array(fluid.velocity, float), (len(x), 1))
            if isinstance(fluid, Points):
                v = v if fluid.velocities is None else fluid.velocities
            else:
                taken = np.zeros(len(x), bool)
                for other in self.fluids[:number]:
                    taken |= other.contains(x)
                x, v = x[~taken], v[~taken]
            positions.append(x)
            velocities.append(v)
        return np.concatenate(positions).astype(np.float32), np.concatenate(velocities).astype(np.float32)

    # --- files ---

    @classmethod
    def load(cls, name: str | Path) -> "Scene":
        """Read a bundled scene by name, or a TOML file by path."""
        text, origin = _read(name)
        try:
            table = tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise WavetankError(f"{origin}: this is not TOML: {error}.") from None
        return cls.parse(table, origin)

    def save(self, path: str | Path) -> None:
        """Write this scene as TOML; a file of that name is replaced in one move."""
        target = Path(path)
        partial = target.with_name(target.name + ".partial")
        partial.write_text(tomli_w.dumps(self.table()), encoding="utf-8")
        partial.replace(target)

    def table(self) -> dict[str, Any]:
        """Return what was set (not the defaults) as plain data that `parse` reads back to an equal scene."""
        result = _set_values(self) | {name: getattr(self, name) for name in PRESETS[self.preset]}
        return {key: result[key] for key in sorted(result, key=lambda k: isinstance(result[k], list | dict))}

    def changed(self, **values: Any) -> "Scene":
        """Return a copy with these keys changed, validated as a whole."""
        return type(self).parse({**self.table(), **values})

    def scaled(self, factor: float) -> "Scene":
        """Return the same scene with every length multiplied by `factor` (velocities and gravity stay)."""
        if not (math.isfinite(factor) and factor > 0):
            raise WavetankError(f"factor = {factor} is not allowed; it must be a positive number.")
        lengths = {"spacing", "size", "lower", "upper", "center", "radius", "start", "end", "point", "positions"}

        def walk(value: Any, key: str = "") -> Any:
            if isinstance(value, dict):
                return {k: walk(v, k) for k, v in value.items()}
            if isinstance(value, list | tuple):
                return [walk(v, key) for v in value]
            return value * factor if key in lengths and isinstance(value, int | float) else value

        return type(self).parse(walk(self.table()))


def _set_values(value: Any) -> Any:
    """Reduce a model to plain data: the keys that differ from their defaults, and the shape that names a kind."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [_set_values(member) for member in value]
    if not isinstance(value, Model):
        return value
    result = {}
    for name, field in type(value).model_fields.items():
        member = getattr(value, name)
        default = None if isinstance(member, np.ndarray) else field.default
        if name == "shape" or (member is not None and (isinstance(member, np.ndarray) or member != default)):
            result[name] = _set_values(member)
    return result


def bundled_scenes() -> list[str]:
    """Names of the scenes that come with the package, sorted."""
    folder = importlib.resources.files("wavetank") / "scenes"
    return sorted(entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml"))


def scene_schema() -> str:
    """JSON Schema of a scene file, for editors."""
    return json.dumps(Scene.model_json_schema(), indent=2)


def _read(name: str | Path) -> tuple[str, str]:
    if str(name) in (bundled := bundled_scenes()):
        return (importlib.resources.files("wavetank") / "scenes" / f"{name}.toml").read_text("utf-8"), str(name)
    path = Path(name)
    if not path.is_file():
        raise WavetankError(
            f"scene {str(name)!r} is neither a file nor a bundled scene; bundled are: {', '.join(bundled)}."
        )
    try:
        return path.read_text("utf-8"), str(path)
    except (OSError, UnicodeDecodeError) as error:
        raise WavetankError(f"{path}: the scene cannot be read: {error}.") from None


def _numbers(values: Any) -> str:
    return "(" + ", ".join(f"{float(v):g}" for v in values) + ")"
