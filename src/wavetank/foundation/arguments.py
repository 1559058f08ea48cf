"""What a script passes and assigns: a mistake becomes one sentence, and nothing that it writes is lost silently."""

import collections.abc
import difflib
import functools
import inspect
import math
import os
import types
import typing
from collections.abc import Callable
from typing import Any

import numpy as np
from typing_extensions import override

from wavetank.foundation.errors import NoAttributeError, WavetankError


def finite(name: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    """Return `value` as a number; raises `WavetankError` for all but finite ones from `low` to `high`."""
    number = isinstance(value, int | float | np.number) and not isinstance(value, bool | np.complexfloating)
    if not number or not (math.isfinite(value) and low <= value <= high):
        least = (
            "" if low == -math.inf else f" of at least {low:g}" if high == math.inf else f" from {low:g} to {high:g}"
        )
        raise WavetankError(f"{name} = {brief(value)} is not allowed; it must be a finite number{least}.")
    return float(value)


def array_of(name: str, value: Any, kind: type, shape: str) -> np.ndarray:
    """Return `value` as an array of `kind`; raises `WavetankError`, which names the `shape`, for what is not one.

    Whole numbers are not made of others.
    """
    try:
        array = np.asarray(value)
        wrong = array.dtype.kind not in "iuf" if array.size else False
        if wrong or (np.issubdtype(kind, np.integer) and array.size and not (array == np.trunc(array)).all()):
            raise ValueError
        return array.astype(kind)
    except (TypeError, ValueError, OverflowError):
        numbers = "whole numbers" if np.issubdtype(kind, np.integer) else "numbers"
        raise WavetankError(
            f"{name} = {brief(value)} is not allowed; it must be an array of {numbers} {shape}."
        ) from None


def instance_of(name: str, value: Any, kind: type, what: str) -> Any:
    """Return `value`; raises `WavetankError`, which says `what` is needed, for what is not a `kind`."""
    if not isinstance(value, kind):
        raise WavetankError(f"{name} = {brief(value)} is not allowed; it must be {what}.")
    return value


def path_of(value: Any, what: str = "file") -> str | os.PathLike[str]:
    """Return the path of a file; raises `WavetankError` for what is not a path."""
    if not isinstance(value, str | os.PathLike):
        raise WavetankError(f"{brief(value)} is not the name of a {what}; give a text or a Path.")
    return value


def brief(value: Any) -> str:
    """Return a value as messages show it, in at most 60 characters."""
    if isinstance(value, np.ndarray) and value.size > 8:
        return f"an array {list(value.shape)}"
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."


# --- attributes ---


class KnownAttributes:
    """Refuses attributes that its class does not declare, those that are only read, and values of other types.

    A subclass declares what can be set as a property with a setter or by an annotation.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute; raises `WavetankError`."""
        cls = type(self)
        if not name.startswith("_"):
            declared = inspect.getattr_static(cls, name, None)
            kind = _declared(cls).get(name)  # type: ignore[arg-type]
            if isinstance(declared, property) and declared.fset is None:
                raise NoAttributeError(f"{name} of a {cls.__name__} is only read; {settable(cls)}.")
            if kind is None and not isinstance(declared, property):
                raise NoAttributeError(f"a {cls.__name__} has no attribute {name!r}; {near(name, cls)}.")
            if kind is not None and not isinstance(value, kind):
                names = " or ".join(each.__name__ for each in kind)
                raise WavetankError(f"{name} = {brief(value)} is not allowed; it must be a {names}.")
        super().__setattr__(name, value)


@functools.cache
def _declared(cls: Any) -> dict[str, tuple[type, ...]]:
    """Return the attributes that a class annotates, and of which classes their values are."""
    return {name: _kinds(hint) for name, hint in typing.get_type_hints(cls).items()}


UNCHECKED: tuple[Any, ...] = (collections.abc.Callable, Any)


def _kinds(hint: Any) -> tuple[type, ...]:
    """Return the classes of the values of a type, (object,) where it is not known."""
    if hint is float:
        return float, int, np.number
    if isinstance(hint, types.UnionType):
        return tuple(kind for member in typing.get_args(hint) for kind in _kinds(member))
    kind = typing.get_origin(hint) or hint
    return (kind,) if isinstance(kind, type) and kind not in UNCHECKED else (object,)


def settable(cls: type) -> str:
    """Say which properties of a class can be set."""
    names = [name for name, part in inspect.getmembers(cls) if isinstance(part, property) and part.fset]
    return f"{' and '.join(names)} can be set" if names else "nothing of it can be set"


def near(name: str, cls: type) -> str:
    """Say which attribute of a class is meant by `name`, or how to find those that there are."""
    known = [other for other in {*dir(cls), *_declared(cls)} if not other.startswith("_")]
    close = difflib.get_close_matches(name, known, 1)
    return f"did you mean {close[0]!r}?" if close else "dir() lists what it has"


# --- arrays that are copies ---


class ReadOnlyArray(np.ndarray):
    """An array that is a copy of what a world has; writing to it raises `WavetankError` that says what sets that.

    What is computed from it is a plain array, in-place operators on a name as well: `x -= 1` leaves the copy alone.
    """

    how = ""

    @override
    def __array_finalize__(self, source: Any) -> None:
        self.how = getattr(source, "how", "")

    @override
    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, out: Any = (), **more: Any) -> Any:
        for array in out:
            if isinstance(array, ReadOnlyArray):
                array.refuse_if_read_only()
        if out:
            more["out"] = tuple(map(_plain, out))
        result = getattr(ufunc, method)(*map(_plain, inputs), **more)
        return out[0] if out and len(out) == 1 else result

    def refuse_if_read_only(self) -> None:
        """Raise `WavetankError` where this is a copy, or a view of one."""
        if not self.flags.writeable:
            raise WavetankError(self.how)

    @override
    def __setitem__(self, key: Any, value: Any) -> None:
        self.refuse_if_read_only()
        super().__setitem__(key, value)

    @override
    def copy(self, order: Any = "C") -> np.ndarray:  # type: ignore[override]
        """Return a plain array that can be changed."""
        return np.array(self, order=order)

    def __deepcopy__(self, memo: Any) -> np.ndarray:  # type: ignore[override]
        return self.copy()

    @override
    def __reduce__(self) -> Any:
        return _plain(self).__reduce__()


