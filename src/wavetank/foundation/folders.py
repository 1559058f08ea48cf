"""Where this system keeps what belongs to a user of this program."""

import os
from pathlib import Path

import platformdirs

NAME = "wavetank"
#: where files were kept before on macOS, whatever XDG_DATA_HOME says
EARLIER = Path("Library", "Application Support", NAME)


def data_folder() -> Path:
    """Return the folder of what is to stay, such as high scores; `WAVETANK_DATA` says otherwise."""
    if own := os.environ.get("WAVETANK_DATA"):
        return Path(own)
    folder, earlier = platformdirs.user_data_path(NAME, appauthor=False), Path.home() / EARLIER
    return earlier if earlier.is_dir() and not folder.is_dir() else folder


def cache_folder() -> Path:
    """Return the folder of what can be made again at any time; `WAVETANK_CACHE` says otherwise."""
    if own := os.environ.get("WAVETANK_CACHE"):
        return Path(own)
    return platformdirs.user_cache_path(NAME, appauthor=False, opinion=False)
