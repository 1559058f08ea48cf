"""The rules of ARCHITECTURE.md, held against the code."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "src" / "wavetank"
FILES = sorted(PACKAGE.rglob("*.py"))
CORE = {
    "numpy",
    "pydantic",
    "pydantic_core",
    "tomli_w",
    "typer",
    "rich",
    "PIL",
    "platformdirs",
    "typing_extensions",
    "starlette",
    "uvicorn",
}

#: the rooms from the top floor down: an arrow of import points down
FLOORS = (
    "page",
    "lab",
    "run",
    "session",
    "formats",
    "view",
    "simulation",
    "physics",
    "scene",
    "solids",
    "device",
    "foundation",
)
FACES = {"__init__.py", "__main__.py", "cli"}  # what users import and type; no room knows them
#: room -> rooms below it that it must not know all the same
STRANGERS = {
    "page": {"lab"},
    "lab": {"run", "session", "formats", "view"},
    "session": {"formats"},
    "formats": {"view", "physics"},
    "view": {"physics"},
    "physics": {"scene"},
}
MOST_ENTRIES = 15  # at the top of the package


def imports(path: Path, *, top_only: bool = False) -> set[str]:
    """Dotted names that a file imports; `top_only` leaves out what functions import."""
    tree = ast.parse(path.read_text())
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    if top_only:
        inner = {
            id(node)
            for function in ast.walk(tree)
            if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef)
            for node in ast.walk(function)
        }
        typing_only = {
            id(node)
            for block in ast.walk(tree)
            if isinstance(block, ast.If) and "TYPE_CHECKING" in ast.dump(block.test)
            for node in ast.walk(block)
        }
        nodes = [node for node in nodes if id(node) not in inner | typing_only]
    names = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        else:
            assert node.level == 0, f"{path.name}: write imports in full"
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).parts[0]


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_rooms_know_only_what_is_below(path):
    for name in imports(path):
        if name.startswith("quadrants"):
            assert path.name == "compiler.py", "only compiler.py imports the kernel compiler"
        if name.startswith("wavetank.") and room(path) not in FACES - {"__init__.py"}:
            own, other = room(path), name.split(".")[1]
            if own in FLOORS and other in FLOORS:
                assert FLOORS.index(own) <= FLOORS.index(other), f"{path.name} imports {name}, which is above it"
                assert other not in STRANGERS.get(own, set()), f"{path.name} imports {name}"


def test_the_rooms_are_those_of_the_plan():
    entries = {path.name for path in PACKAGE.iterdir() if path.name not in ("__pycache__", "py.typed")}
    assert entries == {*FLOORS, *FACES}
    assert len(entries) <= MOST_ENTRIES


@pytest.mark.parametrize("path", sorted((PACKAGE / "view" / "passes").glob("*.py")), ids=lambda p: p.stem)
def test_a_pass_knows_no_other_pass(path):
    """What passes share lies beside them; which pass comes after which is for `views.py` to say."""
    assert not {name for name in imports(path) if name.startswith("wavetank.view.passes")}


def modules() -> dict[str, Path]:
    """Every module of the package by its dotted name."""
    names = {}
    for path in FILES:
        parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
        names[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return names


def test_no_import_is_a_circle():
    """Not even one for types only, or inside of a function."""
    known = modules()
    arrows = {
        name: {entry if entry in known else entry.rpartition(".")[0] for entry in imports(path)} & set(known)
        for name, path in known.items()
    }
    done: set[str] = set()

    def visit(name: str, way: tuple[str, ...]) -> None:
        assert name not in way, " -> ".join([*way[way.index(name) :], name])
        if name not in done:
            for other in sorted(arrows[name] - {name}):
                visit(other, (*way, name))
            done.add(name)

    for name in known:
        visit(name, ())


#: the one room of an optional package: nothing but `play`, inside its functions, may import the window
WINDOW = {"imgui_bundle", "moderngl", "glfw", "svg"}


def test_window_and_page_do_not_know_each_other():
    """What both need is beside them."""
    for path in FILES:
        name, inside = str(path.relative_to(PACKAGE)), path.parent.name == "window"
        if inside:
            assert not {entry for entry in imports(path) if entry.startswith("wavetank.page.server")}, name
        elif name != "page/play.py":
            assert not {entry for entry in imports(path) if entry.startswith("wavetank.page.window")}, name


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_optional_packages_are_imported_where_used(path):
    import sys

    for name in imports(path, top_only=True):
        top = name.split(".")[0]
        known = top in sys.stdlib_module_names or top in CORE | {"wavetank"}
        known = known or (top in WINDOW and path.parent.name == "window")
        assert not name.startswith("wavetank.page.window") or path.parent.name == "window", f"{path.name}: {name}"
        assert known or (top == "quadrants" and path.name == "compiler.py"), f"{path.name} imports {name} at the top"


BLOCKS = (ast.For, ast.While, ast.If, ast.With, ast.Try)
BRANCHES = (*BLOCKS, ast.IfExp, ast.BoolOp, ast.comprehension)
MOST_BRANCHES = 20
MOST_LEVELS = 5
#: Functions that are still above; the list only gets shorter.
TANGLED: set[str] = set()


def levels(node: ast.AST, above: int = 0) -> int:
    """How deep blocks are nested; `elif` does not nest."""
    deepest = above
    for name, value in ast.iter_fields(node):
        parts = value if isinstance(value, list) else [value]
        for part in parts:
            if isinstance(part, ast.AST):
                chained = isinstance(node, ast.If) and name == "orelse" and len(parts) == 1 and isinstance(part, ast.If)
                deepest = max(deepest, levels(part, above + (isinstance(part, BLOCKS) and not chained)))
    return deepest


def test_one_reading_explains_a_function():
    """Cyclomatic complexity at most 20, five levels of blocks at most, in kernels too."""
    tangled = set()
    for path in FILES:
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                branches = 1 + sum(isinstance(part, BRANCHES) for part in ast.walk(node))
                if branches > MOST_BRANCHES or levels(node) > MOST_LEVELS:
                    tangled.add(f"{path.relative_to(PACKAGE)}:{node.name}")
    assert tangled == TANGLED


def test_no_part_of_the_paper_is_missing():
    """Every equation of the report stands in the code with its number."""
    physics = "\n".join(path.read_text() for path in (PACKAGE / "physics").rglob("*.py"))
    for number in (1, 2, 4, 5, 7, 8, 9, 10, 11):
        assert re.search(rf"Eq\. (\d+, )*{number}\b", physics), f"Eq. {number}"


def test_parameters_page_is_up_to_date():
    from wavetank.lab.reference import parameters_page

    assert (ROOT / "docs" / "parameters.md").read_text() == parameters_page()


# --- arguments, and what kernels see ---

MOST_KERNEL_ARGUMENTS = 12
MOST_ARGUMENTS = 7
#: Functions with more. Those of `cli` are commands: typer makes options of their arguments.
MANY_ARGUMENTS = (
    "cli.experiments.bench",
    "cli.filming.film",
    "cli.playing.play",
    "cli.running.render",
    "cli.running.run",
)


def functions(path: Path) -> list[tuple[ast.FunctionDef, str]]:
    """The functions of a file, each "kernel", "func" (which kernels call) or "host"."""
    kinds = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef):
            decorators = {ast.unparse(decorator).split("(")[0] for decorator in node.decorator_list}
            kinds.append((node, next((kind for kind in ("kernel", "func") if f"qd.{kind}" in decorators), "host")))
    return kinds


def test_functions_take_few_arguments():
    """One swap of two numbers among many is silent: what belongs together travels together."""
    many = []
    for path in FILES:
        module = ".".join(path.relative_to(PACKAGE).with_suffix("").parts)
        for node, kind in functions(path):
            number = len([argument for argument in node.args.args if argument.arg not in ("self", "cls")])
            most = {"kernel": MOST_KERNEL_ARGUMENTS, "func": 99, "host": MOST_ARGUMENTS}[kind]
            if number > most:
                many.append(f"{module}.{node.name}")
    assert sorted(many) == sorted(MANY_ARGUMENTS)


@pytest.mark.parametrize("path", [path for path in FILES if "@qd." in path.read_text()], ids=lambda path: path.stem)
def test_kernels_read_no_constants_of_modules(path):
    """The compiler's cache does not see them: a kernel that reads one goes on with what it was.

    Functions are chosen from tuples and dicts by a number that the cache does see; these are append-only.
    """
    import importlib

    module = importlib.import_module(".".join(("wavetank", *path.relative_to(PACKAGE).with_suffix("").parts)))
    for node, kind in functions(path):
        if kind == "host":
            continue
        names = {part.id for line in node.body for part in ast.walk(line) if isinstance(part, ast.Name)}
        own = {argument.arg for argument in node.args.args}
        own |= {part.id for part in ast.walk(node) if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store)}
        for name in names - own:
            value = vars(module).get(name)
            entries = value.values() if isinstance(value, dict) else value if isinstance(value, tuple) else ()
            chosen_from = bool(entries) and all(callable(entry) for entry in entries)
            constant = isinstance(value, bool | int | float | str | tuple | list | dict | set) and not chosen_from
            assert not constant, f"{node.name} reads {name} = {value}"


def untyped(node: ast.AST) -> list[str]:
    """Name the functions below `node` that lack a type of an argument or of what they return; the device's may."""
    found = []
    for part in ast.iter_child_nodes(node):
        if not isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef):
            found += untyped(part)
            continue
        if {ast.unparse(decorator).split("(")[0] for decorator in part.decorator_list} & {"qd.func", "qd.kernel"}:
            continue
        given = part.args
        arguments = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
        types = [one.annotation for one in arguments if one and one.arg not in ("self", "cls")]
        found += [part.name] * (None in (*types, part.returns)) + untyped(part)
    return found


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_functions_of_the_host_have_types(path):
    """Mypy cannot tell kernels from functions that lack a type."""
    assert untyped(ast.parse(path.read_text())) == []


