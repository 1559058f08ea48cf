"""The environment that SPlisHSPlasH's wheel lives in: its own, because its numpy and ours need not agree."""

import os
import subprocess
import sys
import venv
from collections.abc import Callable
from pathlib import Path

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.folders import cache_folder

PACKAGE = "pysplishsplash==2.19.0"
#: A Python that has the package already, for who wants another version or a build of their own.
VARIABLE = "WAVETANK_SPLISHSPLASH_PYTHON"


def splishsplash_python(say: Callable[[str], None]) -> Path:
    """Return a Python that has pysplishsplash; the first time, make an environment and install it there.

    Raises `WavetankError` where that fails, for example on a system that the package has no wheel for.
    """
    if chosen := os.environ.get(VARIABLE):
        python = Path(chosen)
        if not python.is_file():
            raise WavetankError(f"{VARIABLE} = {chosen!r} is not a file; it must be a Python that has pysplishsplash.")
        return python
    folder = cache_folder() / PACKAGE.replace("==", "-")
    python = folder / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    ready = folder / "ready"
    if ready.exists() and python.exists():
        return python
    say(f"installing {PACKAGE} into an environment of its own (once)")
    try:
        venv.create(folder, clear=True, with_pip=True)
        subprocess.run(
            [
                str(python),
                "-m",
                "pip",
                "install",
                "--quiet",
                "--disable-pip-version-check",
                "--only-binary",
                ":all:",
                PACKAGE,
                "numpy",
            ],
            check=True,
            capture_output=True,
            text=True,
            timeout=900,
        )
        ready.touch()
    except (OSError, subprocess.SubprocessError) as error:
        lines = (getattr(error, "stderr", "") or str(error)).strip().splitlines() or ["no message"]
        raise WavetankError(
            f"this comparison needs {PACKAGE}, which could not be installed here: {lines[-1]}; "
            f"set {VARIABLE} to a Python that has it."
        ) from None
    return python
