"""HDF5 files that grow frame by frame and can be opened after each: columns hold the rows of all frames."""

import contextlib
import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wavetank.formats.committed import CommittedFile
from wavetank.foundation import input_limits
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import check_free, in_words
from wavetank.foundation.retry import Retry

CHUNK = 1 << 17  # bytes of a chunk, about
LARGEST = 2**48  # bytes
MOST_OBJECTS = 1000  # groups and tables of a file
FEW = 128  # rows per chunk of a column with one row per frame
#: what h5py, and what reads its values, raise for a damaged file
UNREADABLE = (OSError, KeyError, IndexError, ValueError, TypeError, RuntimeError, AttributeError, ArithmeticError)


def import_h5py() -> Any:
    """Return the module; raise `WavetankError` where it is not installed."""
    try:
        import h5py
    except ImportError:
        raise WavetankError("HDF5 and VTKHDF files need h5py; install it: pip install 'wavetank[hdf5]'.") from None
    return h5py


class GrowingFile:
    """Columns that grow; what was appended counts from the next `commit` on, which counts frames up."""

    def __init__(self, path: str | Path, group: str, counter: str, retry: Retry | None = None) -> None:
        """Open `path`; the attribute `counter` of `group` says how many frames there are."""
        h5py = import_h5py()
        self.disk = CommittedFile(path, retry or Retry())
        # The oldest layout is read by all, and knows no mark of a file that somebody writes, which outlives a kill.
        self.file = h5py.File(self.disk, "w", libver=("earliest", "v110"), rdcc_nbytes=2 * CHUNK)
        self._columns: dict[str, Any] = {}
        self._lengths: dict[str, int] = {}
        self.hidden = False  # whether readers still see the file that was there before
        self.frames, self._counter = 0, (self.file.require_group(group), counter)
        self._counter[0].attrs.create(counter, 0, dtype=np.int64)

    def column(self, name: str, kind: Any, *width: int, each_frame: bool = False) -> None:
        """Make a column of rows of that type and width; with `each_frame` it has one for each frame."""
        dtype = np.dtype(kind)
        rows = FEW if each_frame else max(16, CHUNK // (dtype.itemsize * int(np.prod(width, dtype=int))))
        self._columns[name] = self.file.create_dataset(
            name, shape=(0, *width), maxshape=(None, *width), chunks=(rows, *width), dtype=dtype, track_times=False
        )
        self._lengths[name] = 0

    def append(self, name: str, rows: Any) -> None:
        """Append rows to a column."""
        dataset, first = self._columns[name], self._lengths[name]
        values = np.ascontiguousarray(rows, dataset.dtype)
        if len(values):
            self._lengths[name] = first + len(values)
            dataset.resize(first + len(values), axis=0)
            dataset.write_direct(values, dest_sel=np.s_[first : first + len(values)])

    def length(self, name: str) -> int:
        """Return the rows of a column."""
        return self._lengths[name]

    def commit(self) -> None:
        """End a frame: first its data, then its number, so that no reader meets a number without data."""
        for frames in (self.frames, self.frames + 1):
            self._counter[0].attrs.modify(self._counter[1], np.int64(frames))
            self.file.flush()
            if not self.hidden:
                self.disk.commit()
        self.frames += 1

    def close(self) -> None:
        """Close the file; it is removed if it has no frame."""
        try:
            self.file.close()
        finally:
            if self.frames:
                self.disk.close()
            else:
                self.disk.abandon()


def open_hdf5(path: str | Path) -> Any:
    """Open an HDF5 file for reading; raises `WavetankError` for another file, and what `check_whole` refuses."""
    h5py = import_h5py()
    input_limits.open_regular(path, LARGEST, "HDF5 file").close()  # a regular file, not a pipe
    with damaged(path):
        file = h5py.File(path, "r")
        try:
            check_whole(file, Path(path).stat().st_size)
        except BaseException:
            file.close()
            raise
        return file


def check_whole(file: Any, size: int) -> None:
    """Raise `ValueError` where data lie elsewhere, or unpack to more than a file of `size` bytes may hold.

    External links, external storage and virtual datasets bring in other files; nothing of them is opened, as only links
    and headers are read.
    """
    h5py, most = import_h5py(), max(input_limits.UNPACKED, input_limits.TIMES * size)
    waiting, seen = [file], 0
    while waiting:
        group = waiting.pop()
        for name in group:
            seen += 1
            if seen > MOST_OBJECTS:
                raise ValueError(f"it has more than {MOST_OBJECTS:,} groups and tables")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name!r} is a link; only what is in the file is read")
            member = group[name]
            if isinstance(member, h5py.Group):
                waiting.append(member)
            elif isinstance(member, h5py.Dataset):
                _check_dataset(member, most)


