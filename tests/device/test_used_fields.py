"""The fields that a kernel uses, read from its source."""

import ast
import dataclasses
import linecache

import numpy as np
import pytest

from wavetank.device.compiler import LANES, download, qd, start, upload
from wavetank.device.patches import USED
from wavetank.device.used_fields import UsedFields, handed_on, lines_of


@dataclasses.dataclass(frozen=True)
class Pair:
    a: qd.types.ndarray()
    b: qd.types.ndarray()


@dataclasses.dataclass(frozen=True)
class Box:
    pair: Pair
    c: qd.types.ndarray()
    spare: qd.types.ndarray()
    scale: qd.f32


@qd.func
def first_and_second(x: Pair, y: Pair, i):
    return x.a[i] + 10.0 * y.b[i]


@qd.func
def scaled(value, box: Box):
    return value * box.scale


@qd.func
def applied(change: qd.template(), value, box: Box):
    return change(value, box)


@qd.kernel(fastcache=True)
def fill(box: Box, other: Pair, out: qd.types.ndarray(), branch: qd.template()):
    for i in range(out.shape[0]):
        value = first_and_second(box.pair, other, i) + first_and_second(other, other, i)
        if qd.static(branch):
            value += box.c[i]
        out[i] = scaled(value, box=box)


@pytest.fixture
def arguments():
    start("cpu")
    rng = np.random.default_rng(0)

    def array():
        made = qd.ndarray(qd.f32, shape=(LANES,))
        upload(made, rng.random(LANES).astype(np.float32))
        return made

    return Box(Pair(array(), array()), array(), array(), 3.0), Pair(array(), array()), array()


@pytest.mark.parametrize("branch", [0, 1])
def test_a_kernel_that_is_walked_over_once_computes_the_same(branch, arguments, monkeypatch):
    box, other, out = arguments
    kernel = fill._primal
    monkeypatch.setattr(kernel.func, "__module__", "wavetank.here")
    fill(box, other, out, branch)
    a, b, c, x, y = (download(array) for array in (box.pair.a, box.pair.b, box.c, other.a, other.b))
    assert b.shape == c.shape
    np.testing.assert_allclose(download(out), 3.0 * (a + 10.0 * y + x + 10.0 * y + branch * c), rtol=1e-6)


def test_only_what_is_used_is_taken():
    """And what is used in a branch that is not compiled."""
    assert UsedFields().of_kernel(fill._primal) == {
        "__qd_box__qd_pair",
        "__qd_box__qd_pair__qd_a",
        "__qd_box__qd_c",
        "__qd_box__qd_scale",
        "__qd_other__qd_a",
        "__qd_other__qd_b",
    }


def test_all_is_taken_that_is_given_to_a_function_that_is_an_argument():
    names = USED.of_function(applied.wrapper).names
    assert names == {f"__qd_box__qd_{name}" for name in ("pair", "pair__qd_a", "pair__qd_b", "c", "spare", "scale")}


def test_a_call_hands_on_what_its_function_takes():
    """The same dataclass twice in a row: each time what the parameter needs."""
    call = ast.parse("first_and_second(p, p, i)").body[0].value
    expanded = [ast.Name(name) for name in ("__qd_p__qd_a", "__qd_p__qd_b", "__qd_p__qd_a", "__qd_p__qd_b", "i")]
    function = USED.of_function(first_and_second.wrapper)
    assert handed_on(function, call.args, expanded, ["xa", "xb", "ya", "yb", "i"]) == ["xa", "yb", "i"]


def test_functions_of_other_kernels_are_read_once():
    assert USED.of_function(scaled.wrapper) is USED.of_function(scaled.wrapper)
    assert USED.of_function(scaled.wrapper).names == {"__qd_box__qd_scale"}


def test_lines_are_those_of_the_function():
    lines, first = lines_of(scaled.wrapper.func)
    assert lines[0] == "@qd.func\n"
    assert lines[-1].strip() == "return value * box.scale"
    assert linecache.getlines(__file__)[first - 1 : first + 2] == lines
    assert lines_of(len) is None
