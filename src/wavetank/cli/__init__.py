"""The command `wavetank`: thin, every command calls one room. A file here registers its commands by being imported."""

import io
import sys

from wavetank import WavetankError
from wavetank.cli.options import app
from wavetank.foundation.input_limits import visible

# isort: off
from wavetank.cli import running, filming, playing, converting, experiments  # noqa: F401  (the order of --help)


def main() -> None:
    """Run the command line; a mistake is one line on stderr and exit code 1, Ctrl-C exit code 130."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="surrogateescape")  # names of files need not be UTF-8
    try:
        app(standalone_mode=True)
    except SystemExit as end:
        if end.code in (129, 130, 143):
            print("wavetank: stopped.", file=sys.stderr)
        raise
    except WavetankError as error:
        print(f"wavetank: {visible(' '.join(str(error).splitlines()))}", file=sys.stderr)
        sys.exit(1)
    except (OSError, MemoryError) as error:
        place, reason = getattr(error, "filename", None), getattr(error, "strerror", None)
        print(f"wavetank: {f'{place}: {reason}.' if place else f'{type(error).__name__}: {error}'}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("wavetank: stopped.", file=sys.stderr)
        sys.exit(130)
