"""Validated plain data: pydantic models whose errors are one sentence that a user can act on."""

import difflib
import functools
import math
from typing import Annotated, Any, cast

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic._internal._model_construction import ModelMetaclass
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails, PydanticCustomError

from wavetank.foundation.errors import WavetankError

FARTHEST = 1e9  # of a number that has no other bound: the square of more overflows in single precision
Number = Annotated[float, Field(ge=-FARTHEST, le=FARTHEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, le=FARTHEST, allow_inf_nan=False)]
Vector = tuple[Number, Number] | tuple[Number, Number, Number]
Size = tuple[Positive, Positive] | tuple[Positive, Positive, Positive]
Quaternion = tuple[Number, Number, Number, Number]

MOST_COMPARED = 200  # errors of a table
LIST = "a list of numbers, as [0, -9.81, 0]"
METRES = "m"  # marks the fields of a scene that are lengths: `Scene.scaled` multiplies these and nothing else
Length = Annotated[Positive, METRES]
Place = Annotated[Vector, METRES]
Edges = Annotated[Size, METRES]


class _OneSentence(ModelMetaclass):
    """Turns pydantic's report into one `WavetankError` when a user calls a model's constructor."""

    def __call__(
        cls,  # noqa: N805
        *args: Any,
        **kwargs: Any,
    ) -> Any:
        if args:
            fields = cast(type[BaseModel], cls).model_fields
            given = ", ".join(f"{name}=..." for name in [n for n in fields if n not in ("shape", "kind")][: len(args)])
            raise WavetankError(f"{cls.__name__} takes its values by name, as in {cls.__name__}({given}, ...).")
        try:
            return super().__call__(**kwargs)
        except ValidationError as report:
            raise WavetankError(sentence(report, cast(type[BaseModel], cls))) from None


class Model(BaseModel, metaclass=_OneSentence):
    """Validated data: unknown keys are refused, assignments checked, booleans not accepted as numbers."""

    model_config = ConfigDict(extra="forbid", validate_assignment=True, arbitrary_types_allowed=True)

    @model_validator(mode="before")
    @classmethod
    def _refuse_booleans_for_numbers(cls, table: Any) -> Any:
        for name, value in table.items() if isinstance(table, dict) else ():
            refused = _boolean_for_number(cls, name, value)
            if refused:
                raise refused
        return table

    def __setattr__(self, name: str, value: Any) -> None:
        """Set a field to what is valid; raise `WavetankError` and change nothing where it is not."""
        before = dict(self.__dict__)
        try:
            refused = _boolean_for_number(type(self), name, value)
            if refused:
                details = InitErrorDetails(type=refused, loc=(), input=value)
                raise ValidationError.from_exception_data(type(self).__name__, [details])
            super().__setattr__(name, value)
        except ValidationError as report:
            self.__dict__.update(before)  # a check of the whole runs after the value is in place
            raise WavetankError(sentence(report, type(self))) from None

    @classmethod
    def parse(cls, table: dict[str, Any], origin: str = "", **context: Any) -> Any:
        """Validate `table` as this model; raise `WavetankError` naming `origin`, the key and what is allowed.

        `context` tells where files are that the table names: `folder`, and `files` = False where none may be opened.
        """
        try:
            return cls.model_validate(table, context=context)
        except ValidationError as report:
            raise WavetankError((f"{origin}: " if origin else "") + sentence(report, cls)) from None


def _boolean_in(value: Any) -> str:
    """Return "is" for a boolean, "among" for a list or array that contains one, an empty text for all else."""
    if isinstance(value, bool | np.bool_):
        return "is"
    if isinstance(value, np.ndarray):
        return "among" if value.dtype == bool else ""
    return "among" if isinstance(value, list | tuple) and any(map(_boolean_in, value)) else ""


@functools.cache
def _numbers(model: type[BaseModel], name: str) -> str:
    """Return "a number" or "a whole number" for a field of numbers only, an empty text for all others."""
    field = model.model_fields.get(name)
    kinds = _types(field.annotation) if field else []
    if bool in kinds or Any in kinds:
        return ""
    return "a number" if float in kinds else "a whole number" if int in kinds else ""


def _boolean_for_number(model: type[BaseModel], name: str, value: Any) -> PydanticCustomError | None:
    """Return the error for a boolean in a field of numbers, which pydantic would accept as 1 or 0; else None."""
    found = _boolean_in(value)
    allowed = _numbers(model, name) if found else ""
    if not allowed:
        return None
    allowed = LIST if found == "among" else allowed
    return PydanticCustomError(
        "truth", "booleans are not accepted as numbers", {"name": name, "value": value, "allowed": allowed}
    )


def is_length(field: FieldInfo) -> bool:
    """Return whether a field holds lengths [m]."""
    return METRES in field.metadata or any(METRES in getattr(t, "__metadata__", ()) for t in _types(field.annotation))


@functools.cache
def numeric_fields(model: type[BaseModel]) -> tuple[str, ...]:
    """Name the fields of a model that hold numbers or vectors of numbers, and nothing else."""
    types = {name: _types(field.annotation) for name, field in model.model_fields.items()}
    return tuple(name for name, known in types.items() if float in known and not {str, dict, list} & {*known} - {float})


