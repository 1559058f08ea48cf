"""An hour at the page: play, switch scenes, come and go, export; memory and speed are printed over time.

    python tests/fuzz/soak.py --minutes 60

Exit code 1 where memory grew by more than 100 MB between the first round through the scenes and the last, or pictures for
a second of the processors became fewer than half, or anything ended that should not have.
"""

import argparse
import random
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

import wavetank as wt
from wavetank.formats.npz import write_npz
from wavetank.page.server import PageServer
from wavetank.scene.scene import bundled_levels, bundled_scenes
from wavetank.session.session import Session

sys.path.insert(0, str(Path(__file__).parents[1] / "page"))

from watcher import Watcher, resident

TOOLS = ("pour", "stir", "push", "freeze", "dye", "cut", "explosion", "magnet", "drain", "blow", "waves", "tilt")


class Player(Watcher):
    """Somebody at the page, who looks at pictures and acts by chance."""

    def __init__(self, url: str, seed: int) -> None:
        super().__init__(url)
        self.chance = random.Random(seed)

    def act(self) -> None:
        pick = self.chance.random()
        x, y = self.chance.random(), self.chance.random()
        if pick < 0.8:
            tables = [
                {"do": "point-begin", "tool": self.chance.choice(TOOLS), "x": x, "y": y},
                {"do": "point-move", "x": y, "y": x},
                {"do": "point-end"},
            ]
        elif pick < 0.9:
            tables = [{"do": "reset", "parameters": {}}, {"do": "bookmark", "name": "a"}]
        else:
            tables = [{"do": "set", "name": "viscosity", "value": x}, {"do": "rewind", "time": 0.5}]
        for table in tables:
            self.send(table)


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("--minutes", type=float, default=60.0)
    minutes = parser.parse_args().minutes
    names = [
        name for name in (*bundled_scenes(), *bundled_levels()) if name.endswith("-2d") or name in bundled_levels()
    ]
    session = Session(wt.Scene.load("double-dam-2d"), most_particles=20_000)
    front = PageServer(session, port=0)
    front.start()
    thread = threading.Thread(target=front.run)
    thread.start()
    url = f"ws://127.0.0.1:{front.port}/socket?token={front.gate.token}"
    driver, chance = Player(url, 1), random.Random(2)
    began, rows, number = time.monotonic(), [], 0
    folder = Path(tempfile.mkdtemp())
    pictures = 0
    while time.monotonic() - began < 60 * minutes:
        number += 1
        driver.send({"do": "load", "name": names[number % len(names)]})
        start, pictures, spent = time.monotonic(), driver.pictures, time.process_time()
        others = [Player(url, number + k) for k in range(chance.randint(0, 3))]
        while time.monotonic() - start < 6.0:
            driver.act()
            time.sleep(0.1)
        for other in others:
            other.close()
        write = front.call(lambda: write_npz(folder / "now.npz", session.sim.frame()))
        write.result(60)
        urllib.request.urlopen(f"http://127.0.0.1:{front.port}/scene.toml?token={front.gate.token}", timeout=60).read()
        session.log.clear()  # what a session remembers of itself grows by design
        # Pictures for each second of the processors: what else runs on the machine changes little of that.
        rows.append((resident(), (driver.pictures - pictures) / (time.process_time() - spent)))
        print(
            f"{time.monotonic() - began:7.0f} s  {rows[-1][0]:7.0f} MB  {rows[-1][1]:5.1f} pictures/s of processors  "
            f"{session.sim.count:7,} particles  {names[number % len(names)]}",
            flush=True,
        )
        if not thread.is_alive():
            print("the simulation's thread has ended")
            return 1
    driver.close()
    front.stop()
    thread.join(30)
    round_ = len(names)  # a comparison of whole rounds through the scenes, where there are two
    first, last = (
        (rows[:round_], rows[-round_:]) if len(rows) >= 2 * round_ else (rows[: len(rows) // 2], rows[len(rows) // 2 :])
    )
    grown = max(row[0] for row in last) - max(row[0] for row in first)
    faster = sum(row[1] for row in last) / len(last) / max(sum(row[1] for row in first) / len(first), 1e-9)
    print(f"memory {grown:+.0f} MB, pictures x {faster:.2f} between the first and the last round")
    return int(grown > 100 or faster < 0.5 or thread.is_alive())


if __name__ == "__main__":
    sys.exit(main())
