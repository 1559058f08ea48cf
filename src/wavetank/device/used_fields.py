"""Which fields of its arguments a kernel uses, read from source, so that the compiler walks over a kernel once.

A kernel takes whole dataclasses and hands the compiler only the fields that it uses. To find them the compiler walks
over a kernel and all functions that it calls, as if it compiled it, throws the result away and compiles it then: more
than half of the time that it takes to read a kernel (docs/performance.md). A look at the names in the source of each
function, once, finds them as well. It may find more than are used (in a branch that is not compiled, in a function that
is passed as an argument), never fewer; a kernel takes a few more arguments then, and computes the same.
"""

import ast
import dataclasses
import functools
import inspect
import linecache
import textwrap
from collections.abc import Iterator
from typing import Any

SEPARATOR = "__qd_"  # of the parts of a name that the compiler gives to a field of an argument


@dataclasses.dataclass
class Function:
    """A function that kernels call, or a kernel: the dataclasses it takes, and the names of the fields that it uses."""

    parameters: list[str]
    structures: dict[str, Any]  # by parameter
    names: set[str]  # each field, and each dataclass that such a field is in


def flat(base: str, field: str) -> str:
    """Return the compiler's name of a field of `base`, itself a parameter or such a name."""
    return f"{base if base.startswith(SEPARATOR) else SEPARATOR + base}{SEPARATOR}{field}"


def fields_of(base: str, structure: Any) -> Iterator[str]:
    """Yield the names of all fields of a dataclass that is called `base`, and of those in it."""
    for field in dataclasses.fields(structure):
        name = flat(base, field.name)
        yield name
        if dataclasses.is_dataclass(field.type):
            yield from fields_of(name, field.type)


class UsedFields:
    """The functions that have been read, each once."""

    def __init__(self) -> None:
        self.functions: dict[int, Function] = {}  # by the compiler's number of a function

    def of_kernel(self, kernel: Any) -> set[str]:
        """Return the names that a kernel uses."""
        return self._read(kernel).names

    def of_function(self, wrapper: Any) -> Function:
        """Return a function that kernels call, by what the compiler has made of it."""
        known = self.functions.get(wrapper.func_id)
        if known is None:
            known = self.functions[wrapper.func_id] = self._read(wrapper)
        return known

    def _read(self, wrapper: Any) -> Function:
        lines = lines_of(wrapper.func) or inspect.getsourcelines(wrapper.func)
        source = textwrap.dedent("".join(lines[0]))
        metas = [meta for meta in wrapper.arg_metas if meta.name]
        structures = {meta.name: meta.annotation for meta in metas if dataclasses.is_dataclass(meta.annotation)}
        function = Function([meta.name for meta in metas], structures, set())
        _Reader(self, function, _names_of(wrapper.func)).visit(ast.parse(source).body[0])
        return function


def lines_of(function: Any) -> tuple[list[str], int] | None:
    """Return the lines of a function of a module's own, decorators included, and the number of the first.

    None where there is no such file; `inspect` goes through all tokens of a function to find its end.
    """
    code = getattr(inspect.unwrap(function), "__code__", None)
    if code is None:
        return None
    first, lines = code.co_firstlineno, linecache.getlines(code.co_filename)
    last = _functions_in(code.co_filename).get(first)
    return (lines[first - 1 : last], first) if last else None


@functools.cache
def _functions_in(file: str) -> dict[int, int]:
    """Return the last line of each function of a file's module by its first line; none of a file without Python."""
    try:
        tree = ast.parse("".join(linecache.getlines(file)))
    except SyntaxError:
        return {}
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef)]
    return {min([f.lineno, *(d.lineno for d in f.decorator_list)]): f.end_lineno or 0 for f in functions}


def _names_of(function: Any) -> dict[str, Any]:
    """Return the objects that a function's source can name, but its own."""
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {**function.__globals__, **{name: cell.cell_contents for name, cell in cells}}


class _Reader(ast.NodeVisitor):
    """Adds what the source of a function uses to its names."""

    def __init__(self, used: UsedFields, function: Function, objects: dict[str, Any]) -> None:
        self.used, self.function, self.objects = used, function, objects

    def visit_Name(self, node: ast.Name) -> None:
        self._use_whole(node)
        self._called(node)

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if self._field(node) is None:
            self.generic_visit(node)
        self._use_whole(node)
        self._called(node)

    def visit_Call(self, node: ast.Call) -> None:
        called = self._called(node.func)
        if called is None:
            self.generic_visit(node)
            return
        given: list[tuple[str | None, ast.expr]] = [*zip(called.parameters, node.args, strict=False)]
        for parameter, value in given + [(keyword.arg, keyword.value) for keyword in node.keywords]:
            found = self._field(value)
            if found is None or parameter is None or parameter not in called.structures:
                self.visit(value)
                continue
            name, _ = found
            start = SEPARATOR + parameter + SEPARATOR
            handed = [flat(name, used.removeprefix(start)) for used in called.names if used.startswith(start)]
            if handed:
                self._add(name)
            self.function.names.update(handed)

    def _use_whole(self, node: ast.expr) -> None:
        """Use a field, and all that it has."""
        found = self._field(node)
        if found is None:
            return
        name, structure = found
        self._add(name)
        if dataclasses.is_dataclass(structure):
            self.function.names.update(fields_of(name, structure))

    def _add(self, name: str) -> None:
        """Add the name of a field, and of the dataclasses that it is in."""
        parts = name.split(SEPARATOR)
        self.function.names.update(SEPARATOR.join(parts[:length]) for length in range(3, len(parts) + 1))

    def _field(self, node: ast.expr) -> tuple[str, Any] | None:
        """Return the name and the type of a dataclass among the parameters or of a field; None for all else."""
        if isinstance(node, ast.Name) and node.id in self.function.structures:
            return node.id, self.function.structures[node.id]
        if isinstance(node, ast.Attribute):
            owner = self._field(node.value)
            if owner is not None and dataclasses.is_dataclass(owner[1]):
                for field in dataclasses.fields(owner[1]):
                    if field.name == node.attr:
                        return flat(owner[0], field.name), field.type
        return None

    def _called(self, node: ast.expr) -> Function | None:
        """Return the function of kernels that an expression names, None for all else."""
        wrapper = getattr(self._object(node), "wrapper", None)
        return self.used.of_function(wrapper) if hasattr(wrapper, "func_id") else None

    def _object(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Name) and node.id not in self.function.parameters:
            return self.objects.get(node.id)
        if isinstance(node, ast.Attribute):
            return getattr(self._object(node.value), node.attr, None)
        return None


def handed_on(function: Function, given: list[Any], expanded: list[Any], values: list[Any]) -> list[Any]:
    """Return those of the `values` that a function takes.

    `given` are the arguments as the call has them, `expanded` the same with a name for each field of a dataclass, which
    `values` belong to.
    """
    taken: list[Any] = []
    seen: set[str] = set()
    k = 0
    for parameter, node in zip(function.parameters, given, strict=False):
        if isinstance(node, ast.Starred):
            return taken + values[k:]
        if parameter not in function.structures or not isinstance(node, ast.Name):
            taken.append(values[k])
            k += 1
            continue
        start = flat(node.id, "")
        seen.clear()
        while k < len(expanded) and isinstance(expanded[k], ast.Name) and expanded[k].id.startswith(start):
            name = expanded[k].id
            if name in seen:  # of the next argument, the same dataclass once more
                break
            seen.add(name)
            if flat(parameter, name.removeprefix(start)) in function.names:
                taken.append(values[k])
            k += 1
    return taken
