"""Every test computes on the CPU back end, started once."""

import pytest

from wavetank.device import compiler


@pytest.fixture(scope="session", autouse=True)
def cpu() -> str:
    return compiler.start("cpu")
