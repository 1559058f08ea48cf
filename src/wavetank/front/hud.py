"""What a page shows of a game: the goal and how it stands, its regions in the picture, high scores."""

import itertools
import math
from typing import Any

import numpy as np

from wavetank.game import Game
from wavetank.scene import bundled_levels
from wavetank.scores import keep_score, key_of, scores
from wavetank.session import Session


class Hud:
    """Follows the game of one session from attempt to attempt."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.scores = scores()
        self._game: Game | None = None
        self._level, self._is_best, self._kept = "", False, False

    def status(self) -> dict[str, Any] | None:
        """Return the game as plain data, None where there is none; the first time that it is won, keep the score."""
        game = self.session.game
        if game is not self._game:
            self._game, self._is_best, self._kept = game, False, False
            self._level = key_of(self.session.scene) if game is not None else ""
        if game is None:
            return None
        if game.outcome == "won" and not self._kept:
            self._kept = True
            self._keep(game)
        levels = bundled_levels()
        place = levels.index(self._level) + 1 if self._level in levels else 0
        return {
            **game.describe(), "level": self._level, "number": place, "levels": len(levels),
            "next": levels[place] if 0 < place < len(levels) else "", "best": self.scores.get(self._level),
            "record": self._is_best,
        }  # fmt: skip

    def _keep(self, game: Game) -> None:
        try:
            self._is_best = keep_score(self._level, game.stars, game.mark)
        except OSError as error:
            self.session.note(f"The score cannot be kept: {error}.")
        self.scores = scores()

    def regions(self, size: tuple[int, int]) -> dict[str, Any]:
        """Return the corners of each region as shares of a picture of `size` [px], for the page to draw over it."""
        game = self.session.game
        return {
            "type": "regions",
            "regions": [] if game is None else [self._corners(aim.lower, aim.upper, size) for aim in game.goal.aims],
        }

    def _corners(self, lower: Any, upper: Any, size: tuple[int, int]) -> list[list[float]]:
        flat = len(lower) == 2
        ends = [(a, b) for a, b in zip(lower, upper, strict=True)] + ([(0.0,)] if flat else [])
        # x runs fastest, so that corner k lies at the upper end of axis j where bit j of k is set.
        corners = np.array([point[::-1] for point in itertools.product(*ends[::-1])])
        places = self.session.camera.project(corners, *size)[:, :2] / size
        seen = all(math.isfinite(part) for part in places.reshape(-1))
        return [[round(float(u), 5), round(float(v), 5)] for u, v in places] if seen else []
