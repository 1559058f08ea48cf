"""What this project relies on in the compiler beyond its documentation."""

import dataclasses

from wavetank import compiler
from wavetank.compiler import qd
from wavetank.state import integers


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
