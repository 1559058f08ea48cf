"""Quadrants as mypy sees it: functions of the device are not checked, kernels can be called, all else is Any."""

from collections.abc import Callable
from typing import Any, TypeAlias
from typing import no_type_check as func

from quadrants import math as math

__all__ = ["f32", "f64", "func", "i32", "i64", "kernel", "math"]

f32: TypeAlias = float
f64: TypeAlias = float
i32: TypeAlias = int
i64: TypeAlias = int

def kernel(*, fastcache: bool = ...) -> Callable[[Callable[..., Any]], Callable[..., Any]]: ...
def __getattr__(name: str) -> Any: ...
