"""The door for what comes from outside: size, depth, count and finiteness, before it is parsed deeply or allocated.

Scenes, states, checkpoints, recordings, meshes and messages are read by the functions of this file and by no others.
What they refuse they refuse in one sentence; `guarded` makes one of any error that nobody thought of, and where
WAVETANK_STRICT_DOOR is set, as fuzzers do, lets it through, because then it is a bug to find.
"""

import ast
import contextlib
import functools
import io
import json
import math
import os
import re
import stat
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any
from xml.etree import ElementTree

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import free_memory, in_words

BLOCK = 1 << 22  # bytes that are read at once
LARGEST_TEXT = 200_000_000  # bytes of a scene or a recording: a million particles one by one
DEEPEST = 40  # arrays, tables and dotted keys within each other
MOST_VALUES = 20_000_000  # numbers, texts, tables of a text
LARGEST_INTEGER = 2**63  # what TOML promises to keep (TOML 1.0, integers)
LONGEST_HEADER = 4096  # characters that describe an array in a file (NumPy's own write some hundred)
MOST_ARRAYS = 200  # in an archive
LARGEST_JSON = 64_000_000  # characters of a header
UNPACKED = 64_000_000  # bytes that an archive may unpack to whatever its size, and
TIMES = 20  # as many times its size

# What opens and closes, keys with very many dots, numbers with very many digits: all outside of texts and remarks. No
# branch goes over a piece twice.
_STRUCTURE = re.compile(
    r"""(?P<dots>(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){40})|"""
    r'''"""(?:[^"\\]|\\.|"(?!""))*+(?:""")?|'''
    r"""'''(?:[^']|'(?!''))*+(?:''')?|"""
    r"""(?P<digits>(?<![\w.])(?:0[xob])?[0-9a-fA-F_]{600})|"""
    r""""(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?|#[^\n]*+|(?P<opens>[\[{])|(?P<closes>[\]}])""",
    re.DOTALL,
)


def named(path: Any) -> str:
    """Return a path as messages tell it: in one line, whatever its name."""
    text = str(path)
    return text if text.isprintable() and len(text) <= 300 else repr(text[:300])


@contextlib.contextmanager
def guarded(origin: str, what: str) -> Iterator[None]:
    """Make one sentence of every error within that is none of ours; it begins with `origin` and says `what` is read."""
    try:
        yield
    except WavetankError as error:
        text = " ".join(str(error).split("\n"))
        if text == str(error):
            raise
        raise WavetankError(text) from None
    except MemoryError:
        raise WavetankError(f"{origin}: there is not enough memory for this {what}.") from None
    except Exception as error:
        if os.environ.get("WAVETANK_STRICT_DOOR"):
            raise
        reason = " ".join((str(error) or "no reason given").split())[:200].rstrip(".")
        raise WavetankError(f"{origin}: this {what} cannot be read: {type(error).__name__}, {reason}.") from None
    except BaseException as error:  # compiled packages raise what is not an Exception where they give up
        if type(error).__name__ != "PanicException":
            raise
        raise WavetankError(f"{origin}: this {what} cannot be read: it is damaged.") from None


