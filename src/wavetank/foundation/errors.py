"""The one exception that a user's mistake raises, and its one special case."""


class WavetankError(Exception):
    """A mistake in what was asked for: one sentence that says what, where, what is allowed and what to do."""


class NotFiniteError(WavetankError):
    """Water with numbers that are none, from which nothing goes on: say so, and keep what was before."""
