"""Arguments of launches: the compiler reads what it is given, and is given what it knows."""

import dataclasses
import re
import types
from pathlib import Path
from typing import Final

import numpy as np
import pytest

from wavetank.device import compiler, freed_arrays, launches
from wavetank.device.compiler import qd
from wavetank.device.state import Coefficients, integers, interned, new_particles, swapped


@dataclasses.dataclass(frozen=True)
class Numbers:
    """As `state.Coefficients`."""

    one: qd.i32
    half: qd.f32


@qd.kernel(fastcache=True)
def write(x: qd.types.ndarray(), numbers: Numbers, place: qd.i32):
    x[place] = numbers.one + qd.cast(2.0 * numbers.half, qd.i32)


def test_a_launch_reads_the_numbers_that_it_is_given():
    """Frozen objects of numbers come and go, and take the addresses of those that are gone."""
    compiler.start("cpu")
    x = integers(4)
    read = []
    for k in range(300):
        numbers = Numbers(one=1000 * k, half=0.5 * k)
        write(x, numbers, 3)
        read.append(int(compiler.download(x)[3]))
        del numbers
    assert read == [1001 * k for k in range(300)]


@pytest.fixture
def prepared(monkeypatch) -> list:
    """How many arguments the compiler has prepared for launches, by now and from now on."""
    from quadrants.lang.kernel import Kernel

    whole, seen = Kernel._recursive_set_args, []
    monkeypatch.setattr(Kernel, "_recursive_set_args", staticmethod(lambda *args: seen.append(args[1]) or whole(*args)))
    return seen


def test_a_launch_that_is_known_is_not_prepared_again(prepared):
    """Those of the same objects are, with any plain number, wherever it is kept."""
    compiler.start("cpu")
    x, y = integers(1004), integers(1004)
    one, two = Numbers(one=1, half=0.0), Numbers(one=2, half=0.0)
    for array, numbers, place in ((x, one, 1000), (x, one, 1001), (x, two, 1002), (y, two, 1003)):
        write(array, numbers, place)
    before = len(prepared)
    for array, numbers, place in ((x, two, 2002), (y, two, 2003), (x, one, 2001)):
        write(array, numbers, place - 1000)
    assert len(prepared) == before == 3 * 3  # (x, one), (x, two) and (y, two)
    assert compiler.download(x)[1000:].tolist() == [1, 1, 2, 0]
    assert compiler.download(y)[1000:].tolist() == [0, 0, 0, 2]


def test_a_launch_may_name_its_arguments():
    compiler.start("cpu")
    x, numbers = integers(2004), Numbers(one=5, half=1.0)
    for place in range(2000, 2003):
        write(x, place=place, numbers=numbers)
    assert compiler.download(x)[2000:].tolist() == [7, 7, 7, 0]


@dataclasses.dataclass(frozen=True)
class More:
    """Fields that only some variants of a kernel read: plain numbers come after those that are."""

    first: qd.i32
    second: qd.i32
    third: qd.f32


@qd.kernel(fastcache=True)
def write_some(x: qd.types.ndarray(), more: More, place: qd.i32, share: qd.f32, whole: qd.template()):
    if qd.static(whole):
        x[place] = more.first + more.second + qd.cast(more.third + share, qd.i32)
    else:
        x[place] = more.second + qd.cast(share, qd.i32)


def test_variants_of_a_kernel_have_their_numbers_in_places_of_their_own(prepared):
    compiler.start("cpu")
    x, more = integers(1000), More(first=100, second=10, third=1000.0)
    for place in range(4):
        for whole in (1, 0):
            write_some(x, more, 500 + 2 * place + whole, 1.0 + place, whole)
    assert len(prepared) == 2 * len(("x", "more", "place", "share"))  # once for each variant
    assert compiler.download(x)[500:508].tolist() == [11, 1111, 12, 1112, 13, 1113, 14, 1114]


@dataclasses.dataclass(frozen=True, eq=False)
class Row:
    """An array and a number that kernels are compiled for, as `state.Grid`."""

    x: qd.types.ndarray()
    step: Final[int]


@qd.kernel(fastcache=True)
def write_steps(row: Row, numbers: Numbers, place: qd.i32):
    for k in qd.static(range(row.step)):
        row.x[place + k] = numbers.one + row.step


def test_launches_are_known_whose_objects_have_numbers_that_they_are_compiled_for(prepared):
    compiler.start("cpu")
    x, numbers = integers(1000), Numbers(one=5, half=0.0)
    one, two = Row(x, 1), Row(x, 2)
    write_steps(one, numbers, 500)
    write_steps(two, numbers, 502)
    before = len(prepared)
    write_steps(one, numbers, 504)
    write_steps(two, numbers, 506)
    assert len(prepared) == before > 0
    assert compiler.download(x)[500:508].tolist() == [6, 0, 7, 7, 6, 0, 7, 7]
    write_steps(Row(integers(1000), 2), numbers, 0)
    assert compiler.download(x)[:2].tolist() == [0, 0]


def test_prepared_launches_go_with_their_arrays(prepared):
    """A new array may take the address of one that is gone."""
    compiler.start("cpu")
    numbers, kept, seen = Numbers(one=7, half=0.0), [], []
    for k in range(40):
        x = integers(4 + k % 3)
        write(x, numbers, 3)
        seen.append(int(compiler.download(x)[3]))
        if k % 5 == 0:
            kept.append(x)
        del x
    assert seen == [7] * 40
    assert all(int(compiler.download(x)[3]) == 7 for x in kept)


