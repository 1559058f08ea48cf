"""Patches of the kernel compiler, each with a name, so that kernels are read and launched sooner.

The compiler asks Python's `inspect` for the source of a function each time it inlines it; wraps every line of it as
text, for error messages; asks for the range of a type with each number; and reads the same functions again for each
kernel, to see whether they have changed. A third of a cold start went there, and half a second of a warm one
(docs/performance.md). The answers stay the same.

They replace private parts, and are applied when a back end starts, not before: until then another program in the same
process has the compiler as it is. They are for the `VERSIONS` below. With another version, or with the environment
variable `WAVETANK_PATCHES=0`, none is applied: all works without them, only slower, and `wavetank doctor` says so.
"""

import contextlib
import dataclasses
import functools
import importlib
import inspect
import linecache
import os
import sys
import textwrap
import types
from collections.abc import Callable, Iterator
from typing import Any

from wavetank.device.freed_arrays import FreedArrays
from wavetank.device.launches import NEEDED, keep_prepared_launches
from wavetank.device.used_fields import UsedFields, handed_on, lines_of

VERSIONS = ("1.3.3", "1.4.0")  # of Quadrants
SWITCH = "WAVETANK_PATCHES"  # environment variable: 0 applies none
LANGUAGE = "quadrants.lang"  # the package that all places are in


class MisfitError(Exception):
    """What a patch is to change is not there."""


@dataclasses.dataclass
class Patch:
    """One change."""

    name: str
    sentence: str  # what it does
    places: tuple[str, ...]  # what is replaced: module:attribute, below `LANGUAGE`
    needs: tuple[str, ...]  # what has to be there besides
    replacement: Callable[[Any], Any]  # makes it from what was at a place
    misfit: str | None = None  # why it is not in force

    def apply(self) -> None:
        """Put the replacement in its places, or note why that cannot be."""
        try:
            found = [_found(place) for place in self.places]
            for need in self.needs:
                _found(need)
            made = [self.replacement(getattr(owner, name)) for owner, name in found]
        except MisfitError as reason:
            self.misfit = str(reason)
            return
        for (owner, name), new in zip(found, made, strict=True):
            setattr(owner, name, new)


PATCHES: list[Patch] = []
_applied = False


def apply_all(version: str) -> str | None:
    """Apply every patch to Quadrants of this `version`, once; return why none is applied, None where all may be.

    What a single patch misses is told by its `misfit`.
    """
    global _applied
    reason = None
    if os.environ.get(SWITCH) == "0":
        reason = f"{SWITCH}=0 turns them off"
    elif version not in VERSIONS:
        reason = f"this is Quadrants {version}"
    for patch in PATCHES:
        if reason:
            patch.misfit = reason
        elif not _applied:
            patch.apply()
    _applied = _applied or reason is None
    return reason


# --- what is compiled ---

#: Called with the name of each kernel before this process reads it for the first time, to compile it or to load it.
LISTENERS: list[Callable[[str], None]] = []


def _found(place: str) -> tuple[Any, str]:
    """Return the object that has a place, and the name of it there; raises `MisfitError` where there is none."""
    module, _, path = place.partition(":")
    try:
        owner: Any = importlib.import_module(f"{LANGUAGE}.{module}")
    except ImportError:
        raise MisfitError(f"there is no module {LANGUAGE}.{module}") from None
    *parents, name = path.split(".")
    for part in [*parents, name]:
        if not hasattr(owner, part):
            raise MisfitError(f"{LANGUAGE}.{module} has no {path}")
        owner = getattr(owner, part) if part is not name else owner
    return owner, name


def _part(module: str) -> Any:
    return sys.modules[f"{LANGUAGE}.{module}"]


def patch(
    name: str, *places: str, needs: tuple[str, ...] = ()
) -> Callable[[Callable[[Any], Any]], Callable[[Any], Any]]:
    """Declare a patch; the function makes the replacement, its sentence says what that does."""

    def declare(replacement: Callable[[Any], Any]) -> Callable[[Any], Any]:
        PATCHES.append(Patch(name, inspect.getdoc(replacement) or "", places, needs, replacement))
        return replacement

    return declare


@contextlib.contextmanager
def short_frames() -> Iterator[None]:
    """Let `inspect` tell a frame's line without a walk over all modules, while the compiler is imported.

    It asks hundreds of times whether a function that it decorates, one of its own, stands in the body of a class.
    """
    whole = inspect.getframeinfo

    def line_only(frame: Any, context: int = 1) -> inspect.Traceback:
        name, line = frame.f_code.co_filename, frame.f_lineno
        return inspect.Traceback(name, line, frame.f_code.co_name, [linecache.getline(name, line)] * context, 0)

    inspect.getframeinfo = line_only
    try:
        yield
    finally:
        inspect.getframeinfo = whole


# --- reading kernels ---


@patch("files", "_wrap_inspect:getsourcefile")
def remember_files(look_up: Any) -> Any:
    """Looks the file of a function up once."""
    return functools.cache(look_up)


