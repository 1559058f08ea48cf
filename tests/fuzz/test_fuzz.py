"""Some hundred mutations of everything that comes from outside, other ones in each run: see `long.py` for many."""

import contextlib
import os

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis.errors import FlakyStrategyDefinition
from inputs import INPUTS

SHARES = {
    "scene": 40,
    "repetition": 6,
    "state": 25,
    "message": 80,
    "watcher": 80,
    "recording": 25,
    "mesh": 25,
    "checkpoint": 20,
    "run": 30,
    "robot": 30,
    "inclusion": 30,
    "other": 30,
    "case": 30,
    "particles": 30,
}
TIMES = int(os.environ.get("WAVETANK_FUZZ_TIMES", "1"))


@pytest.mark.parametrize("name", INPUTS)
def test_only_sentences_of_ours_and_worlds_that_work(name, monkeypatch):
    monkeypatch.setenv("WAVETANK_STRICT_INPUT", "1")
    inputs, attempt = INPUTS[name]

    @settings(max_examples=SHARES[name] * TIMES, deadline=None, database=None, suppress_health_check=list(HealthCheck))
    @given(inputs)
    def attack(given_input):
        attempt(given_input)

    with contextlib.suppress(FlakyStrategyDefinition):  # archives hold the time of day
        attack()
