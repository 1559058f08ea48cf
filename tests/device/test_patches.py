"""Changes of the compiler's private parts: all fit the versions that are installed, and one that does not is told."""

import importlib.metadata
import os
import subprocess
import sys

import pytest

from wavetank.device import compiler, patches
from wavetank.lab import doctor


def rows() -> dict[str, dict[str, str]]:
    return {row["name"]: row for row in doctor.examine()["checks"] if row["name"].startswith("patch: ")}


@pytest.fixture(autouse=True, scope="module")
def started():
    compiler.start("cpu")


def test_all_patches_are_in_force():
    assert importlib.metadata.version("quadrants") in patches.VERSIONS
    assert len({patch.name for patch in patches.PATCHES}) == len(patches.PATCHES) > 10
    for patch in patches.PATCHES:
        assert patch.misfit is None, patch.name
        assert patch.sentence.endswith(".") and "\n" not in patch.sentence, patch.name
        assert patch.places, patch.name
    found = rows()
    assert len(found) == len(patches.PATCHES)
    assert {row["found"] for row in found.values()} == {"in force"}


def test_the_compiler_is_changed_in_all_places():
    from quadrants.lang import _kernel_impl_dataclass, _wrap_inspect, matrix_ops
    from quadrants.lang.kernel import Kernel, LaunchContextBufferCache

    for changed in (
        _kernel_impl_dataclass.unpack_ast_struct_expressions,
        Kernel.__call__,
        LaunchContextBufferCache.cache,
    ):
        assert changed.__module__.startswith("wavetank.device."), changed
    assert _wrap_inspect.getsourcelines.cache_info().misses >= 0
    assert matrix_ops.dot.__wrapped__.__module__ == "quadrants.lang.matrix_ops"


@pytest.mark.parametrize(
    ("places", "needs", "reason"),
    [
        (("impl:no_such_part",), (), "quadrants.lang.impl has no no_such_part"),
        (("no_such_file:part",), (), "there is no module quadrants.lang.no_such_file"),
        (("impl:expr_init",), ("kernel:Kernel.gone",), "quadrants.lang.kernel has no Kernel.gone"),
        (("impl:expr_init", "impl:gone"), (), "quadrants.lang.impl has no gone"),
    ],
)
def test_a_patch_that_does_not_fit_is_told_and_changes_nothing(places, needs, reason, monkeypatch):
    from quadrants.lang import impl

    before = impl.expr_init
    patch = patches.Patch("trial", "Does nothing good.", places, needs, lambda old: None)
    patch.apply()
    assert patch.misfit == reason
    assert impl.expr_init is before
    monkeypatch.setattr(patches, "PATCHES", [*patches.PATCHES, patch])
    row = rows()["patch: trial"]
    assert row["found"] == "not applied"
    assert row["note"].startswith(f"{reason}; made for Quadrants 1.3.3 and 1.4.0")


def test_a_patch_that_finds_another_way_says_so(monkeypatch):
    from quadrants.lang import _func_base

    monkeypatch.setattr(_func_base, "textwrap", object())
    patch = next(patch for patch in patches.PATCHES if patch.name == "wrapped text")
    again = patches.Patch(patch.name, patch.sentence, patch.places, patch.needs, patch.replacement)
    again.apply()
    assert again.misfit == "quadrants.lang._func_base wraps text in another way"


def run_alone(code: str, **environment: str) -> str:
    """Run code in a process of its own; return what it prints."""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, **environment}
    )
    return done.stdout + done.stderr


def test_the_compiler_is_as_it_is_until_a_back_end_starts():
    said = run_alone(
        "import quadrants, wavetank as wt; from quadrants.lang.kernel import Kernel as K; before = K.__call__;"
        "wt.Simulation, wt.render; from wavetank.device import compiler, patches;"
        "print(K.__call__ is before); compiler.start(); print(K.__call__ is before)"
    )
    assert said.split()[-2:] == ["True", "False"]


STILL = (
    "from quadrants.lang.kernel import Kernel as K; from wavetank.device import compiler, patches;"
    "before = K.materialize; {}; compiler.start();"
    "print(K.materialize is before, {{patch.misfit for patch in patches.PATCHES}})"
)


def test_a_switch_turns_them_off():
    said = run_alone(STILL.format("pass"), WAVETANK_PATCHES="0")
    assert said.strip().endswith("True {'WAVETANK_PATCHES=0 turns them off'}")


def test_an_unknown_version_is_left_alone_with_one_sentence():
    said = run_alone(STILL.format("import quadrants; quadrants.__version__ = (9, 9, 9)"))
    assert "True {'this is Quadrants 9.9.9'}" in said
    assert "Quadrants 9.9.9 is not one that wavetank's patches are made for (1.3.3, 1.4.0)" in said
