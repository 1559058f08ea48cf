"""JSON as its standard has it, without NaN and infinities."""

import json
import math
from typing import Any


def plain(value: Any) -> Any:
    """Return data with None for numbers that are not finite, which JSON does not have (RFC 8259, 6)."""
    if isinstance(value, dict):
        return {key: plain(member) for key, member in value.items()}
    if isinstance(value, list | tuple):
        return [plain(member) for member in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def json_text(value: Any, indent: int | None = None) -> str:
    """Return data as JSON, with null for numbers that are not finite."""
    return json.dumps(plain(value), indent=indent, allow_nan=False)
