"""Changes of the compiler's private parts: all fit the versions that are installed, and one that does not is told."""

import importlib.metadata

import pytest

from wavetank.device import patches
from wavetank.lab import doctor


def rows() -> dict[str, dict[str, str]]:
    return {row["name"]: row for row in doctor.examine()["checks"] if row["name"].startswith("patch: ")}


def test_all_patches_are_in_force():
    assert importlib.metadata.version("quadrants") in patches.VERSIONS
    assert len({patch.name for patch in patches.PATCHES}) == len(patches.PATCHES) > 14
    for patch in patches.PATCHES:
        assert patch.misfit is None, patch.name
        assert patch.sentence.endswith(".") and "\n" not in patch.sentence, patch.name
        assert patch.places and patch.versions, patch.name
    found = rows()
    assert len(found) == len(patches.PATCHES)
    assert {row["found"] for row in found.values()} == {"in force"}


def test_the_compiler_is_changed_in_all_places():
    from quadrants.lang import _kernel_impl_dataclass, _wrap_inspect, kernel_impl, matrix_ops
    from quadrants.lang.kernel import Kernel, LaunchContextBufferCache

    for changed in (
        kernel_impl._inside_class,
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
    assert row["found"] == "does not fit"
    assert row["note"].startswith(f"{reason}; made for Quadrants 1.3.3 and 1.4.0")


def test_a_patch_that_finds_another_way_says_so(monkeypatch):
    from quadrants.lang import _func_base

    monkeypatch.setattr(_func_base, "textwrap", object())
    patch = next(patch for patch in patches.PATCHES if patch.name == "wrapped text")
    again = patches.Patch(patch.name, patch.sentence, patch.places, patch.needs, patch.replacement)
    again.apply()
    assert again.misfit == "quadrants.lang._func_base wraps text in another way"
