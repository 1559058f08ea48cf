"""Folders for a user's data and caches."""

import os
from pathlib import Path

import platformdirs

NAME = "wavetank"
#: of earlier versions on macOS, which ignored XDG_DATA_HOME
EARLIER = Path("Library", "Application Support", NAME)


def data_folder() -> Path:
    """Return the folder of persistent data, such as high scores; `WAVETANK_DATA` overrides it."""
    if own := os.environ.get("WAVETANK_DATA"):
        return Path(own)
    folder, earlier = platformdirs.user_data_path(NAME, appauthor=False), Path.home() / EARLIER
    return earlier if earlier.is_dir() and not folder.is_dir() else folder


def cache_folder() -> Path:
    """Return the folder of what can be recomputed at any time; `WAVETANK_CACHE` overrides it."""
    if own := os.environ.get("WAVETANK_CACHE"):
        return Path(own)
    return platformdirs.user_cache_path(NAME, appauthor=False, opinion=False)
