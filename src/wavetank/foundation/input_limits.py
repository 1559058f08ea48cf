"""Read what comes from outside: limits of size, depth, count and finiteness before anything is parsed or allocated.

Scenes, states, checkpoints, recordings, meshes and messages are read by the functions of this file only. tomllib, json,
ElementTree and NumPy parse; what is here bounds what they are given and makes one sentence of what they raise.
`explain_errors` does so for any other error too, and lets it pass where WAVETANK_STRICT_INPUT is set, as fuzzers do,
because then it is a bug to find.
"""

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
from tokenize import TokenError
from typing import IO, Any
from xml.etree import ElementTree

import numpy as np
from numpy.lib import format as npy

from wavetank.foundation.arguments import path_of
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import free_memory, in_words

LARGEST_TEXT = 200_000_000  # bytes of a scene or a recording: a million particles one by one
DEEPEST = 40  # arrays, tables and dotted keys within each other
MOST_VALUES = 20_000_000  # numbers, texts, tables of a text
LARGEST_INTEGER = 2**63  # what TOML promises to keep (TOML 1.0, integers)
LONGEST_HEADER = 4096  # characters that describe an array in a file (NumPy writes about a hundred)
MOST_ARRAYS = 200  # in an archive
LARGEST_JSON = 64_000_000  # characters of a header
UNPACKED = 64_000_000  # bytes that an archive may unpack to whatever its size, and
TIMES = 20  # as many times its size

# Keys of more than 40 parts, for which tomllib takes time and memory that grow with the square of their number; and the
# strings and comments in which they do not count. No branch goes over a piece twice.
_LONG_KEYS = re.compile(
    r"""(?P<key>(?<![\w.-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){40})|"""
    r'''"""(?:[^"\\]|\\.|"(?!""))*+(?:""")?|'''
    r"""'''(?:[^']|'(?!''))*+(?:''')?|"""
    r""""(?:[^"\\\n]|\\.)*+"?|'[^'\n]*+'?|#[^\n]*+""",
    re.DOTALL,
)


def printable(path: Any) -> str:
    """Return a path as messages show it: in one line, whatever its name."""
    text = str(path)
    return text if text.isprintable() and len(text) <= 300 else repr(text[:300])


def visible(text: str) -> str:
    """Return a text for a terminal, where a character that cannot be seen is written as its escape."""
    return "".join(letter if letter.isprintable() else repr(letter)[1:-1] for letter in text)


def why_unreadable(error: Exception) -> str:
    """Return in plain words why an importer could not go on: what a library raises is not for users."""
    if isinstance(error, WavetankError):
        return str(error)
    if isinstance(error, KeyError):
        return f"{one_line(error, 60)} is missing"
    if isinstance(error, OSError):
        return one_line(error.strerror or error)
    value = re.search(r": ('.*')$", one_line(error)) if isinstance(error, ValueError) else None
    if value:
        return f"{value[1]} is not of the kind that its place needs"
    return "a value is missing, or not of the kind that its place needs"


@contextlib.contextmanager
def explain_errors(origin: str, what: str) -> Iterator[None]:
    """Raise every error within as a `WavetankError` of one line, which begins with `origin` and says `what` is read."""
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
        if os.environ.get("WAVETANK_STRICT_INPUT"):
            raise
        reason = " ".join((str(error) or "no reason given").split())[:200].rstrip(".")
        raise WavetankError(f"{origin}: this {what} cannot be read: {type(error).__name__}, {reason}.") from None
    except BaseException as error:  # compiled packages raise what is not an Exception where they give up
        if type(error).__name__ != "PanicException":
            raise
        raise WavetankError(f"{origin}: this {what} cannot be read: it is damaged.") from None


def open_regular(path: str | Path, most: int, what: str) -> IO[bytes]:
    """Open a regular file of at most `most` bytes; raises `WavetankError` for all else, and never waits for a pipe."""
    name = printable(path)
    try:
        file = os.fdopen(
            os.open(path_of(path, what), os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)), "rb"
        )
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
    with open_regular(path, most, what) as file:
        try:
            return file.read()
        except OSError as error:
            raise WavetankError(f"{printable(path)}: the {what} cannot be read: {error.strerror or error}.") from None


def read_text(path: str | Path, what: str, most: int = LARGEST_TEXT) -> str:
    """Return the UTF-8 text of a regular file; raises `WavetankError`."""
    try:
        return read_bytes(path, most, what).decode("utf-8")
    except UnicodeDecodeError as error:
        raise WavetankError(f"{printable(path)}: the {what} cannot be read: it is not UTF-8 text: {error}.") from None


