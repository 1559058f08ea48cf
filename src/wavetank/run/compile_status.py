"""A line on a terminal that counts the kernels being compiled, where else nothing would be seen for tens of seconds."""

import contextlib
from collections.abc import Iterator

from rich.console import Console

from wavetank.device.compiler import on_compile


@contextlib.contextmanager
def compile_status(console: Console) -> Iterator[None]:
    """Show the number of kernels compiled so far while the context lasts; nothing where `console` is not a terminal."""
    if not console.is_terminal:
        yield
        return
    with (
        console.status("starting") as status,
        on_compile(lambda number, _: status.update(f"compiling kernel {number}")),
    ):
        yield
