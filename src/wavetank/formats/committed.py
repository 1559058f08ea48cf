"""A file that others can open at any moment while it grows, and after a kill: copy-on-write below HDF5.

Data beyond the committed end go to disk at once, where no reader looks yet. Changes before it (object headers, B-tree
nodes) stay in memory until `commit`, which writes them together, the first page first: its superblock has the length.

HDF5's own means do less. SWMR marks the file as being written; a kill leaves the mark, and nothing opens it then.
`flush` writes metadata in any order. Copying to a temporary name writes the whole file each time. A virtual dataset
over one file per frame is rewritten for each frame, and readers open them all.
"""

from pathlib import Path

from wavetank.foundation.atomic_write import partial_path
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.retry import Retry

PAGE = 16384  # bytes


class CommittedFile:
    """A file object for h5py. It gets its name with the first `commit`."""

    def __init__(self, path: str | Path, retry: Retry) -> None:
        self.path, self.retry = Path(path), retry
        self._partial: Path | None = partial_path(path)
        try:
            self._file = self._partial.open("w+b", buffering=0)
        except OSError as error:
            raise WavetankError(f"{str(path)!r} cannot be written: {error.strerror or error}.") from error
        self._place = 0  # position of the next read or write
        self._size = 0  # bytes, as the writer sees it
        self._known = 0  # bytes that are committed
        self._pages: dict[int, bytearray] = {}  # changed since, before `_known`

    # --- the file object ---

    def seek(self, offset: int, whence: int = 0) -> int:
        """Set the position, as of any file."""
        self._place = offset + (0, self._place, self._size)[whence]
        return self._place

    def tell(self) -> int:
        """Return the position."""
        return self._place

    def read(self, length: int) -> bytes:
        """Return `length` bytes from the current position."""
        result = bytearray(length)
        self.readinto(memoryview(result))
        return bytes(result)

    def readinto(self, buffer: memoryview) -> int:
        """Fill `buffer` from the current position; zeros beyond the end."""
        view = memoryview(buffer).cast("B")
        at, length = self._place, len(view)
        found = self._get(length, at)
        view[: len(found)] = found
        view[len(found) :] = bytes(length - len(found))
        for page in range(at // PAGE, (at + length - 1) // PAGE + 1) if self._pages else ():
            if page in self._pages:
                start, end = max(at, page * PAGE), min(at + length, (page + 1) * PAGE)
                view[start - at : end - at] = self._pages[page][start - page * PAGE : end - page * PAGE]
        self._place += length
        return length

    def write(self, data: memoryview) -> int:
        """Write at the current position: to disk beyond the committed end, else to memory."""
        view = memoryview(data).cast("B")
        at, end = self._place, self._place + len(view)
        while at < min(end, self._known):
            page = at // PAGE
            stop = min(end, (page + 1) * PAGE)
            if page not in self._pages:
                old = self._get(PAGE, page * PAGE)
                self._pages[page] = bytearray(old + bytes(PAGE - len(old)))
            part = view[at - self._place : stop - self._place]
            self._pages[page][at - page * PAGE : stop - page * PAGE] = part
            at = stop
        if at < end:
            self._put(view[at - self._place :], at)
        self._place, self._size = end, max(self._size, end)
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        """Set the size; the committed part stays until `commit`."""
        self._size = self._place if size is None else size
        if self._size > self._known:
            self.retry.call(lambda: self._file.truncate(self._size))
        return self._size

    def flush(self) -> None:
        """Do nothing: `commit` writes."""

    # --- for readers ---

    def commit(self) -> None:
        """Make all that was written visible to readers."""
        pages, self._pages = self._pages, {}
        for page in sorted(pages):
            self._put(memoryview(pages[page])[: max(0, self._size - page * PAGE)], page * PAGE)
        self._known = -(-self._size // PAGE) * PAGE
        if self._partial is not None:
            self._rename(self._partial)

    def close(self) -> None:
        """Commit and close."""
        self.commit()
        self._file.truncate(self._size)
        self._file.close()

    def abandon(self) -> None:
        """Close and drop what was not committed; without any commit, the file."""
        self._file.close()
        if self._partial is not None:
            self._partial.unlink(missing_ok=True)

    def _rename(self, partial: Path) -> None:
        try:
            partial.replace(self.path)
        except OSError as error:
            raise WavetankError(f"{str(self.path)!r} cannot be written: {error.strerror or error}.") from error
        self._partial = None

    def _get(self, length: int, at: int) -> bytes:
        self._file.seek(at)
        parts = [self._file.read(length)]
        while parts[-1] and sum(map(len, parts)) < length:
            parts.append(self._file.read(length - sum(map(len, parts))))
        return b"".join(parts)

    def _put(self, view: memoryview, at: int) -> None:
        done = 0

        def put() -> None:
            nonlocal done
            while done < len(view):
                self._file.seek(at + done)
                done += self._file.write(view[done:])

        self.retry.call(put)