@patch("sources", "_wrap_inspect:getsourcelines")
def remember_sources(look_up: Any) -> Any:
    """Looks a function's source up once, by the syntax tree of its file."""
    return functools.cache(lambda function: lines_of(function) or look_up(function))


@patch("hashes", "_fast_caching.function_hasher:_hash_function")
def remember_hashes(hash_function: Any) -> Any:
    """Hashes a function once."""
    return functools.cache(hash_function)


@patch("wrapped text", "_func_base:textwrap")
def remember_wrapped_text(module: Any) -> Any:
    """Wraps a line of source once."""
    if module is not textwrap:
        raise MisfitError(f"{LANGUAGE}._func_base wraps text in another way")
    remembering = types.ModuleType("textwrap")
    remembering.__dict__.update(vars(textwrap), fill=functools.cache(textwrap.fill))
    return remembering


@patch("ranges", "expr:_check_in_range")
def remember_ranges(check: Any) -> Any:
    """Looks the range of a type up once for each number."""
    return functools.cache(check)


@patch("places in sources", "ast.ast_transformer_utils:ASTTransformerFuncContext._build_pos_info")
def place_in_source(place_in_lines: Any) -> Any:
    """Marks the place of an error in a single line without wrapping it."""

    def place(context: Any, node: Any) -> str:
        line = context.src[node.lineno - 1] if node.lineno == node.end_lineno <= len(context.src) else ""
        if not 0 < len(line) <= 120 or not line.isprintable():
            return str(place_in_lines(context, node))
        first, last = context.indent + node.col_offset, context.indent + node.end_col_offset
        where = f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:'
        return f"{where}\n{line.rstrip()}\n{' ' * first}{'^' * (last - first)}\n"

    return place


@patch(
    "flat fields",
    "_kernel_impl_dataclass:unpack_ast_struct_expressions",
    needs=("_kernel_impl_dataclass:FlattenAttributeNameTransformer",),
)
def flatten_fields(_: Any) -> Any:
    """Walks over a function for the fields of its arguments only where it has some."""
    transformer = _part("_kernel_impl_dataclass").FlattenAttributeNameTransformer

    def flatten(tree: Any, struct_locals: set[str]) -> Any:
        return transformer(struct_locals=struct_locals).visit(tree) if struct_locals else tree

    return flatten


@patch(
    "final fields",
    "_func_base:subtree_has_final_fields",
    "_template_mapper_hotpath:subtree_has_final_fields",
    "_template_mapper:annotation_has_final_subtree",
)
def trust_final_fields(_: Any) -> Any:
    """Reads numbers of a frozen object that are compiled into a kernel (`Final`) once, as ours are plain integers."""
    return lambda _: False


USED = UsedFields()  # by the kernels of this package


@patch(
    "one walk",
    "kernel:Kernel._try_load_fastcache",
    needs=("kernel:Pruning.filter_call_args", "impl:current_cfg", "kernel:template"),
)
def walk_once(load: Callable[..., set[str] | None]) -> Callable[..., set[str] | None]:
    """Finds the fields that a kernel of this package uses in its source, without a walk over all that it calls."""
    # Elsewhere arguments are buffers, of which there may be few: none that is not needed should be among them.
    by_value = {_part("impl")._qd_core.Arch.x64, _part("impl")._qd_core.Arch.arm64, _part("impl")._qd_core.Arch.cuda}
    template = _part("kernel").template

    def is_plain(meta: Any, value: Any) -> bool:
        is_template = meta.annotation is template or type(meta.annotation) is template
        return not is_template or isinstance(value, int | float)

    def find(self: Any, args: tuple[Any, ...], key: Any) -> set[str] | None:
        names = load(self, args, key)
        ours = self.func.__module__.startswith("wavetank.") and _part("impl").current_cfg().arch in by_value
        if names is None and ours and all(map(is_plain, self.arg_metas, args)):
            names = self.used_py_dataclass_parameters_by_key_enforcing[key] = USED.of_kernel(self)
        return names

    return find


@patch("fields of calls", "kernel:Pruning", needs=("func:Func",))
def hand_on_by_source(pruning: Any) -> Any:
    """Hands a function the fields that its source uses, where no walk has found them."""
    function = _part("func").Func

    class Names(dict[int, set[str]]):
        def __missing__(self, number: int) -> set[str]:
            return USED.functions[number].names if number in USED.functions else set()

    class BySource(pruning):  # type: ignore[misc]
        def __init__(self, kernel_used_parameters: set[str] | None) -> None:
            super().__init__(kernel_used_parameters)
            if kernel_used_parameters is not None:
                self.used_vars_by_func_id: dict[int, set[str]] = Names({pruning.KERNEL_FUNC_ID: kernel_used_parameters})

        def filter_call_args(self, caller: int, called: Any, node: Any, nodes: Any, keywords: Any, args: Any) -> Any:
            if self.pass_0_ran or type(getattr(called, "wrapper", None)) is not function:
                return super().filter_call_args(caller, called, node, nodes, keywords, args)
            return handed_on(USED.of_function(called.wrapper), node.args, nodes, args)

    return BySource


