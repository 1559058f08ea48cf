"""Hypothesis strategies made from the declarations: what a model says that it takes, and all that it does not.

`tables` walks the fields of a model; `mutated` takes something good and puts other values, of the declared type or of
none, in a few of its places. Whoever adds a field, a force, a command or a shape has it attacked from then on.
"""

import json
import math
import types
import typing
from typing import Any

import annotated_types
import numpy as np
import tomli_w
from hypothesis import strategies as st
from pydantic import BaseModel
from pydantic.fields import FieldInfo

EDGES = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-300, 5e-324, 1e-9, 1e9, 1e18, 1e30, 3.4e38, 1e300, math.inf, -math.inf, math.nan]
WHOLE = [0, 1, -1, 2, 7, 100, 2**31 - 1, 2**31, -(2**31), 2**32, 2**53, 2**63 - 1, 2**63, 10**30]
TEXTS = [
    "",
    "a",
    "t",
    "2*t",
    "sin(t)/t",
    "1e300*t",
    "t**t**t",
    "1/0",
    "exp(exp(t))",
    "((((((((t))))))))",
    "-" * 300 + "1",
    "\0",
    "\ud800",
    "x" * 1000,
    "../../etc/passwd",
    "/dev/zero",
    "wavetank/boat.obj",
    "ж\n",
    "__import__('os')",
    "nan",
    "1_0",
]
WEIRD: st.SearchStrategy[Any] = st.one_of(
    st.sampled_from(EDGES),
    st.sampled_from(WHOLE),
    st.sampled_from(TEXTS),
    st.booleans(),
    st.none(),
    st.sampled_from(
        [
            [],
            {},
            [[]],
            [{}],
            {"a": {}},
            [[[0.1]]],
            [0.1, 0.2],
            [0.1, 0.2, 0.3],
            [1] * 5,
            [[0.1, 0.1]] * 50,
            [{"time": 0, "value": 1}, {"time": 1, "value": "t"}],
        ]
    ),
    st.recursive(st.floats() | st.text(max_size=5), lambda inner: st.lists(inner, max_size=3), max_leaves=8),
)


def of_field(field: FieldInfo, depth: int) -> st.SearchStrategy[Any]:
    return of_type(field.annotation, field.metadata, depth)


