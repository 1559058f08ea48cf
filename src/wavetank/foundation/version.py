"""The version of this package, as it is installed."""

import importlib.metadata

VERSION = importlib.metadata.version("wavetank")