def test_only_so_many_prepared_launches_are_kept():
    compiler.start("cpu")
    x, numbers = integers(1000), Numbers(one=5, half=0.0)
    for place in range(1000):
        write(x, numbers, place)
    assert 0 < len(write._primal.launch_context_buffer_cache.launches.known) <= launches.MOST
    assert (compiler.download(x) == 5).all()


def test_the_same_arrays_and_numbers_are_the_same_object():
    compiler.start("cpu")
    a, b = new_particles(2, 4), new_particles(2, 4)
    known: dict = {}
    c, d = swapped(known, a, b, "v")
    assert c.v is b.v and d.v is a.v and c.x is a.x and d.x is b.x
    assert a.v is not b.v, "the first two are as they were"
    e, f = swapped(known, c, d, "v")
    assert e.v is a.v and f.v is b.v
    g, h = swapped(known, e, f, "v")
    assert g is c and h is d
    numbers = dict.fromkeys((field.name for field in dataclasses.fields(Coefficients)), 0.5)
    assert interned(Coefficients(**numbers)) is interned(Coefficients(**numbers))
    assert interned(Coefficients(**{**numbers, "dt": 0.25})).dt == 0.25


@qd.kernel  # not from the cache, which does not see how the compiler reads a product
def products(a: qd.types.vector(3, qd.f32), b: qd.types.vector(3, qd.f32), out: qd.types.ndarray()):
    out[0] = a.dot(b)
    out[1] = a.norm()
    out[2] = a.norm(eps=7.0)
    out[3] = a.norm_sqr()
    out[4] = a.sum()
    for k in qd.static(range(3)):
        out[5 + k] = a.cross(b)[k]
        out[8 + k] = (a + b).normalized()[k]
    flat = qd.Vector([a[0], a[1]])
    out[11] = flat.cross(qd.Vector([b[0], b[1]]))
    out[12] = qd.Matrix([[a[0], a[1]], [b[0], b[1]]]).norm_sqr()


def test_products_of_vectors_are_what_they_are_called():
    """Kernels read none of the compiler's own sources for these; matrices and other arguments take the long way."""
    compiler.start("cpu")
    a, b, out = np.float32([1.0, 2.0, 4.0]), np.float32([3.0, -1.0, 0.5]), qd.ndarray(qd.f32, 13)
    products(a, b, out)
    along = (a + b) / np.linalg.norm(a + b)
    expected = [3.0, 21.0**0.5, 28.0**0.5, 21.0, 7.0, *np.cross(a, b), *along, -7.0, 15.0]
    assert compiler.download(out) == pytest.approx(expected, rel=1e-6)


def test_arrays_that_go_are_given_away_again():
    """The compiler keeps 50 bytes of each array ever made: 4 MB an hour for twenty a second. None is made anew here."""
    handles = set()
    for _ in range(5):
        array = qd.ndarray(qd.types.vector(3, qd.f32), shape=(123,))
        assert not compiler.download(array).any()
        compiler.upload(array, np.full((123, 3), 7.0, np.float32))
        handles.add(program().get_ndarray_data_ptr_as_int(array.arr))
        del array
    assert len(handles) == 1
    other = qd.ndarray(qd.f32, shape=(3 * 123,))
    assert program().get_ndarray_data_ptr_as_int(other.arr) not in handles


def test_only_so_many_arrays_that_went_are_kept():
    size = 4 * 2**20
    living = [qd.ndarray(qd.f32, shape=(size // 4 + k,)) for k in range(2 * freed_arrays.MOST // size)]
    before = resident()
    del living
    assert before - resident() > freed_arrays.MOST // 2


def program():
    return qd.lang.impl.get_runtime().prog


def resident():
    """Bytes of this process in memory."""
    return int(re.search(r"VmRSS:\s+(\d+)", Path("/proc/self/status").read_text())[1]) * 1024


def test_a_mirror_reads_and_writes_what_the_device_has():
    """It sees what kernels wrote since it was made, and what it does not write becomes zero, as with `upload`."""
    array = qd.ndarray(qd.f32, shape=(4,))
    mirror = compiler.Mirror(array)
    compiler.upload(array, np.arange(4.0))
    compiler.synchronize()
    assert mirror.read().tolist() == [0.0, 1.0, 2.0, 3.0]
    mirror.write(np.array([0.1, 7.0]))
    assert compiler.download(array).tolist() == [float(np.float32(0.1)), 7.0, 0.0, 0.0]


def test_a_kernel_is_told_before_it_is_compiled():
    @qd.kernel
    def double(values: qd.types.ndarray(), count: qd.i32):
        for i in range(count):
            values[i] *= 2

    told = []
    array = qd.ndarray(qd.i32, shape=(4,))
    with compiler.on_compile(lambda number, name: told.append((number, name))):
        double(array, 4)
        double(array, 3)
    assert told == [(1, "double")]


def test_an_array_that_outlives_its_program_is_not_given_away_again():
    """What an earlier program made went with it; it was kept for the next one, and given to it as an array."""
    array = types.SimpleNamespace(dtype="f32", shape=(4,), element_size=lambda: 4)
    deleted = []
    freed = freed_arrays.FreedArrays(
        lambda program, *_: array if program == "first" else "new", lambda program, array: deleted.append(array)
    )
    freed.create("first", "f32", (4,))
    freed.create("second", "f32", (8,))
    freed.delete("second", array)
    assert freed.create("second", "f32", (4,)) == "new" and not deleted
