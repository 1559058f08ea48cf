"""What a pass is, held against the code."""

import ast
from pathlib import Path

import pytest

from wavetank.view import views

FOLDER = Path(views.__file__).parent
FILES = sorted(FOLDER.rglob("*.py"))
#: what is more than that is a missing noun; kernels take their data as well
MOST_ARGUMENTS = {"kernel": 12, "host": 7}


def functions(path):
    """(name, kind, number of arguments) of the kernels and the host's functions in a file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.FunctionDef):
            marks = [ast.unparse(mark) for mark in node.decorator_list]
            names = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            if "qd.func" not in marks:
                kind = "kernel" if any(mark.startswith("qd.kernel") for mark in marks) else "host"
                yield node.name, kind, len(names) - (names[:1] in (["self"], ["cls"]))


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(FOLDER)))
def test_what_belongs_together_travels_together(path):
    for name, kind, number in functions(path):
        assert number <= MOST_ARGUMENTS[kind], f"{name} takes {number} arguments"


def test_every_pass_belongs_to_a_view():
    stages = ("once", "shadows", "still", "sunny", "passes")
    drawn = {draw.__module__ for view in views.VIEWS.values() for stage in stages for draw in getattr(view, stage)}
    files = {f"wavetank.view.passes.{path.stem}" for path in (FOLDER / "passes").glob("*.py")}
    assert files - drawn == {"wavetank.view.passes.__init__", "wavetank.view.passes.tonemap"}  # which ends them all
