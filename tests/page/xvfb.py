"""A virtual display, and hands on it."""

import os
import shutil
import subprocess


class Display:
    """An X server without a screen; `do` runs xdotool on it, which the server cannot tell from a person."""

    def __init__(self) -> None:
        reading, writing = os.pipe()
        self.process = subprocess.Popen(
            # Without -noreset it begins anew when the last window goes, and meanwhile refuses the next one. With -r a
            # key does not repeat: on a busy machine half a second may pass before it is let go.
            ["Xvfb", "-displayfd", str(writing), "-screen", "0", "1280x860x24", "-nolisten", "tcp", "-noreset", "-r"],
            pass_fds=[writing],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(writing)
        with os.fdopen(reading) as told:
            self.name = f":{told.readline().strip()}"
        self.environment = {**os.environ, "DISPLAY": self.name}

    def do(self, *words: object) -> None:
        subprocess.run(["xdotool", *map(str, words)], env=self.environment, check=True, timeout=30, capture_output=True)

    def close(self) -> None:
        self.process.terminate()
        self.process.wait(20)


def missing() -> list[str]:
    return [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
