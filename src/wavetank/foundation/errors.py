"""The exception that a user's mistake raises, and its one special case."""


class WavetankError(Exception):
    """A user's mistake, in one sentence: what was wrong, where, what is allowed, what to do."""


class NotFiniteError(WavetankError):
    """The state is non-finite (NaN, inf) and cannot be continued; keep the one before."""
