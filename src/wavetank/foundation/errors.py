"""The one exception that a user's mistake raises."""


class WavetankError(Exception):
    """A mistake in what was asked for: one sentence that says what, where, what is allowed and what to do."""
