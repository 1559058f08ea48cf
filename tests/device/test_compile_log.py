"""Who waits for kernels is told: a script by one line of its log, a terminal by a count."""

import io
import logging

import pytest
from rich.console import Console

from wavetank.device import compile_log, compiler, patches
from wavetank.device.compile_log import CompileLog
from wavetank.run.compile_status import compile_status


@pytest.fixture
def clock(monkeypatch) -> list[float]:
    now = [100.0]
    monkeypatch.setattr(compile_log.time, "monotonic", lambda: now[0])
    return now


def heard(record: CompileLog, clock: list[float], *gaps: float) -> None:
    for gap in gaps:
        clock[0] += gap
        record.hear("kernel")


def test_a_script_is_told_once_after_some_seconds(clock, caplog):
    record = CompileLog(["it alone"])
    heard(record, clock, 0.0, 1.0, 1.5)
    assert not caplog.records, "a short wait needs no word"
    heard(record, clock, 1.0, 5.0, 0.5)
    assert [line.levelno for line in caplog.records] == [logging.WARNING]
    assert "preparing kernels, 4 so far" in caplog.text


def test_kernels_that_come_one_by_one_are_no_wait(clock, caplog):
    heard(CompileLog(["it alone"]), clock, *[11.0] * 20)
    assert not caplog.records


def test_where_others_tell_people_the_log_does_not(clock, caplog):
    heard(CompileLog(["it", "a page"]), clock, *[1.0] * 20)
    assert not caplog.records


def test_a_terminal_shows_a_count():
    console = Console(file=io.StringIO(), force_terminal=True, width=60)
    with compile_status(console):
        for listener in tuple(patches.LISTENERS):
            listener("kernel")
        console.file.write("")
    compiler.start("cpu")
    assert any(isinstance(getattr(listener, "__self__", None), CompileLog) for listener in patches.LISTENERS)
