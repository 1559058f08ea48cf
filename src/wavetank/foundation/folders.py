"""Where this system keeps what belongs to a user of this program."""

import os
import sys
from pathlib import Path


def data_folder() -> Path:
    """Return the folder of what is to stay, such as high scores; `WAVETANK_DATA` says otherwise."""
    if own := os.environ.get("WAVETANK_DATA"):
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "wavetank"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Application Support" / "wavetank"
    # XDG asks to ignore a path that is not absolute.
    base = Path(os.environ.get("XDG_DATA_HOME") or "")
    return (base if base.is_absolute() else Path.home() / ".local" / "share") / "wavetank"


def cache_folder() -> Path:
    """Return the folder of what can be made again at any time; `WAVETANK_CACHE` says otherwise."""
    if own := os.environ.get("WAVETANK_CACHE"):
        return Path(own)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "wavetank"
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "wavetank"
    base = Path(os.environ.get("XDG_CACHE_HOME") or "")
    return (base if base.is_absolute() else Path.home() / ".cache") / "wavetank"
