"""Recordings: a session's scene and timed commands as TOML, replayed to the same particles.

Each command has the number of frames that were computed before it. Physics repeats bit for bit on one machine, so the
list is the whole session; the digest of the particles at the end verifies it.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import Field

from wavetank.foundation.arguments import instance_of
from wavetank.foundation.atomic_write import atomic_write
from wavetank.foundation.errors import WavetankError
from wavetank.foundation.input_limits import explain_errors, parse_toml, printable, read_text
from wavetank.foundation.model import Model
from wavetank.foundation.version import VERSION
from wavetank.scene.scene import Scene
from wavetank.session.commands import Command, command_of, table_of
from wavetank.session.session import MOST_PARTICLES, Session

MOST_FRAMES = 20_000_000  # 90 hours at 60 frames a second
MOST_COMMANDS = 5_000_000
READ = "this recording cannot be read: it"


class Recording(Model):
    """A session as plain data."""

    format: Literal[1] = 1
    version: str = ""  # of wavetank that recorded it
    arch: str = "cpu"
    most_particles: Annotated[int, Field(ge=0)] = MOST_PARTICLES
    frames: Annotated[int, Field(ge=0, le=MOST_FRAMES)] = 0
    digest: str = ""
    scene: dict[str, Any]
    commands: Annotated[list[dict[str, Any]], Field(max_length=MOST_COMMANDS)] = []

    @classmethod
    def of(
        cls,
        session: Session,
        start: Scene,
        frames: int | None = None,
        digest: str = "",
        log: Sequence[tuple[int, Command]] | None = None,
    ) -> "Recording":
        """Return the recording of `session`, which started with the scene `start`.

        `frames`, `digest` and `log` are of an earlier moment, where given. Raises `WavetankError` where a script added
        or removed forces, as only commands can be replayed.
        """
        if session.unrecorded_forces:
            names = ", ".join(sorted(session.unrecorded_forces))
            raise WavetankError(
                f"this session cannot be recorded: a script changed its forces ({names}); a recording holds the "
                "scene's own, [[forces]], and commands only."
            )
        return cls(
            version=VERSION,
            arch=session.sim.arch,
            most_particles=session.most_particles,
            frames=session.ticks if frames is None else frames,
            digest=digest or session.sim.digest(),
            scene=start.table(),
            commands=[
                {"frame": frame, **table_of(command)} for frame, command in (session.log if log is None else log)
            ],
        )

    def save(self, path: str | Path) -> None:
        """Write this as TOML; a file of that name is replaced atomically."""
        with atomic_write(path) as partial:
            partial.write_text(self.text(), encoding="utf-8")

    def text(self) -> str:
        """Return this as TOML."""
        return tomli_w.dumps(self.model_dump(exclude_none=True))

    @classmethod
    def load(cls, path: str | Path) -> "Recording":
        """Read a recording; raises `WavetankError` for any other file."""
        origin = printable(path)
        with explain_errors(origin, "recording"):
            recording: Recording = cls.parse(parse_toml(read_text(path, "recording"), origin, READ), origin)
        return recording

    def timed_commands(self, origin: str = "recording") -> list[tuple[int, Command]]:
        """Return each command with the frame before which it is applied; raises `WavetankError`."""
        result: list[tuple[int, Command]] = []
        for number, table in enumerate(self.commands):
            frame = table.get("frame")
            earliest = result[-1][0] if result else 0
            if isinstance(frame, bool) or not isinstance(frame, int) or not earliest <= frame <= self.frames:
                raise WavetankError(
                    f"{origin}: commands[{number}].frame = {frame!r} is not allowed; it must be a whole number from "
                    f"that of the command before, {earliest}, to frames = {self.frames}."
                )
            try:
                result.append((frame, command_of({key: value for key, value in table.items() if key != "frame"})))
            except WavetankError as error:
                raise WavetankError(f"{origin}: commands[{number}]: {error}") from None
        return result


def replay(recording: Recording, arch: str = "cpu", origin: str = "recording") -> Iterator[Session]:
    """Replay a session; yield it at the start and after every frame.

    Pauses take no time. Raises `WavetankError` for an invalid recording.
    """
    instance_of("recording", recording, Recording, "a Recording, as wt.Recording.load(path) returns")
    return _replay(recording, arch, origin)


def _replay(recording: Recording, arch: str, origin: str) -> Iterator[Session]:
    commands = recording.timed_commands(origin)
    session = Session(Scene.parse(recording.scene, origin), arch, most_particles=recording.most_particles)
    yield session
    for frame in range(recording.frames + 1):
        while commands and commands[0][0] <= frame:
            try:
                session.apply(commands.pop(0)[1])
            except WavetankError as error:
                raise WavetankError(f"{origin}: a command before frame {frame} is refused: {error}") from None
        if frame < recording.frames:
            session.tick()
            yield session