def parse_toml(text: str, origin: str, what: str = "this") -> dict[str, Any]:
    """Parse TOML; raises `WavetankError` for text that is not TOML, too long, too deep or has too many values."""

    def load(text: str) -> dict[str, Any]:
        long = next((match for match in _LONG_KEYS.finditer(text) if match["key"]), None)
        if long:
            line = text.count("\n", 0, long.start()) + 1
            raise WavetankError(f"{origin}: line {line} is nested more than {DEEPEST} deep, which is the limit.")
        return tomllib.loads(text)

    return _parse(load, text, f"{origin}: this", f"{origin}: {what} is not TOML", LARGEST_TEXT, origin)


def parse_json(text: str | bytes, origin: str, most: int = LARGEST_JSON) -> Any:
    """Parse JSON; raises `WavetankError` for text that is not JSON, too long, too deep, or holds NaN."""

    def refuse(name: str) -> None:
        raise WavetankError(f"{origin} holds {name}; every number must be finite.")

    load = functools.partial(json.loads, parse_constant=refuse)
    return _parse(load, text, origin, f"{origin} is not JSON", most, origin)


def parse_xml(text: str, origin: str, what: str) -> ElementTree.Element:
    """Parse XML without a document type, which could name other files and expand without limit; return its root."""
    if "<!" in text.replace("<!--", ""):
        raise WavetankError(f"{origin}: a document type is not read; {what} has none.")
    try:
        return ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise WavetankError(f"{origin}: this is not XML: {error}.") from None


def _parse(load: Callable[[Any], Any], text: str | bytes, subject: str, refused: str, most: int, origin: str) -> Any:
    """Return what a parser makes of a text of at most `most` characters; its errors begin with `refused`."""
    if len(text) > most:
        raise WavetankError(f"{subject} has {len(text):,} characters; at most {most:,} are allowed.")
    try:
        plain = load(text)
    except RecursionError:
        raise WavetankError(f"{subject} is nested more than {DEEPEST} deep, which is the limit.") from None
    except ValueError as error:  # what both parsers raise
        raise WavetankError(f"{refused}: {one_line(error)}.") from None
    check_plain(plain, origin)
    return plain


def check_plain(plain: Any, origin: str) -> None:
    """Check depth, number of values and size of integers of plain data, level by level; raises `WavetankError`."""
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
                    raise WavetankError(f"{origin} holds an integer that does not fit into 64 bits.")
            elif isinstance(value, str):
                _check_word(value, origin)
        if not below:
            return
        level = below
    raise WavetankError(f"{origin} is nested more than {DEEPEST} deep, which is the limit.")


def _check_word(text: Any, origin: str) -> None:
    """Refuse lone surrogates, which UTF-8 cannot encode."""
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
    """Return the arrays of a .npz file by name; raises `WavetankError` for another file or one that is too large.

    Sizes are read off the headers and compared with those of the file and of free memory before anything is unpacked.
    """
    file = open_regular(path, 2**48, what)
    with file:
        size = os.fstat(file.fileno()).st_size
        return unpack_arrays(file, size, f"{printable(path)}: this is not a {what}")


def unpack_arrays(file: IO[bytes], size: int, origin: str) -> dict[str, np.ndarray]:
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
    except Exception as error:  # each compression fails in ways of its own
        raise WavetankError(f"{origin}: {type(error).__name__}, {one_line(error)}.") from None


def read_array(member: IO[bytes], size: int, origin: str, name: str) -> np.ndarray:
    """Return the array of a .npy stream of `size` bytes (NEP 1); allocates no more than the stream holds.

    `numpy.load` would allocate what the header says before it reads.
    """

    def refuse(why: str) -> WavetankError:
        return WavetankError(f"{origin}: {one_line(repr(name), 60)} {why}.")

    try:
        version = npy.read_magic(member)
        read_header = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
        shape, fortran, kind = read_header(member, max_header_size=LONGEST_HEADER)
    except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError, TokenError) as error:
        raise refuse(f"is not an array: {one_line(error)}") from None
    if kind.hasobject:
        raise refuse("holds objects, not arrays")
    if kind.kind not in "fiubU" or kind.subdtype is not None or len(shape) > 8 or min(shape, default=0) < 0:
        raise refuse("is not an array of numbers")
    needed = math.prod(map(int, shape)) * kind.itemsize
    if not kind.itemsize:  # empty texts
        raise refuse("is not an array of numbers")
    data = member.read(min(needed, size) + 1)  # past the end, where archives compare checksums
    if len(data) != needed:
        raise refuse("does not have the size that its header says")
    return np.frombuffer(bytearray(data), kind).reshape(shape, order="F" if fortran else "C")


def unpack_text(data: bytes, origin: str) -> dict[str, np.ndarray]:
    """Return the arrays of an archive that a scene holds as text; raises `WavetankError`."""
    return unpack_arrays(io.BytesIO(data), len(data), origin)