def _check_dataset(dataset: Any, most: int) -> None:
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"the data of {dataset.name!r} are in other files; only what is in the file is read")
    if dataset.dtype.kind not in "fiubS":
        raise ValueError(f"{dataset.name!r} holds {dataset.dtype}; only numbers and texts of fixed length are read")
    whole, chunk = (
        math.prod(map(int, shape)) * dataset.dtype.itemsize for shape in (dataset.shape, dataset.chunks or ())
    )
    if max(whole, chunk) > most:
        raise ValueError(
            f"{dataset.name!r} takes {in_words(max(whole, chunk))}; in a file of this size {in_words(most)} are allowed"
        )


@contextlib.contextmanager
def damaged(path: str | Path) -> Iterator[None]:
    """Raise what a damaged file causes as a `WavetankError` of one line."""
    origin = input_limits.printable(path)
    with input_limits.explain_errors(origin, "HDF5 file"):
        try:
            yield
        except UNREADABLE as error:
            if isinstance(error, WavetankError):
                raise
            raise WavetankError(f"{origin}: this HDF5 file cannot be read: {input_limits.one_line(error)}.") from None


Rows = Mapping[str, np.ndarray]
Columns = Mapping[str, tuple[Any, tuple[int, ...]]]  # type and width


class Table:
    """Columns of a growing file that have a number of rows in each frame, which `first` and `count` tell."""

    def __init__(self, file: GrowingFile, name: str, columns: Columns) -> None:
        self.file, self.name, self.columns = file, name, [*columns]
        for column, (kind, width) in columns.items():
            file.column(f"{name}/{column}", kind, *width)
        for column in ("first", "count"):
            file.column(f"{name}/{column}", np.int64, each_frame=True)

    def append(self, rows: Rows) -> None:
        """Append the rows of a frame."""
        count = len(rows[self.columns[0]])
        self.file.append(f"{self.name}/first", [self.file.length(f"{self.name}/{self.columns[0]}")])
        self.file.append(f"{self.name}/count", [count])
        for column in self.columns:
            self.file.append(f"{self.name}/{column}", rows[column])


def table_rows(group: Any, frame: int) -> dict[str, np.ndarray]:
    """Return the columns of a table in a frame; raises `ValueError` where they cannot be.

    The rows of a frame follow those of the one before, so that a file does not stand for more than it holds.
    """
    first, count = int(group["first"][frame]), int(group["count"][frame])
    before = int(group["first"][frame - 1]) + int(group["count"][frame - 1]) if frame else 0
    if first != before:
        raise ValueError(
            f"frame {frame} begins at row {first} of {group.name}, not at {before}, where the last one ends"
        )
    columns = {name: group[name] for name in group if name not in ("first", "count")}
    for name, column in columns.items():
        if not 0 <= first <= first + count <= len(column):
            raise ValueError(f"frame {frame} has rows {first} to {first + count} of {name}, which has {len(column)}")
    needed = sum(count * column.dtype.itemsize * math.prod(column.shape[1:]) for column in columns.values())
    check_free(2 * needed, f"frame {frame}")
    return {name: column[first : first + count] for name, column in columns.items()}


def fitting(rows: Rows, columns: Columns, what: str) -> Rows:
    """Return the rows of a table; raises `ValueError` where a column is not of its kind and width, or not finite."""
    for name, (kind, width) in columns.items():
        found = rows[name]
        if found.dtype.kind != np.dtype(kind).kind or found.shape[1:] != width:
            raise ValueError(
                f"{what}/{name} is {found.dtype} {[*found.shape]}; rows of {np.dtype(kind)} {[*width]} are needed"
            )
        if found.dtype.kind == "f" and not np.isfinite(found).all():
            raise ValueError(f"{what}/{name} holds numbers that are not finite")
    return rows


def frames_of(path: str | Path, read: Callable[[Any, int], Any], counter: str, first: int = 0) -> Iterator[Any]:
    """Yield what `read` makes of each frame of a file, from the one with the number `first` on."""
    with open_hdf5(path) as file:
        with damaged(path):
            frames = int(file.attrs[counter])
        for frame in range(first, frames):
            with damaged(path):
                one = read(file, frame)
            yield one