def opened(path: str | Path, most: int, what: str) -> IO[bytes]:
    """Open a regular file of at most `most` bytes; raises `WavetankError` for all else, and never waits for a pipe."""
    name = named(path)
    try:
        file = os.fdopen(os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb")
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise WavetankError(f"{name}: the {what} cannot be read: {reason}.") from None
    try:
        about = os.fstat(file.fileno())
        if not stat.S_ISREG(about.st_mode):
            kind = "a folder" if stat.S_ISDIR(about.st_mode) else "a pipe, a socket or a device"
            raise WavetankError(f"{name}: the {what} cannot be read: this is {kind}; name a file.")
        if about.st_size > most:
            raise WavetankError(
                f"{name}: the {what} cannot be read: it has {in_words(about.st_size)}; at most {in_words(most)} are "
                "allowed."
            )
    except BaseException:
        file.close()
        raise
    return file


def read_bytes(path: str | Path, most: int, what: str) -> bytes:
    """Return what is in a regular file of at most `most` bytes; raises `WavetankError`."""
    with opened(path, most, what) as file:
        try:
            blocks, left = [], most
            while left and (block := file.read(min(left, BLOCK))):  # room for all that is allowed is not taken at once
                blocks.append(block)
                left -= len(block)
            return b"".join(blocks)
        except OSError as error:
            raise WavetankError(f"{named(path)}: the {what} cannot be read: {error.strerror or error}.") from None


def read_text(path: str | Path, what: str, most: int = LARGEST_TEXT) -> str:
    """Return the UTF-8 text of a regular file; raises `WavetankError`."""
    try:
        return read_bytes(path, most, what).decode("utf-8")
    except UnicodeDecodeError as error:
        raise WavetankError(f"{named(path)}: the {what} cannot be read: it is no text in UTF-8: {error}.") from None


def parse_toml(text: str, origin: str, what: str = "this") -> dict[str, Any]:
    """Return what a TOML text says; raises `WavetankError` for what is none, too deep, too long or too much."""

    def load(text: str) -> dict[str, Any]:
        _check_structure(text, origin)
        return tomllib.loads(text)

    return _parse(load, text, f"{origin}: this", f"{origin}: {what} is not TOML", LARGEST_TEXT, origin)


def parse_json(text: str | bytes, origin: str, most: int = LARGEST_JSON) -> Any:
    """Return what a JSON text says; raises `WavetankError` for what is none, too deep, or holds NaN."""

    def refuse(name: str) -> None:
        raise WavetankError(f"{origin} holds {name}; every number must be finite.")

    load = functools.partial(json.loads, parse_constant=refuse)
    return _parse(load, text, origin, f"{origin} is not JSON", most, origin)


def parse_xml(text: str, origin: str, what: str) -> ElementTree.Element:
    """Return the top element of XML without a document type, which may name other files and grow without end."""
    if "<!" in text.replace("<!--", ""):
        raise WavetankError(f"{origin}: a document type is not read; {what} has none.")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise WavetankError(f"{origin}: this is no XML: {error}.") from None


def _parse(load: Callable[[Any], Any], text: str | bytes, subject: str, refused: str, most: int, origin: str) -> Any:
    """Return what a parser makes of a text of at most `most` characters; its errors begin with `refused`."""
    if len(text) > most:
        raise WavetankError(f"{subject} has {len(text):,} characters; at most {most:,} are allowed.")
    try:
        plain = load(text)
    except RecursionError:
        raise WavetankError(
            f"{subject} is nested more than {DEEPEST} deep; at most so many levels are allowed."
        ) from None
    except ValueError as error:  # errors of both parsers are
        raise WavetankError(f"{refused}: {one_line(error)}.") from None
    check_plain(plain, origin)
    return plain


def _check_structure(text: str, origin: str) -> None:
    """Look over brackets, dots and digits of a TOML text before it is parsed."""
    depth = 0
    for match in _STRUCTURE.finditer(text):
        kind = match.lastgroup
        if kind is None:
            continue
        depth += (kind == "opens") - (kind == "closes")
        if depth > DEEPEST or kind in ("dots", "digits"):
            line = text.count("\n", 0, match.start()) + 1
            if kind == "digits":
                raise WavetankError(f"{origin}: a number in line {line} has more than 600 digits; none needs so many.")
            raise WavetankError(
                f"{origin}: line {line} is nested more than {DEEPEST} deep; so many levels are allowed."
            )


def check_plain(plain: Any, origin: str) -> None:
    """Check depth, number and integers of plain data without going into its depth; raises `WavetankError`."""
    level, count = [plain], 0
    for _ in range(DEEPEST + 1):
        below: list[Any] = []
        count += len(level)
        if count > MOST_VALUES:
            raise WavetankError(f"{origin} holds more than {MOST_VALUES:,} values.")
        for value in level:
            if isinstance(value, dict):
                for key in value:
                    _check_word(key, origin)
                below.extend(value.values())
            elif isinstance(value, list):
                below.extend(value)
            elif isinstance(value, int):
                if not -LARGEST_INTEGER <= value < LARGEST_INTEGER:
                    raise WavetankError(f"{origin} holds a whole number that does not fit into 64 bits.")
            elif isinstance(value, str):
                _check_word(value, origin)
        if not below:
            return
        level = below
    raise WavetankError(f"{origin} is nested more than {DEEPEST} deep; at most so many levels are allowed.")


def _check_word(text: Any, origin: str) -> None:
    """Refuse halves of characters, which no file can hold."""
    if isinstance(text, str) and not text.isascii():
        try:
            text.encode()
        except UnicodeEncodeError:
            raise WavetankError(f"{origin} holds half of a character (a lone surrogate); write it whole.") from None


def one_line(error: Any, most: int = 300) -> str:
    """Return a message in one line of bounded length, without its last dot."""
    text = " ".join(str(error).split())
    return (text if len(text) <= most else text[: most - 3] + "...").rstrip(".")


# --- arrays ---


def read_arrays(path: str | Path, what: str) -> dict[str, np.ndarray]:
    """Return the arrays of a .npz file by name; raises `WavetankError` for what is none or costs too much.

    Sizes are read off the headers and compared with those of the file and of free memory before anything is unpacked.
    """
    file = opened(path, 2**48, what)
    with file:
        size = os.fstat(file.fileno()).st_size
        return unpack(file, size, f"{named(path)}: this is not a {what}")


def unpack(file: IO[bytes], size: int, origin: str) -> dict[str, np.ndarray]:
    """Return the arrays of an open archive of `size` bytes; raises `WavetankError` that begins with `origin`."""
    try:
        with zipfile.ZipFile(file) as archive:
            entries = archive.infolist()
            if len(entries) > MOST_ARRAYS:
                raise WavetankError(f"{origin}: it holds {len(entries):,} arrays; at most {MOST_ARRAYS} are allowed.")
            total, most = sum(entry.file_size for entry in entries), max(UNPACKED, TIMES * size)
            if total > most:
                raise WavetankError(
                    f"{origin}: it unpacks to {in_words(total)}; a file of this size may hold {in_words(most)}."
                )
            if (free := free_memory()) is not None and 2 * total > free:
                raise WavetankError(f"{origin}: it needs {in_words(2 * total)} of memory; {in_words(free)} are free.")
            arrays = {}
            for entry in entries:
                with archive.open(entry) as member:
                    arrays[entry.filename.removesuffix(".npy")] = read_array(
                        member, entry.file_size, origin, entry.filename
                    )
            return arrays
    except WavetankError:
        raise
    except OSError as error:
        raise WavetankError(f"{origin}: {one_line(error.strerror or error)}.") from None
    except (zipfile.BadZipFile, EOFError, ValueError, RuntimeError, NotImplementedError, KeyError) as error:
        raise WavetankError(f"{origin}: {one_line(error)}.") from None
    except Exception as error:  # a damaged archive fails in as many ways as there are ways to pack
        raise WavetankError(f"{origin}: {type(error).__name__}, {one_line(error)}.") from None


def read_array(member: IO[bytes], size: int, origin: str, name: str) -> np.ndarray:
    """Return the array of a .npy stream of `size` bytes (NEP 1); no bytes are made that are not there."""

    def refuse(why: str) -> WavetankError:
        return WavetankError(f"{origin}: {one_line(repr(name), 60)} {why}.")

    start = member.read(8)
    if len(start) < 8 or start[:6] != b"\x93NUMPY" or start[6] not in (1, 2, 3):
        raise refuse("is no array")
    width = 2 if start[6] == 1 else 4
    length = int.from_bytes(member.read(width), "little")
    if length > LONGEST_HEADER:
        raise refuse("has a header that is too long")
    try:
        about = ast.literal_eval(member.read(length).decode("latin-1").strip())
        shape, kind, turned = about["shape"], np.dtype(about["descr"]), about["fortran_order"]
        shape = tuple(shape)
        whole = all(type(n) is int and 0 <= n < 2**48 for n in shape) and len(shape) <= 8
    except (SyntaxError, ValueError, TypeError, KeyError, RecursionError, MemoryError):
        raise refuse("has a header that cannot be read") from None
    if kind.hasobject:
        raise refuse("holds objects, not arrays")
    if not whole or kind.kind not in "fiubU" or kind.subdtype is not None or turned not in (True, False):
        raise refuse("is no array of numbers")
    needed = math.prod(shape) * kind.itemsize  # in Python's integers, which know no end
    if needed != size - 8 - width - length:
        raise refuse("does not have the size that its header says")
    data = member.read(needed)
    if len(data) != needed or member.read(1):  # looked beyond the end, archives compare their check sums
        raise refuse("ends too early or too late")
    array = np.frombuffer(bytearray(data), kind) if kind.itemsize else np.empty(0, kind)
    if kind.itemsize == 0:
        array = np.zeros(shape, kind)
    return array.reshape(shape[::-1]).T if turned else array.reshape(shape)


def unpack_text(data: bytes, origin: str) -> dict[str, np.ndarray]:
    """Return the arrays of an archive that a scene holds as text; raises `WavetankError`."""
    return unpack(io.BytesIO(data), len(data), origin)
