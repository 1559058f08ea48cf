"""The exception that a user's mistake raises, and its special cases."""


class WavetankError(Exception):
    """A user's mistake, in one sentence: what was wrong, where, what is allowed, what to do."""


class NoAttributeError(WavetankError, AttributeError):
    """An attribute that is not there, or that cannot be set."""


class NotFiniteError(WavetankError):
    """The state is non-finite (NaN, inf) and cannot be continued; keep the one before."""