def sentence(report: ValidationError, model: type[BaseModel]) -> str:
    """Return the most informative error of `report` as one sentence: key, value, what is allowed."""
    errors = report.errors(include_url=False)[:MOST_COMPARED]
    # An unknown key explains more than what it leads to, and in a union the deepest complaint is the meant one.
    error = max(errors, key=lambda e: (e["type"] in ("extra_forbidden", "no_such_attribute"), len(e["loc"])))
    key = _key(error["loc"]) or model.__name__
    value = error.get("input")
    shown = _short(value)
    kind, limits = error["type"], error.get("ctx") or {}
    if kind in ("extra_forbidden", "no_such_attribute"):
        known = _known_keys(model, error["loc"][:-1])
        near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"known keys: {', '.join(sorted(known))}."
        return f"unknown key {key!r} (value {shown}); {hint}"
    if kind == "missing":
        return f"{key} is missing; it is required."
    if kind == "truth":
        key = ".".join(filter(None, (_key(error["loc"]), limits["name"])))
        return f"{key} = {_short(limits['value'])} is not allowed; it must be {limits['allowed']}."
    if kind == "value_error":
        return str(limits.get("error", error["msg"]))
    allowed = {
        "greater_than": "a number greater than {gt}",
        "greater_than_equal": "a number of at least {ge}",
        "less_than": "a number less than {lt}",
        "less_than_equal": "a number of at most {le}",
        "finite_number": "a finite number",
        "float_parsing": "a number",
        "float_type": "a number",
        "int_parsing": "a whole number",
        "int_type": "a whole number",
        "int_from_float": "a whole number",
        "tuple_type": LIST,
        "bool_parsing": "true or false",
        "bool_type": "true or false",
        "union_tag_invalid": "one of {expected_tags}",
        "union_tag_not_found": "a table with the key {discriminator}",
        "literal_error": "one of {expected}",
    }.get(kind)
    if allowed is None:
        message = error["msg"].removeprefix("Input should be ").removeprefix("Value error, ")
        allowed = message[:1].lower() + message[1:]
    else:
        allowed = allowed.format(**{name: _tidy(limit) for name, limit in limits.items()})
    return f"{key} = {shown} is not allowed; it must be {allowed}."


def _key(location: tuple[str | int, ...]) -> str:
    text = ""
    for number, part in enumerate(location, 1):
        if isinstance(part, int):
            text += f"[{part}]"
        elif part.startswith(("tuple[", "constrained-")) or (part in _SHAPE_TAGS and number < len(location)):
            continue
        else:
            text += f".{part}" if text else part
    return text


#: Tags of discriminated unions; pydantic puts them into an error's location, a user's file does not have them.
_SHAPE_TAGS: set[str] = set()


def register_tags(*tags: str) -> None:
    """Tell `sentence` which location parts are union tags rather than keys."""
    _SHAPE_TAGS.update(tags)


def _known_keys(model: type[BaseModel], path: tuple[str | int, ...]) -> list[str]:
    """Names of the fields that are allowed at `path` below `model`."""
    tags = [part for part in path if isinstance(part, str) and part in _SHAPE_TAGS]
    if tags:
        model = _MODEL_OF_TAG.get(tags[-1], model)
    else:
        for part in path:
            field = model.model_fields.get(part) if isinstance(part, str) else None
            inner = [t for t in _types(field.annotation) if _is_model(t)] if field is not None else []
            model = inner[0] if inner else model
    return list(model.model_fields)


_MODEL_OF_TAG: dict[str, type[BaseModel]] = {}


def register_model(tag: str, model: type[BaseModel]) -> None:
    """Tell `sentence` which model a union tag stands for."""
    register_tags(tag)
    _MODEL_OF_TAG[tag] = model


def _types(annotation: Any) -> list[Any]:
    arguments = getattr(annotation, "__args__", ())
    return [annotation, *(inner for argument in arguments for inner in _types(argument))]


def _is_model(candidate: Any) -> bool:
    return isinstance(candidate, type) and issubclass(candidate, BaseModel)


def _beginning(value: Any, depth: int = 4) -> Any:
    """Return as much of a value as a message can show, whatever its size."""
    if isinstance(value, str | bytes):
        return value[:100]
    if isinstance(value, np.ndarray):
        return value.reshape(-1)[:30].tolist()
    if depth and isinstance(value, list | tuple):
        return type(value)([_beginning(part, depth - 1) for part in value[:30]])
    if depth and isinstance(value, dict):
        return {key: _beginning(value[key], depth - 1) for key in list(value)[:10]}
    if isinstance(value, int) and abs(value) > 10**60:
        return 10**60 if value > 0 else -(10**60)
    return value if not isinstance(value, list | tuple | dict) else "..."


def _short(value: Any) -> str:
    text = repr(_beginning(value)).replace("\n", " ")
    return text if len(text) <= 60 else text[:57] + "..."


def _tidy(limit: Any) -> Any:
    return int(limit) if isinstance(limit, float) and math.isfinite(limit) and limit == int(limit) else limit
