"""What the plots of this room share. matplotlib is optional and imported when it is asked for."""

from typing import Any

from wavetank.foundation.errors import WavetankError

BLUE, RED = "#1f6f8b", "#c8553d"


def pyplot() -> Any:
    """Return matplotlib's pyplot, drawing without a screen; raises `WavetankError` if it is not installed."""
    try:
        import matplotlib
    except ImportError:
        raise WavetankError("plots need matplotlib; install it with `pip install 'wavetank[plot]'`.") from None
    matplotlib.use("Agg")
    from matplotlib import pyplot

    return pyplot


def tidy(axis: Any) -> None:
    """Give an axis the look of all plots: a faint grid and no frame on the open sides."""
    axis.grid(alpha=0.25)
    axis.spines[["top", "right"]].set_visible(False)