def of_type(kind: Any, marks: Any = (), depth: int = 0) -> st.SearchStrategy[Any]:
    """Values that a declared type takes, mostly."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return of_type(arguments[0], (*arguments[1:], *marks), depth)
    if origin in (typing.Union, types.UnionType):
        parts = [part for part in arguments if not (depth > 2 and _is_model(part))] or [type(None)]
        return st.one_of([of_type(part, marks, depth) for part in parts])
    if origin is typing.Literal:
        return st.sampled_from(arguments)
    if origin is list:
        return st.lists(of_type(arguments[0], (), depth + 1), max_size=3)
    if origin is tuple:
        return st.tuples(*[of_type(part, (), depth) for part in arguments if part is not ...]).map(list)
    if origin is dict:
        return st.dictionaries(st.sampled_from(["viscosity", "spacing", "gravity", "a"]), WEIRD, max_size=2)
    if _is_model(kind):
        return tables(kind, depth + 1)
    if kind is bool:
        return st.booleans()
    if kind in (int, float):
        return _numbers(kind, marks)
    if kind is str:
        return st.sampled_from(TEXTS)
    if kind is np.ndarray:
        return st.lists(st.lists(st.floats(0, 1), min_size=2, max_size=3), max_size=5)
    return WEIRD


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _numbers(kind: type, marks: Any) -> st.SearchStrategy[Any]:
    """Numbers within the declared bounds, their ends among them, and small ones."""
    low, high = -10.0, 10.0
    flat = [part for mark in marks for part in getattr(mark, "metadata", [mark])]
    for mark in flat:
        if isinstance(mark, annotated_types.Ge):
            low = float(mark.ge)
        elif isinstance(mark, annotated_types.Gt):
            low = float(mark.gt)
        elif isinstance(mark, annotated_types.Le):
            high = float(mark.le)
        elif isinstance(mark, annotated_types.Lt):
            high = float(mark.lt)
    high = max(low, high)
    if kind is int:
        return st.one_of(st.integers(math.ceil(low), max(math.ceil(low), math.floor(high))), st.sampled_from([0, 1, 2]))
    usual = st.floats(max(low, -2.0), max(min(high, 2.0), max(low, -2.0)))
    return st.one_of(usual, usual, st.sampled_from([low, high]))


def tables(model: type[BaseModel], depth: int = 0) -> st.SearchStrategy[dict[str, Any]]:
    """Tables as a model declares them: with what it asks for, and some of the rest."""
    fields = model.model_fields
    needed = {name: of_field(field, depth) for name, field in fields.items() if field.is_required()}
    needed |= {
        name: st.just(fields[name].default)
        for name in ("shape", "kind", "do")
        if name in fields
        and isinstance(fields[name].default, str)
        and model.__name__ != "Parameters"
        and typing.get_origin(fields[name].annotation) is typing.Literal
    }
    others = {name: of_field(field, depth) for name, field in fields.items() if name not in needed}
    return st.fixed_dictionaries(needed, optional={}).flatmap(
        lambda table: st.lists(st.sampled_from(sorted(others) or ["none"]), max_size=3, unique=True).flatmap(
            lambda names: st.fixed_dictionaries({name: others[name] for name in names if name in others}).map(
                lambda more: {**table, **more}
            )
        )
    )


def places(plain: Any, way: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """All places of a plain table."""
    found = [way] if way else []
    items = plain.items() if isinstance(plain, dict) else enumerate(plain[:20]) if isinstance(plain, list) else ()
    for key, value in items:
        found += places(value, (*way, key))
    return found


@st.composite
def mutated(draw: Any, good: st.SearchStrategy[Any], more: st.SearchStrategy[Any] = WEIRD) -> Any:
    """Something good with one to three changes: other values, what is missing, twice, or in the wrong place."""
    plain = json.loads(json.dumps(draw(good)))
    for _ in range(draw(st.integers(1, 3))):
        ways = places(plain)
        if not ways:
            return draw(WEIRD)
        *way, last = draw(st.sampled_from(ways))
        target = plain
        for key in way:
            target = target[key]
        what = draw(st.sampled_from(["change", "change", "change", "declared", "drop", "twice"]))
        if what == "drop":
            del target[last]
        elif what == "twice" and isinstance(target, list):
            target.append(target[last])
        else:
            target[last] = draw(more if what == "declared" else WEIRD)
    return plain


@st.composite
def torn(draw: Any, content: st.SearchStrategy[bytes]) -> bytes:
    """Bytes with some of them changed, cut, doubled, or put elsewhere."""
    data = bytearray(draw(content))
    for _ in range(draw(st.integers(1, 6))):
        if not data:
            break
        a = draw(st.integers(0, len(data) - 1))
        b = min(len(data), a + draw(st.sampled_from([1, 2, 4, 8, 64, 1000, 10**6])))
        what = draw(st.sampled_from(["flip", "cut", "double", "zero", "ones", "number", "move"]))
        if what == "flip":
            data[a] ^= 1 << draw(st.integers(0, 7))
        elif what == "cut":
            del data[a:b]
        elif what == "double":
            data[a:a] = data[a:b]
        elif what in ("zero", "ones"):
            data[a:b] = bytes([0 if what == "zero" else 255]) * (b - a)
        elif what == "number":
            data[a:b] = draw(st.sampled_from([b"999999999999", b"-1", b"1e999", b"nan", b"[", b'"', b"0x" + b"f" * 40]))
        else:
            data += data[a:b]
    return bytes(data)


def toml_of(plain: Any) -> str:
    """A table as TOML, or what comes nearest to it."""

    def tidy(value: Any) -> Any:
        if isinstance(value, dict):
            return {
                str(key).encode("utf-8", "replace").decode(): tidy(part)
                for key, part in value.items()
                if part is not None
            }
        if isinstance(value, list | tuple):
            return [tidy(part) for part in value if part is not None]
        return value.encode("utf-8", "replace").decode() if isinstance(value, str) else value

    return tomli_w.dumps(tidy(plain)) if isinstance(plain, dict) else f"x = {plain!r}"