def test_tests_that_are_called_slow_are_there():
    names = (ROOT / "tests" / "slow.txt").read_text("utf-8").splitlines()
    assert names == sorted(set(names))
    for name in names:
        file, _, test = name.partition("::")
        text = (ROOT / file).read_text("utf-8")
        assert not test or f"def {test.split('[')[0]}(" in text, name


def test_data_needs_no_compiler():
    """Import the package, read, change and save scenes, and ask for help: without the compiler of kernels."""
    import subprocess
    import sys

    code = (
        "import sys, wavetank as wt; wt.Scene.load('ducks').changed(spacing=0.05); "
        "wt.Scene.load('double-dam-2d').particles(); "
        "wt.Scene.load('obstacle-tank').text(); wt.Scene(spacing=0.1, fluids=[wt.Ball(center=(0, 0), radius=1)]); "
        "from typer.testing import CliRunner; from wavetank.cli import app; "
        "results = [CliRunner().invoke(app, [*args]) for args in (['--help'], ['scenes'], ['--version'])]; "
        "assert not any(result.exit_code for result in results), results; assert 'quadrants' not in sys.modules"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_codes_of_shapes_are_those_of_the_device():
    from wavetank.solids import distance, solid

    for code in solid.Code:
        name = code.name.lower()
        known = distance.DISTANCES.index(getattr(distance, f"{name}_distance")) if code >= 0 else None
        assert code == (getattr(distance, name).fn() if known is None else known), name
    assert (distance.grids.fn(), distance.around.fn()) == (solid.GRIDS, solid.AROUND)