# --- products of vectors ---
#
# The compiler reads the source of its own `dot`, and of the functions that this calls, each time that a kernel has a
# dot product in it, and makes variables of their arguments: a quarter of the time it took to read kernels. These are
# the same sums without the reading.

PARTS = ("impl:expr_init", "impl:subscript", "impl:inside_kernel", "expr:Expr", "matrix:make_matrix")


def _in_kernels(name: str, *lengths: int) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Declare a function for the compiler's of that name, where a kernel gives it vectors of those `lengths`."""

    def declare(of_vectors: Callable[..., Any]) -> Callable[..., Any]:
        @patch(f"product {name}", f"matrix_ops:{name}", needs=PARTS)
        def make(of_anything: Any) -> Any:
            """Adds up components where the compiler would read a function of its own."""

            @functools.wraps(of_anything)
            def chosen(*args: Any, **kwargs: Any) -> Any:
                in_kernel = _part("impl").inside_kernel() and not kwargs
                shapes = {_shape(value) for value in args} if in_kernel else set()
                known = len(shapes) == 1 and shapes <= {(length,) for length in lengths}
                return (of_vectors if known else of_anything)(*args, **kwargs)

            return chosen

        return of_vectors

    return declare


def _shape(value: Any) -> tuple[int, ...]:
    return tuple(value.get_shape()) if isinstance(value, _part("expr").Expr) and value.is_tensor() else ()


def _variable(value: Any) -> Any:
    """Return a value that is computed once."""
    return _part("impl").expr_init(value)


def _components(vector: Any) -> list[Any]:
    """Return the components of a vector that is computed once."""
    value = _variable(vector)
    return [_part("impl").subscript(None, value, k) for k in range(value.n)]


@_in_kernels("sum", 2, 3, 4)
def _sum(vector: Any) -> Any:
    return functools.reduce(lambda total, x: _variable(total + x), _components(vector))


@_in_kernels("dot", 2, 3, 4)
def _dot(a: Any, b: Any) -> Any:
    return _sum(a * b)


@_in_kernels("norm_sqr", 2, 3, 4)
def _norm_sqr(vector: Any) -> Any:
    value = _variable(vector)
    return _sum(value * value)


@_in_kernels("norm", 2, 3, 4)
def _norm(vector: Any) -> Any:
    return _part("ops").sqrt(_norm_sqr(vector))


@_in_kernels("normalized", 2, 3, 4)
def _normalized(vector: Any) -> Any:
    value = _variable(vector)
    return _variable(1 / _norm(value)) * value


@_in_kernels("cross", 3)
def _cross(a: Any, b: Any) -> Any:
    ax, ay, az = _components(a)
    bx, by, bz = _components(b)
    return _part("matrix").make_matrix([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


# --- launches ---


@patch("progress", "kernel:Kernel.materialize")
def tell_listeners(materialize: Callable[..., None]) -> Callable[..., None]:
    """Tells listeners of each kernel that is about to be compiled."""

    def tell(self: Any, key: Any, *args: Any, **kwargs: Any) -> None:
        if LISTENERS and key not in self.materialized_kernels:
            for listener in tuple(LISTENERS):
                listener(self.func.__name__)
        materialize(self, key, *args, **kwargs)

    return tell


@patch("stale launches", "kernel:LaunchContextBufferCache.cache")
def keep_no_stale_launches(_: Any) -> Any:
    """Keeps none of the launches that the compiler prepares by itself: they may be stale (`launches.py`)."""
    return lambda *_: None


@patch("prepared launches", "kernel:Kernel", needs=("impl:get_runtime", *(f"kernel:{part}" for part in NEEDED)))
def keep_launches(kernel: Any) -> Any:
    """Keeps prepared launches by their arguments, and launches them at once."""
    keep_prepared_launches(_part("kernel"), _part("impl").get_runtime)
    return kernel


# --- arrays ---


@patch("freed arrays", "impl:_qd_core.Program", needs=("impl:_qd_core.Program.get_ndarray_data_ptr_as_int",))
def keep_freed_arrays(program: Any) -> Any:
    """Gives arrays of the CPU that nobody uses any more away again: of each one made it keeps some bytes for ever."""
    on_host = {_part("impl")._qd_core.Arch.x64, _part("impl")._qd_core.Arch.arm64}
    freed = FreedArrays(program.create_ndarray, program.delete_ndarray)

    def create(self: Any, *args: Any, **kwargs: Any) -> Any:
        return (freed.create if self.config().arch in on_host else freed.really_create)(self, *args, **kwargs)

    def delete(self: Any, array: Any) -> None:
        return (freed.delete if self.config().arch in on_host else freed.really_delete)(self, array)

    program.create_ndarray, program.delete_ndarray = create, delete
    return program