def _plain(value: Any) -> Any:
    return value.view(np.ndarray) if isinstance(value, ReadOnlyArray) else value


def _in_place(name: str) -> Callable[[ReadOnlyArray, Any], Any]:
    def operate(self: ReadOnlyArray, other: Any) -> Any:
        return getattr(_plain(self) if self.flags.writeable else self.copy(), name)(_plain(other))

    return operate


def _refused(name: str) -> Callable[..., Any]:
    def change(self: ReadOnlyArray, *args: Any, **options: Any) -> Any:
        self.refuse_if_read_only()
        return getattr(np.ndarray, name)(self, *args, **options)

    return change


for _name in (
    "add",
    "sub",
    "mul",
    "truediv",
    "floordiv",
    "mod",
    "pow",
    "and",
    "or",
    "xor",
    "lshift",
    "rshift",
    "matmul",
):
    setattr(ReadOnlyArray, f"__i{_name}__", _in_place(f"__i{_name}__"))
for _name in ("fill", "sort", "partition", "put", "resize", "byteswap"):
    setattr(ReadOnlyArray, _name, _refused(_name))


def read_only(array: np.ndarray, name: str, setter: str) -> np.ndarray:
    """Return `array` so that writing to it raises `WavetankError`: it is a copy, and `setter` is what sets `name`."""
    result = array.view(ReadOnlyArray)
    result.flags.writeable = False
    result.how = f"{name} is a copy, and what is written to it would be lost; {setter}."
    return result
