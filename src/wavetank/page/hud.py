"""What page and window show of a game: goal, progress, regions in the picture, high scores; and of forces."""

import itertools
import math
from typing import Any

import numpy as np

from wavetank.foundation.errors import WavetankError
from wavetank.scene.scene import bundled_levels
from wavetank.session.game import Game
from wavetank.session.scores import keep_score, key_of, scores
from wavetank.session.session import Session
from wavetank.simulation.inflow import outlines

WEIGHT_ARROW = 0.2  # of the picture's height: length of the arrow of the heaviest body's weight
LONGEST_ARROW = 2.0  # of that
SMALLEST_FORCE = 0.02  # of the heaviest body's weight: smaller ones are not shown
NEWEST = 0.15  # weight of a new frame in moving averages
Place = list[float]  # u, v: shares of a picture's width and height


class Hud:
    """Describes the game of one session, and saves its scores."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.scores = scores()
        self._game: Game | None = None
        self._means: dict[tuple[str, str], tuple[int, np.ndarray]] = {}
        self._level, self._is_best, self._saved = "", False, False

    def status(self) -> dict[str, Any] | None:
        """Return the game as plain data, None where there is none; save the score when it is won."""
        game = self.session.game
        if game is not self._game:
            self._game, self._is_best, self._saved = game, False, False
            self._level = key_of(self.session.scene) if game is not None else ""
        if game is None:
            return None
        if game.outcome == "won" and not self._saved:
            self._saved = True
            self._save_score(game)
        levels = bundled_levels()
        place = levels.index(self._level) + 1 if self._level in levels else 0
        described = game.describe()
        for aim in described["aims"]:
            aim["label"] = _label(aim)
        return {
            **described,
            "level": self._level,
            "next": levels[place] if 0 < place < len(levels) else "",
            "heading": f"Level {place} of {len(levels)}" if place else "Level",
            "headline": _headline(game, place == len(levels)),
            "verdict": self._verdict(game),
        }

    def _save_score(self, game: Game) -> None:
        try:
            self._is_best = keep_score(self._level, game.stars, game.mark)
        except (OSError, WavetankError) as error:
            self.session.note(f"The score cannot be saved: {error}.")
        self.scores = scores()

    def _verdict(self, game: Game) -> str:
        """Return a sentence or two on the win, or the level's hint."""
        if game.outcome != "won":
            return game.goal.hint
        said = [] if game.goal.is_endured else [f"In {game.elapsed:.1f} s."]
        best = self.scores.get(self._level)
        if self._is_best:
            said.append("A new best.")
        elif best is not None:
            wet = f"{100 * best['mark']:.0f} % of what is allowed got wet"
            mark = wet if game.goal.is_endured else f"{best['mark']:.1f} s"
            said.append(f"Best: {best['stars']} star{'s' * (best['stars'] > 1)}, {mark}.")
        return " ".join(said)

    def regions(self, size: tuple[int, int]) -> list[dict[str, Any]]:
        """Return the corners and the outline of each region, as shares of a picture of `size` [px].

        After those of the game follow emitters and drains, with a `mark` and without corners, and forces.
        """
        game = self.session.game
        places = [] if game is None else [self._corners(aim.lower, aim.upper, size) for aim in game.goal.aims]
        regions: list[dict[str, Any]] = [{"corners": corners, "outline": _hull(corners)} for corners in places]
        for mark, points in outlines(self.session.sim.scene, self.session.sim.time):
            seen = self._in_picture(points, size)
            if seen:
                regions.append({"corners": [], "outline": seen, "mark": mark})
        return regions + self._forces(size) if self.session.shows_forces else regions

    def _forces(self, size: tuple[int, int]) -> list[dict[str, Any]]:
        """Return arrows, with a `label`, of the water's forces on bodies, and the power of joints that have motors.

        The heaviest body's weight is an arrow `WEIGHT_ARROW` of the picture's height long. They are averages of some
        frames, as forces of single time steps fluctuate.
        """
        sim, shown = self.session.sim, []
        weight = max((body.mass for body in sim.bodies.values()), default=0.0) * math.hypot(*sim.gravity)
        longest = WEIGHT_ARROW * self.session.camera.visible_height  # m
        scale = longest / (weight or 1.0)  # m/N
        for name, body in sim.bodies.items():
            for mark, force in (("buoyancy", body.buoyancy), ("drag", body.drag)):
                mean = self._mean((name, mark), force)
                start, way = body.center, np.zeros(3)
                way[: len(mean)] = scale * mean
                way *= min(1.0, LONGEST_ARROW * longest / max(float(np.linalg.norm(way)), 1e-30))
                places = self._in_picture(np.array([start, start + way]), size)
                if places and float(np.linalg.norm(mean)) > SMALLEST_FORCE * weight:
                    label = f"{three(float(np.linalg.norm(mean)))} N"
                    shown.append({"corners": [], "outline": places, "mark": mark, "label": label})
        for name, power in sim.joints.powers.items():
            if math.isfinite(power):
                (mean,) = self._mean((name, "power"), np.array([power]))
                at = sim.joints[name].place
                label = f"{name}: {three(float(mean))} W"
                shown.append(
                    {"corners": [], "outline": self._in_picture(at[None], size), "mark": "power", "label": label}
                )
        return [row for row in shown if row["outline"]]

    def _mean(self, what: tuple[str, str], value: np.ndarray) -> np.ndarray:
        """Return the exponential moving average of a vector over frames."""
        ticks, before, mean = self.session.ticks, *self._means.get(what, (-1, value))
        if len(mean) != len(value) or ticks < before:
            mean = value
        elif ticks > before:
            mean = mean + (1.0 - (1.0 - NEWEST) ** (ticks - before)) * (value - mean)
        self._means[what] = (ticks, mean)
        return mean

    def _corners(self, lower: Any, upper: Any, size: tuple[int, int]) -> list[Place]:
        flat = len(lower) == 2
        ends = [(a, b) for a, b in zip(lower, upper, strict=True)] + ([(0.0,)] if flat else [])
        # x runs fastest, so that corner k lies at the upper end of axis j where bit j of k is set.
        corners = np.array([point[::-1] for point in itertools.product(*ends[::-1])])
        return self._in_picture(corners, size)

    def _in_picture(self, points: np.ndarray, size: tuple[int, int]) -> list[Place]:
        """Project points [m] to shares of a picture; none where one of them is behind the camera."""
        places = self.session.tilted_camera.project(points, *size)[:, :2] / size
        seen = all(math.isfinite(part) for part in places.reshape(-1))
        return [[round(float(u), 5), round(float(v), 5)] for u, v in places] if seen else []


def three(value: float) -> str:
    """Format a number with three significant digits; 0.00 below 0.005."""
    if abs(value) < 0.005:
        return "0.00"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"


def _label(aim: dict[str, Any]) -> str:
    asked = "keep dry" if aim["forbids"] else f"{100 * aim['value']:.0f} % of {100 * aim['share']:.0f} %"
    return f"{aim['name']} {asked}".strip()


def _headline(game: Game, is_last: bool) -> str:
    if game.outcome == "won":
        return "Won: the last level" if is_last else "Won"
    if game.outcome == "lost":
        return "Time is over" if game.elapsed >= game.goal.seconds - 0.01 else "Too wet"
    return ""


def _hull(points: list[Place]) -> list[Place]:
    """Return the corners of the convex hull in order: monotone chain, Andrew 1979, doi:10.1016/0020-0190(79)90072-3."""
    ends = []
    for order in (sorted(points), sorted(points, reverse=True)):
        chain: list[Place] = []
        for p in order:
            while len(chain) > 1 and _cross(chain[-2], chain[-1], p) <= 0:
                chain.pop()
            chain.append(p)
        ends += chain[:-1]
    return ends


def _cross(a: Place, b: Place, c: Place) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
