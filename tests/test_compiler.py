"""Arguments of launches: the compiler reads what it is given, and is given what it knows."""

import dataclasses

from wavetank import compiler
from wavetank.compiler import qd
from wavetank.state import Coefficients, exchanged, integers, new_particles, remembered


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


def test_the_same_arrays_and_numbers_are_the_same_object():
    compiler.start("cpu")
    a, b = new_particles(2, 4), new_particles(2, 4)
    known: dict = {}
    c, d = exchanged(known, a, b, "v")
    assert c.v is b.v and d.v is a.v and c.x is a.x and d.x is b.x
    assert a.v is not b.v, "the first two are as they were"
    e, f = exchanged(known, c, d, "v")
    assert e.v is a.v and f.v is b.v
    g, h = exchanged(known, e, f, "v")
    assert g is c and h is d
    numbers = dict.fromkeys((field.name for field in dataclasses.fields(Coefficients)), 0.5)
    assert remembered(Coefficients(**numbers)) is remembered(Coefficients(**numbers))
    assert remembered(Coefficients(**{**numbers, "dt": 0.25})).dt == 0.25
