"""How bodies move by what the water did to them: all of them at once, one row each.

A step of water sees a body in the motion that it has for the step, as it sees every solid, and answers with a push
(`physics/reactions.py`). Momentum wants a change of velocity dv with

    m dv = P(dv) + m g dt + O

where O is what the steps before left over. A body that moves by the push of the last step explodes where it is light:
the water answers with more than the body weighs (Causin et al. 2005, 10.1016/j.cma.2004.12.005). So the push is taken
for one that falls as the body gives way, P = P_before - k (dv - dv_before), where k is the water that goes along:

    (m + k) dv = P_before + k dv_before + m g dt + O

What turns out to be wrong of it, O = the right-hand side of the first equation less the left, is made up for in the
steps that follow; no momentum is lost, whatever k is. Where it is by far wrong the body yields within the step: some
iterations before its end what P will be is told by what it is so far and by what came later in the step before, the
body is to be faster by O / (m + k), the engine takes its step again, so that contact and joints hold for what bodies
yield as well, and the iterations that are left see the body there. Where a light body hits the water so hard that this
is too late, engine and water take the whole step again. How k answers is seen from step to step; deep in the water it
is that of an ellipsoid (`added_mass.py`).

The engine's impulse in contact and joints, (m + k) dv_c, leaves k dv_c to the water, and what the water does not take
throws the body back: one that is out of the water would bounce with a restitution of k / m, more than one where it is
light. So no more is taken to go along with a body that is hardly wet than as far as water carries it.

A viscous fluid answers the velocity itself: P = P_before - k_v dv besides, so that (m + k + k_v) dv stands on the left.
Taken as it was in the step before, what holds a light body in honey would throw it to and fro. k_v is that of a ball
which is suddenly moved, after a step: mu A dt (3 / (2 R) + 1 / sqrt(pi nu dt)) (Basset 1888; Landau and Lifshitz 1987,
Sec. 24), with the wet surface A that the dampers of the walls tell: the nearest layer, at d / 2, has mu / (d / 2).

    code       symbol       meaning                                                          unit
    impulse    P            what the water gave in a step                                    kg m/s, kg m^2/s
    change     dv_before    change of velocity in the step before, without how it yielded    m/s, rad/s
    along      k            mass and moment of inertia of the water that goes along          kg, kg m^2
    rubbed     k_v          mass that a viscous fluid seems to add, and moment of inertia    kg, kg m^2
    due        m g dt + O   what a body gets by this step but for P,                         kg m/s, kg m^2/s
    given      m dv         and what it has got; of the engine's (m + k) dv_c that is but m dv_c
    before     v            velocity at the end of the step before
    wanted                  that with which the engine begins                                m/s, rad/s
    seen_push  P            of the step before, and
    seen_gain  dv           what a body's velocity has changed by in it: from step to step they say what k is by
    later                   of P, what came after bodies might have yielded, as a mean       kg m/s, kg m^2/s
    sums                    least squares: sums of -dP ddv and of ddv^2, motion and turn, that fade by `STAYS`
"""

import numpy as np

from wavetank.foundation.rotations import matrix_of

TOLERANCE = np.array([0.05, 0.2])  # of sqrt(g d), or of its speed: a body's wrong motion and turn, times k / m
HARD = 0.5  # the same, in motion alone, where water was pushed aside that must not have been: the step begins anew
JAMMING = 6.0  # by how much less a body may yield towards the water than away from it within a step
LIGHT = 2.0  # water that goes along, over a body's mass, from which on: heavier ones are not thrown up again
AFLOAT = 0.4  # of the water that goes along with an immersed body: what goes along with one that lies on the surface
AT_ONCE = 0.2  # of what is owed: more would ring
LATELY = 0.5  # share of the last step in what is expected to come late: what alternates from step to step is no omen
STAYS = 0.9  # share that is left after a step of what was seen of how much water goes along
MOST = 4.0  # of the water that goes along with an immersed body: most that is believed
BLOCKS = (slice(0, 3), slice(3, 6))  # motion and turn, columns of a row
ROWS = (
    "impulse",
    "due",
    "given",
    "change",
    "carried",
    "by_grid",
    "velocity",
    "before",
    "seen_push",
    "seen_gain",
    "later",
)
DENSITY = 4  # where the density is in the last row of what is remembered
REMEMBERED = len(ROWS) + 2  # rows of `Coupling.memory`


def with_all_rows(memory: np.ndarray) -> np.ndarray:
    """Return what `Coupling.memory` returned; earlier versions had no row `later`, the last of `ROWS`: 0."""
    if memory.ndim != 3 or memory.shape[1] != REMEMBERED - 1:
        return memory
    return np.insert(memory, len(ROWS) - 1, 0.0, axis=1)


