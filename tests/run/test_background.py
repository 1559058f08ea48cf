import errno
import threading
import time

import pytest

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.retry import Retry
from wavetank.run import background
from wavetank.run.background import BackgroundWriter


def test_all_is_done_in_order_and_memory_is_bounded(monkeypatch):
    monkeypatch.setattr(background, "MOST_BYTES", 100)
    writer, done, gate, held = BackgroundWriter(), [], threading.Event(), []

    def job(number):
        gate.wait(10)
        done.append(number)

    def feed():
        for number in range(20):
            writer.put(lambda number=number: job(number), 40)
            held.append(number + 1 - len(done))

    thread = threading.Thread(target=feed)
    thread.start()
    time.sleep(0.2)
    assert len(held) == 2, "a third frame of 40 bytes finds no room in 100"
    gate.set()
    thread.join(10)
    writer.finish()
    assert done == [*range(20)]
    assert max(held) <= 4
    assert writer.waited > 0.1


def test_one_frame_may_be_larger_than_the_room(monkeypatch):
    monkeypatch.setattr(background, "MOST_BYTES", 100)
    writer, done = BackgroundWriter(), []
    for number in range(3):
        writer.put(lambda number=number: done.append(number), 1000)
    writer.drain()
    assert done == [0, 1, 2]
    writer.finish()


def test_what_goes_wrong_reaches_who_writes():
    writer = BackgroundWriter()

    def fail():
        raise WavetankError("the disk is gone.")

    writer.put(fail, 1)
    with pytest.raises(WavetankError, match="gone"):
        writer.drain()
    writer.put(fail, 1)
    with pytest.raises(WavetankError, match="gone"):
        writer.finish()


def test_a_full_disk_is_waited_for_and_told_once():
    told, tries = [], []

    def write():
        tries.append(1)
        if len(tries) < 4:
            try:
                raise OSError(errno.ENOSPC, "No space left on device")
            except OSError as error:
                raise WavetankError("'a.npz' cannot be written: No space left on device.") from error
        return "done"

    assert Retry(told.append).call(write) == "done"
    assert len(tries) == 4
    assert told == ["waiting, and trying again for 60 s: 'a.npz' cannot be written: No space left on device."]


def test_what_does_not_pass_is_not_tried_again():
    tries = []

    def write():
        tries.append(1)
        raise OSError(errno.EACCES, "Permission denied")

    with pytest.raises(OSError, match="Permission"):
        Retry().call(write)
    assert len(tries) == 1
    with pytest.raises(OSError, match="space"):
        Retry(longest=0.0).call(lambda: (_ for _ in ()).throw(OSError(errno.ENOSPC, "no space")))
