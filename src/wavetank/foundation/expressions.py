"""Numbers over time as text: a small grammar, parsed by Python's parser and never executed.

    0.3*sin(2*pi*0.8*t)      smoothstep(1, 3, t)      clamp(t - 2, 0, 1) * 45*deg

Numbers, `t` [s], the constants of `CONSTANTS`, the functions of `FUNCTIONS`, + - * / ** and brackets; nothing else.
"""

import ast
import functools
import math
import operator
from collections.abc import Callable

from wavetank.foundation.errors import WavetankError

LONGEST, MOST_PARTS = 400, 200  # characters of a text; numbers, names and operations in it
TRIED = 60.0  # s that an expression is evaluated for before it is accepted, TRIES times a second
TRIES = 20

Value = Callable[[float], float]  # of the time [s]


def _clamp(x: float, low: float, high: float) -> float:
    return min(max(x, low), high)


def _step(edge: float, x: float) -> float:
    return 1.0 if x >= edge else 0.0


def smoothstep(start: float, end: float, x: float) -> float:
    """Return 0 up to `start`, 1 from `end` on, and a cubic without corners between them."""
    share = _clamp((x - start) / (end - start), 0.0, 1.0)
    return share * share * (3.0 - 2.0 * share)


def _mod(x: float, y: float) -> float:
    return x - y * math.floor(x / y)


#: name -> function, and how many numbers it takes, at least and at most
FUNCTIONS: dict[str, tuple[Callable[..., float], int, int]] = {
    "sin": (math.sin, 1, 1),
    "cos": (math.cos, 1, 1),
    "tan": (math.tan, 1, 1),
    "asin": (math.asin, 1, 1),
    "acos": (math.acos, 1, 1),
    "atan": (math.atan, 1, 1),
    "atan2": (math.atan2, 2, 2),
    "exp": (math.exp, 1, 1),
    "log": (math.log, 1, 1),
    "sqrt": (math.sqrt, 1, 1),
    "abs": (abs, 1, 1),
    "floor": (math.floor, 1, 1),
    "min": (min, 2, 8),
    "max": (max, 2, 8),
    "clamp": (_clamp, 3, 3),
    "step": (_step, 2, 2),
    "smoothstep": (smoothstep, 3, 3),
    "mod": (_mod, 2, 2),
}
CONSTANTS = {"pi": math.pi, "tau": math.tau, "e": math.e, "deg": math.pi / 180.0}
_OPERATIONS: dict[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: math.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}


def shown(text: str) -> str:
    """Return a text as messages quote it."""
    return repr(text if len(text) <= 60 else text[:57] + "...")


class Expression:
    """A number [any unit] over time [s]. Raises `WavetankError` for a text that the grammar does not have."""

    def __init__(self, text: str) -> None:
        self.text = text
        self._value = _compiled(text)

    def __call__(self, time: float) -> float:
        """Return the value at `time` [s]; raises `WavetankError` where it is undefined or non-finite."""
        try:
            value = self._value(time)
        except ZeroDivisionError:
            raise WavetankError(
                f"{shown(self.text)} divides by zero at t = {time:.6g} s; it must have a finite value at every time."
            ) from None
        except (ValueError, OverflowError):
            value = math.nan
        if not math.isfinite(value):
            raise WavetankError(
                f"{shown(self.text)} has no finite value at t = {time:.6g} s; it must have one at every time."
            )
        return float(value)

    def check(self) -> None:
        """Evaluate the first minute; raises `WavetankError` where the value is non-finite."""
        for number in range(round(TRIED * TRIES) + 1):
            self(number / TRIES)


@functools.lru_cache(maxsize=1024)
def expression(text: str) -> Expression:
    """Parse a text; raises `WavetankError` if that fails or it is non-finite in its first minute."""
    result = Expression(text)
    result.check()
    return result


def _compiled(text: str) -> Value:
    if len(text) > LONGEST:
        raise WavetankError(f"{shown(text)} has {len(text)} characters; at most {LONGEST} are allowed.")
    try:
        tree = ast.parse(text.strip().replace("^", "**"), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise WavetankError(
            f"{shown(text)} is not an expression of t [s]; write one such as '0.3*sin(2*pi*0.8*t)'."
        ) from None
    if sum(1 for _ in ast.walk(tree)) > 3 * MOST_PARTS:
        raise WavetankError(f"{shown(text)} has more than {MOST_PARTS} parts; write a shorter expression.")
    if isinstance(tree.body, ast.Tuple):
        raise WavetankError(
            f"{shown(text)} is not a single number; write several in brackets, as [{text.replace(',', ', ')}]."
        )
    return _value_of(tree.body, text)


def _value_of(node: ast.AST, text: str) -> Value:
    """Compile one node of the tree; nodes that are not listed here are refused."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        try:
            number = float(node.value)  # type: ignore[arg-type]
        except OverflowError:
            raise WavetankError(f"{shown(text)} holds a number that is too large; at most 1e308 is allowed.") from None
        return lambda t: number
    if isinstance(node, ast.Name):
        if node.id == "t":
            return lambda t: t
        if node.id in CONSTANTS:
            constant = CONSTANTS[node.id]
            return lambda t: constant
    elif isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATIONS:
        do, inner = _OPERATIONS[type(node.op)], _value_of(node.operand, text)
        return lambda t: do(inner(t))
    elif isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        do, left, right = _OPERATIONS[type(node.op)], _value_of(node.left, text), _value_of(node.right, text)
        return lambda t: do(left(t), right(t))
    elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
        return _call(node, node.func.id, text)
    known = f"known are t, {', '.join(CONSTANTS)} and the functions {', '.join(FUNCTIONS)}"
    raise WavetankError(f"{ast.unparse(node)[:40]!r} in {shown(text)} is not known; {known}.")


def _call(node: ast.Call, name: str, text: str) -> Value:
    function, least, most = FUNCTIONS[name]
    if node.keywords or not least <= len(node.args) <= most:
        asked = f"{least}" if least == most else f"{least} to {most}"
        asked += " numbers" if most > 1 else " number"
        raise WavetankError(f"{name} in {shown(text)} takes {asked} in brackets, as in {name}({_example(least)}).")
    arguments = [_value_of(argument, text) for argument in node.args]
    return lambda t: function(*(argument(t) for argument in arguments))


def _example(number: int) -> str:
    return ", ".join(["1", "2", "t"][-number:])