def density_in(arrays: dict[str, np.ndarray]) -> float:
    """Return the density of the fluids [kg/m^3] that the bodies of a snapshot were in; 0 where it does not say."""
    memory = arrays.get("bodies_memory", np.zeros((0, 1, 6)))
    density = float(memory[0, -1, DENSITY]) if len(memory) else 0.0
    return density if 0.0 < density < 1e6 else 0.0


def lengths(rows: np.ndarray) -> np.ndarray:
    """Return the lengths of vectors [n, 3], as `numpy.linalg.norm` does in three times the time."""
    root: np.ndarray = np.sqrt((rows * rows).sum(axis=1))
    return root


class Coupling:
    """What bodies have got from the water and what they are still to get; rows are motion and turn."""

    def __init__(
        self, weights: np.ndarray, masses: np.ndarray, tensors: np.ndarray, reaches: np.ndarray, added: np.ndarray
    ) -> None:
        """Begin at rest.

        Gravity pulls at `weights` [n] [kg]; `masses` [n] [kg], `tensors` [n, 3, 3] [kg m^2], `reaches` [n] [m] and the
        `added` [n, 2] are those of `weighing`.
        """
        self.weights = weights
        self.masses, self.tensors, self.reaches, self.added = masses, tensors, reaches, added
        count = len(masses)
        self.impulse, self.due, self.given = (np.zeros((count, 6)) for _ in range(3))  # kg m/s, kg m^2/s
        self.carried = np.zeros((count, 6))  # N, N m: `by_grid` before the step
        self.by_grid = np.zeros((count, 6))  # N, N m: by the pressure of the grid
        self.velocity, self.change = np.zeros((count, 6)), np.zeros((count, 6))  # m/s, rad/s
        self.along = np.zeros((count, 2))  # kg, kg m^2
        self.rubbed = np.zeros((count, 2))  # kg, kg m^2
        self.before, self.seen_gain = np.zeros((count, 6)), np.zeros((count, 6))  # m/s, rad/s
        self.seen_push = np.zeros((count, 6))  # kg m/s, kg m^2/s
        self.sums = np.zeros((count, 2, 2))
        self.immersed = np.zeros(count)  # share of their volume
        self.displaces = np.zeros(count)  # mass of fluid, over that of as much of the heaviest as the body is large
        self._was_immersed = np.zeros(count)
        self._heavy = np.zeros(count)  # N
        self.held = np.zeros(count, bool)  # they have no momentum of their own
        self.lasted = 0.0  # s, of the last step
        self.later = np.zeros((count, 6))  # kg m/s, kg m^2/s
        self.wanted = np.zeros((count, 6))  # m/s, rad/s, but for contact
        self.pulled = np.zeros((count, 6))  # kg m/s, kg m^2/s: by contact and joints
        self._inertias = np.stack([masses, np.linalg.norm(tensors, 2, axis=(1, 2))], axis=1)  # kg, kg m^2
        self._given_way = np.zeros((count, 6))  # m/s, rad/s, by how much they have yielded in this step
        self._so_far, self._to_come = np.zeros((count, 6)), np.zeros((count, 6))  # of `impulse`, in this step
        self.small = np.zeros(count)  # 1 where a body is hardly larger than a cell of the grid, 0 where it is by far
        self.sinks = np.zeros(count, bool)  # denser than water: what is caught below it on a floor must not throw it
        self._stands: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self.is_hit = False  # whether one was so hard that the step has to begin anew

    @property
    def owed(self) -> np.ndarray:
        """Momentum [n, 6] that bodies are still to get."""
        return np.where(self.held[:, None], 0.0, self.due + self.impulse - self.given)

    @property
    def keeps(self) -> np.ndarray:
        """Share [n] of what the grid has carried on for a body that is left.

        Less where a small one leaves the water, within a few steps: the grid takes nothing back from what nothing
        presses on, and light balls bobbed by half a spacing for ever.
        """
        still = np.minimum(1.0, self.immersed / np.maximum(self._was_immersed, 1e-9))
        share: np.ndarray = 1.0 - self.small * (1.0 - still)
        return share

    @property
    def _borne(self) -> np.ndarray:
        """Share [n] of a body's weight that pushed it, at most all of it."""
        pushed = lengths(self.impulse[:, :3])
        share: np.ndarray = np.minimum(1.0, pushed / np.maximum(self._heavy * self.lasted, 1e-30))
        return share

    @property
    def held_by(self) -> np.ndarray:
        """Mass and moment of inertia [n, 2] that the fluid adds to bodies within a step."""
        return self.along + self.rubbed

    def hold(self, dampers: np.ndarray, radii: np.ndarray, spacing: float, spread: float) -> None:
        """See how a viscous fluid holds bodies: dampers [n] [kg] of walls, in a fluid with so large a nu dt [m^2]."""
        thin = 0.5 * spacing * (1.5 / radii + 1.0 / np.sqrt(np.pi * max(spread, 1e-30)))
        self._rub(dampers * np.minimum(1.0, thin))

    def _rub(self, mass: np.ndarray) -> None:
        self.rubbed = np.stack([mass, mass * self.reaches**2], axis=1)

    def begin(
        self, rotations: np.ndarray, held: np.ndarray, gravity: np.ndarray, dt: float, pushes: np.ndarray | None = None
    ) -> None:
        """Find the velocities `wanted` [n, 6] for a step of `dt` [s] of bodies that are turned so [n, 4].

        Besides gravity, forces of the scene give them the momentum `pushes` [n, 6]. Those that were `held` [n] in the
        step before are owed nothing by it.
        """
        self._heavy = self.weights * np.linalg.norm(gravity)
        self._learn()
        owed, self.held = np.where(held[:, None], 0.0, self.owed), held
        weight = np.zeros_like(owed)
        falls = self.masses + self._borne * (self.weights - self.masses)  # in the air as all things do
        weight[:, :3] = falls[:, None] * gravity * dt
        if pushes is not None:
            weight += pushes
        ratio = dt / (self.lasted or dt)
        self.due = owed + weight
        wanted = AT_ONCE * owed + weight + ratio * (self.impulse + np.repeat(self.along, 3, axis=1) * self.change)
        self.wanted = self.velocity + self.solved(rotations, wanted)
        self.carried, self._was_immersed = self.by_grid, self.immersed
        self._given_way, self._to_come = np.zeros_like(owed), ratio * self.later

    def expect(self) -> None:
        """Take for what is still to come of a step what came in the steps before: last iterations and friction."""
        self._so_far = self.impulse
        self.impulse = self.impulse + self._to_come

    def end(self) -> None:
        """See what has come since `expect`."""
        self.later += LATELY * (self.impulse - self._so_far - self.later)

    def start(self, rotations: np.ndarray, begun: np.ndarray, velocity: np.ndarray, dt: float) -> None:
        """Take a step of `dt` [s] with these velocities [n, 6]; `begun` they were before contact and joints.

        What makes `begun` less than `wanted`, the speed limit, takes momentum for good.
        """
        self.velocity, self.change = velocity, velocity - self.before - self._given_way
        self.given = self.weighed(rotations, self.wanted - self.before)
        pulled, along = velocity - begun, np.repeat(self.held_by, 3, axis=1)
        self.pulled = self.weighed(rotations, pulled) + along * pulled
        self.given -= along * pulled
        self.lasted = dt

    def _learn(self) -> None:
        """See how much water goes along by how its push follows the changes of velocity from step to step."""
        gained = self.velocity - self.before
        self.before = self.velocity.copy()
        push, way = self.impulse - self.seen_push, gained - self.seen_gain
        self.seen_push, self.seen_gain = self.impulse.copy(), gained
        for part, block in enumerate(BLOCKS):
            now = np.stack([-(push[:, block] * way[:, block]).sum(axis=1), (way[:, block] ** 2).sum(axis=1)], axis=1)
            self.sums[:, part] = STAYS * self.sums[:, part] + now
        self.along = self._bounded(self.sums[..., 0] / np.maximum(self.sums[..., 1], 1e-30))

    def _bounded(self, along: np.ndarray) -> np.ndarray:
        """Return what is believed of so much water [n, 2] that goes along.

        The least is a share of `added`: that of a plate on the surface is a third of a cube's (Lamb 1932, 108).
        """
        least = np.maximum(self.immersed, AFLOAT * self._borne)
        return np.clip(along, least[:, None] * self.added, MOST * self.added)

    def yields(self, rotations: np.ndarray, slow: float, farthest: float) -> bool:
        """Let bodies want other velocities where theirs turned out to be wrong; say whether any does.

        Those are wrong that are so by more than the water can make up for later: too much of `slow` [m/s], or of their
        own, the more the heavier the water is that goes along. One that yields by more than `farthest` [m], or that is
        so light that it would be thrown up, `is_hit`: what pushed it pushed a place where it was not to be.
        """
        before = self.along
        self.along = self._bounded(before)
        asked = self.owed
        alone = self.solved(rotations, asked, 0.0)
        heavier = np.minimum(self.along, self.added) / self._inertias
        wrong = np.stack([lengths(alone[:, block]) for block in BLOCKS], axis=1) * heavier
        wrong[:, 1] *= self.reaches
        speeds = lengths(self.velocity[:, :3])
        wrong /= np.maximum(np.maximum(slow, speeds), 1e-30)[:, None]
        yielding = (wrong > TOLERANCE).any(axis=1)
        self.along = np.where(yielding[:, None], self.along, before)
        step = np.where(yielding[:, None], self.solved(rotations, asked), 0.0)
        ways = np.stack([lengths(step[:, block]) for block in BLOCKS], axis=1) * self.lasted
        is_thrown = (wrong[:, 0] > HARD) & (heavier[:, 0] > LIGHT) | self.sinks & (wrong.max(axis=1) > HARD)
        # One that yields towards the water may jam particles that are where they are by its other way.
        ways[:, 0] *= np.where((step[:, :3] * self.impulse[:, :3]).sum(axis=1) < 0.0, JAMMING, 1.0)
        self.is_hit = bool((is_thrown | (ways[:, 0] + self.reaches * ways[:, 1] > farthest)).any())
        self.wanted, self._given_way = self.wanted + step, self._given_way + step
        return bool(yielding.any())

    def slowed(self, fastest: float) -> np.ndarray:
        """Return the velocities `wanted` [n, 6] of which no part of a body's surface is faster than that [m/s]."""
        speeds = np.sqrt((self.wanted * self.wanted).reshape(-1, 2, 3).sum(axis=2))
        speeds[:, 1] *= self.reaches
        shares = np.minimum(1.0, fastest / np.maximum(speeds, 1e-30))
        slowed: np.ndarray = self.wanted * np.repeat(shares, 3, axis=1)
        return slowed

    def solved(self, rotations: np.ndarray, impulse: np.ndarray, share: float = 1.0) -> np.ndarray:
        """Return the change of velocity [n, 6] by an impulse [n, 6] of bodies and a `share` of the water along."""
        along = share * self.held_by
        tensors = self._turned(rotations)[1] + along[:, 1, None, None] * np.eye(3)
        spin = np.linalg.solve(tensors, impulse[:, 3:, None])[..., 0]
        return np.concatenate([impulse[:, :3] / (self.masses + along[:, 0])[:, None], spin], axis=1)

    def _turned(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return matrices of the rotations [n, 4] and the tensors turned by them, [n, 3, 3]."""
        stand = rotations.tobytes()
        if stand not in self._stands:  # a step asks for those of its begin and of its end, by turns
            if len(self._stands) > 1:
                self._stands.clear()
            turn = matrix_of(rotations)
            self._stands[stand] = turn, turn @ self.tensors @ turn.transpose(0, 2, 1)
        return self._stands[stand]

    def weighed(self, rotations: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the momentum [n, 6] of bodies by a velocity [n, 6]."""
        turn = self._turned(rotations)[0]
        spin = turn @ (self.tensors @ (turn.transpose(0, 2, 1) @ velocity[:, 3:, None]))
        return np.concatenate([velocity[:, :3] * self.masses[:, None], spin[..., 0]], axis=1)

    # --- states ---

    def memory(self) -> np.ndarray:
        """Return all that it remembers, float64 [n, 13, 6]."""
        rest = np.zeros_like(self.impulse)
        rest[:, 0], rest[:, 1], rest[:, 2:4], rest[:, 4] = self.immersed, self.lasted, self.along, self.held
        rest[:, 5] = self.rubbed[:, 0]
        sums = np.pad(self.sums.reshape(-1, 4), ((0, 0), (0, 2)))
        sums[:, 5] = self.displaces
        return np.stack([*(getattr(self, name) for name in ROWS), rest, sums], axis=1)

    def recall(self, number: int, memory: np.ndarray) -> None:
        """Let body `number` remember a row [13, 6] of what `memory` returned."""
        for name, row in zip(ROWS, memory, strict=False):
            getattr(self, name)[number] = row
        rest = memory[len(ROWS)]
        self.immersed[number], self.lasted = rest[0], float(rest[1])
        self.along[number], self.held[number] = rest[2:4], bool(rest[4])
        mass = self.rubbed[:, 0].copy()
        mass[number] = rest[5]
        self._rub(mass)
        self.sums[number], self.displaces[number] = memory[-1][:4].reshape(2, 2), memory[-1][5]
