"""What is read from a swing about zero: its period, and how much of its height is kept."""

import itertools
import math

import numpy as np


def crossings(t: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return the times [s] at which the samples `a`, of times `t` [s], pass zero, interpolated; float64 [m]."""
    k = np.flatnonzero(np.sign(a[1:]) != np.sign(a[:-1]))
    return t[k] - a[k] * (t[k + 1] - t[k]) / (a[k + 1] - a[k])


def period(t: np.ndarray, a: np.ndarray) -> float:
    """Return the period [s], twice the mean time between neighbouring zeros; NaN with fewer than two of them."""
    zeros = crossings(t, a)
    return 2.0 * float(zeros[-1] - zeros[0]) / (len(zeros) - 1) if len(zeros) > 1 else math.nan


def heights(t: np.ndarray, a: np.ndarray) -> np.ndarray:
    """Return the largest |a| between each pair of neighbouring zeros, half a period apart; float64 [zeros - 1]."""
    pairs = itertools.pairwise(crossings(t, a))
    return np.array([np.abs(a[(t > low) & (t < high)]).max(initial=0.0) for low, high in pairs])


def kept(t: np.ndarray, a: np.ndarray) -> float:
    """Return the share of its height that the swing keeps in a period: that of its last peak over its first.

    NaN with fewer than two peaks.
    """
    peaks = heights(t, a)
    return float(peaks[-1] / peaks[0]) ** (2.0 / (len(peaks) - 1)) if len(peaks) > 1 else math.nan
