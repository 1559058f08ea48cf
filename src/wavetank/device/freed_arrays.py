"""Arrays that nobody uses any more are kept, and given away again as new ones of the same kind.

The compiler remembers some 50 bytes of each array on the CPU that was ever made, as long as the process lives. A world
has a hundred arrays, and an instant that a session keeps is read through a dozen: 40 MB an hour for who plays. Of what
goes, up to `MOST` bytes are kept here; those of the kind that was not used for longest go for good.
"""

import collections
import ctypes
import math
import threading
from collections.abc import Callable
from typing import Any

MOST = 32 * 2**20  # bytes of arrays that are kept

Kind = tuple[str, tuple[int, ...]]  # type of an element, and shape


class FreedArrays:
    """The arrays of the present program that nobody uses."""

    def __init__(self, create: Callable[..., Any], delete: Callable[..., None]) -> None:
        self.really_create, self.really_delete = create, delete
        self.kept: collections.OrderedDict[Kind, list[Any]] = collections.OrderedDict()  # the latest kind last
        self.bytes = 0
        self.program: Any = None
        self.used: dict[int, Any] = {}  # the present program's arrays that somebody uses, by their id
        self.lock = threading.RLock()  # an array may go in any thread, and within `create`

    def create(self, program: Any, dtype: Any, shape: Any, *args: Any, **kwargs: Any) -> Any:
        """Return an array of zeros, as the compiler's own function does."""
        kind = (str(dtype), tuple(shape))
        with self.lock:
            self._turn_to(program)
            handles = self.kept.get(kind)
            if handles:
                array = handles.pop()
                self.bytes -= _size(array)
                ctypes.memset(program.get_ndarray_data_ptr_as_int(array), 0, _size(array))
            else:
                array = self.really_create(program, dtype, shape, *args, **kwargs)
            self.used[id(array)] = array
        return array

    def delete(self, program: Any, array: Any) -> None:
        """Keep an array that nobody uses, where it is one of the CPU's; one of an earlier program went with that."""
        with self.lock:
            self._turn_to(program)
            if self.used.pop(id(array), None) is None:
                return
            kind, size = (str(array.dtype), tuple(array.shape)), _size(array)
            if size > MOST:
                self.really_delete(program, array)
                return
            self.kept.setdefault(kind, []).append(array)
            self.kept.move_to_end(kind)
            self.bytes += size
            while self.bytes > MOST:
                oldest, handles = next(iter(self.kept.items()))
                if handles:
                    self.bytes -= _size(handles[-1])
                    self.really_delete(program, handles.pop())
                else:
                    del self.kept[oldest]

    def _turn_to(self, program: Any) -> None:
        """Forget the arrays of an earlier program."""
        if program is not self.program:
            self.program, self.bytes = program, 0
            self.kept.clear()
            self.used.clear()


def _size(array: Any) -> int:
    """Bytes of an array."""
    return int(array.element_size()) * math.prod(array.shape)
