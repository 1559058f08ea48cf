"""A page that is played with: its server, its simulation in this thread's care, a browser."""

import threading

import pytest
from watcher import Watcher

import wavetank as wt
from wavetank.page.server import PageServer
from wavetank.session.session import Session


class Playing:
    """A web front that runs in a thread of its own."""

    def __init__(self, scene: wt.Scene) -> None:
        self.session = Session(scene)
        self.front = PageServer(self.session, port=0)
        self.front.start()
        self.thread = threading.Thread(target=self.front.run)
        self.thread.start()

    @property
    def base(self) -> str:
        return f"http://127.0.0.1:{self.front.port}"

    @property
    def socket(self) -> str:
        return f"ws://127.0.0.1:{self.front.port}/socket?token={self.front.gate.token}"

    def close(self) -> None:
        self.front.stop()
        self.thread.join(30)
        assert not self.thread.is_alive()


@pytest.fixture
def playing():
    worlds = []

    def play(scene: wt.Scene) -> Playing:
        worlds.append(Playing(scene))
        return worlds[-1]

    yield play
    for world in worlds:
        world.close()


@pytest.fixture
def watching():
    watchers = []

    def watch(url: str) -> Watcher:
        watchers.append(Watcher(url))
        return watchers[-1]

    yield watch
    for watcher in watchers:
        watcher.close()
