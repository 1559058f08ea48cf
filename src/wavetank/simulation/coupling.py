"""Added-mass coupling of rigid bodies and water: the velocities of all bodies from the impulses of the water.

A step of water sees a body in the motion that it has for the step, as it sees every solid, and answers with an impulse
P (`physics/bodies.py`). The change of velocity dv that conserves momentum satisfies

    m dv = P(dv) + m g dt + O

where O is the impulse that the steps before left over. Explicit coupling, with the P of the last step, is unstable for
light bodies: the water answers with more than the body weighs (Causin et al. 2005, 10.1016/j.cma.2004.12.005). So P is
linearised with an added mass k, P = P_before - k (dv - dv_before):

    (m + k) dv = P_before + k dv_before + m g dt + O

The error of this, O = right-hand side of the first equation minus left-hand side, is applied in the steps that follow:
no momentum is lost, whatever k is. Where the error is large the coupling is implicit: some iterations before the end of
the step, P is estimated by its value so far and by what came late in the step before, the velocity of the body is
corrected by O / (m + k), the engine takes its step again, so that contact and joints hold for the correction as well,
and the remaining iterations see the body at its new place. Where a light body hits the water so hard that this is too
late, engine and water take the whole step again. k is fitted from step to step; its bounds are multiples of that of an
immersed ellipsoid (`mass_properties.py`).

The engine's impulse in contact and joints, (m + k) dv_c, assigns k dv_c to the water, and the part that water does not
take throws the body back: a body out of the water would bounce with a restitution of k / m, above one where it is
light. So the added mass of a body that is hardly immersed is bounded by the share of its load that water bears.

A viscous fluid responds to the velocity itself: P = P_before - k_v dv in addition, so that (m + k + k_v) dv stands on
the left. Treated explicitly, the drag on a light body in honey would throw it to and fro. k_v is that of a sphere which
is suddenly moved, after a step: mu A dt (3 / (2 R) + 1 / sqrt(pi nu dt)) (Basset 1888; Landau and Lifshitz 1987,
Sec. 24), with the wet surface A from the wall dampers: the nearest layer, at d / 2, has mu / (d / 2).

Rows of arrays are bodies; six columns are translation and rotation.

    code             symbol       meaning                                                       unit
    impulse          P            of the water on the body in the step                          kg m/s, kg m^2/s
    velocity_change  dv_before    in the step before, without implicit corrections              m/s, rad/s
    added_mass       k            added mass and added moment of inertia                        kg, kg m^2
    viscous_mass     k_v          the same, of viscous drag                                     kg, kg m^2
    expected         m g dt + O   impulse that the body is to get in the step besides P         kg m/s, kg m^2/s
    received         m dv         impulse that it got; of the engine's (m + k) dv_c only m dv_c kg m/s, kg m^2/s
    last_velocity    v            at the end of the step before                                 m/s, rad/s
    target_velocity               that the engine starts its step with                          m/s, rad/s
    last_impulse     P            of the step before; with
    last_gain        dv           of the step before, k is fitted from step to step
    late_impulse                  part of P that came after the implicit iteration, as a mean   kg m/s, kg m^2/s
    fit_sums                      least squares of k: sums of -dP ddv and ddv^2, each fading by `STAYS`
"""

import numpy as np

from wavetank.foundation.rotations import matrix_of

TOLERANCE = np.array([0.05, 0.2])  # of sqrt(g d) or its speed: velocity error times k / m, translation and rotation
HARD = 0.5  # the same, of translation, above which water was displaced wrongly and the step is taken again
JAMMING = 6.0  # by this factor less may a body be corrected towards the water than away from it within a step
LIGHT = 2.0  # added mass over mass, above which a hard hit repeats the step: heavier bodies are not thrown back
AFLOAT = 0.4  # added mass of a floating body over that of an immersed one, at least
AT_ONCE = 0.2  # share of the pending impulse applied in one step: more would ring
LATELY = 0.5  # weight of the last step in the mean of late impulses: those that alternate are not expected again
STAYS = 0.9  # factor per step by which the sums of the fit fade
MOST = 4.0  # added mass over that of the immersed ellipsoid, at most
BLOCKS = (slice(0, 3), slice(3, 6))  # columns of translation and rotation
ROWS = (
    "impulse",
    "expected",
    "received",
    "velocity_change",
    "warm_started_force",
    "grid_force",
    "velocity",
    "last_velocity",
    "last_impulse",
    "last_gain",
    "late_impulse",
)
DENSITY = 4  # column of the fluid density in the last row of `Coupling.to_rows`
STATE_ROWS = len(ROWS) + 2  # rows of a body in `Coupling.to_rows`


def upgraded(memory: np.ndarray) -> np.ndarray:
    """Return `memory` of `Coupling.to_rows` with the row `late_impulse`, zero where an earlier version wrote it."""
    if memory.ndim != 3 or memory.shape[1] != STATE_ROWS - 1:
        return memory
    return np.insert(memory, len(ROWS) - 1, 0.0, axis=1)


def density_in(arrays: dict[str, np.ndarray]) -> float:
    """Return the density [kg/m^3] of the fluids that the bodies of a state were in; 0 where it is not known."""
    memory = arrays.get("bodies_memory", np.zeros((0, 1, 6)))
    density = float(memory[0, -1, DENSITY]) if len(memory) else 0.0
    return density if 0.0 < density < 1e6 else 0.0


def limited_lift(force: np.ndarray, gravity: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Return forces [n, 6] [N, N m] that lift bodies by no more than the weight of a `mass` [n] [kg]; none without it.

    Water that closes around a body lifts it by the weight of what it displaces. Sideways and downwards it may press on
    one side alone, as on a gate or a plug, with any force.
    """
    strength = float(np.linalg.norm(gravity))
    if not strength:
        return np.zeros_like(force)
    up = -gravity / strength
    lift = force[:, :3] @ up
    share = np.minimum(1.0, mass * strength / np.maximum(lift, 1e-30))
    result: np.ndarray = force.copy()
    result[:, :3] -= np.outer((1.0 - share) * lift, up)
    result[:, 3:] *= share[:, None]
    return result


def norms(rows: np.ndarray) -> np.ndarray:
    """Return the norms of vectors [n, 3], three times as fast as `numpy.linalg.norm`."""
    root: np.ndarray = np.sqrt((rows * rows).sum(axis=1))
    return root


class Coupling:
    """Impulses, velocities and added masses of all bodies."""

    def __init__(
        self, weights: np.ndarray, masses: np.ndarray, tensors: np.ndarray, reaches: np.ndarray, added: np.ndarray
    ) -> None:
        """Start at rest with the arrays of `MassProperties`."""
        self.weights = weights
        self.masses, self.tensors, self.reaches, self.full_added_mass = masses, tensors, reaches, added
        count = len(masses)
        self.impulse, self.expected, self.received = (np.zeros((count, 6)) for _ in range(3))  # kg m/s, kg m^2/s
        self.warm_started_force = np.zeros((count, 6))  # N, N m: share of `grid_force` that starts the step
        self.grid_force = np.zeros((count, 6))  # N, N m: of the grid pressure
        self.velocity, self.velocity_change = np.zeros((count, 6)), np.zeros((count, 6))  # m/s, rad/s
        self.added_mass = np.zeros((count, 2))  # kg, kg m^2
        self.viscous_mass = np.zeros((count, 2))  # kg, kg m^2
        self.last_velocity, self.last_gain = np.zeros((count, 6)), np.zeros((count, 6))  # m/s, rad/s
        self.last_impulse = np.zeros((count, 6))  # kg m/s, kg m^2/s
        self.fit_sums = np.zeros((count, 2, 2))
        self.immersed = np.zeros(count)  # immersed share of the volume, 0 to 1
        self.displaced = np.zeros(count)  # displaced mass over that of the immersed body in the densest fluid
        self._last_immersed = np.zeros(count)
        self._weight_forces = np.zeros(count)  # N
        self.held = np.zeros(count, bool)  # kinematic: their momentum is not theirs
        self.last_dt = 0.0  # s, of the last step; 0 before the first
        self.late_impulse = np.zeros((count, 6))  # kg m/s, kg m^2/s
        self.target_velocity = np.zeros((count, 6))  # m/s, rad/s, before contact
        self.contact_impulse = np.zeros((count, 6))  # kg m/s, kg m^2/s: by contact and joints
        self._inertias = np.stack([masses, np.linalg.norm(tensors, 2, axis=(1, 2))], axis=1)  # kg, kg m^2
        self._correction = np.zeros((count, 6))  # m/s, rad/s: implicit correction of this step
        self._impulse_before, self._late_expected = np.zeros((count, 6)), np.zeros((count, 6))  # kg m/s, kg m^2/s
        self.smallness = np.zeros(count)  # 1 where a body is hardly larger than a grid cell, 0 where it is far larger
        self.sinks = np.zeros(count, bool)  # denser than water: water caught below it on a floor must not throw it
        self._turned_tensors: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}
        self.is_hit = False  # whether the step has to be taken again

    @property
    def pending_impulse(self) -> np.ndarray:
        """Impulse [n, 6] [kg m/s, kg m^2/s] that bodies are still to get."""
        return np.where(self.held[:, None], 0.0, self.expected + self.impulse - self.received)

    @property
    def warm_start_share(self) -> np.ndarray:
        """Share [n] of the grid's warm-started force that stays on a body, 0 to 1.

        Below 1 where a small body leaves the water: the grid corrects nothing where no water presses, and light balls
        bobbed by half a spacing indefinitely.
        """
        still = np.minimum(1.0, self.immersed / np.maximum(self._last_immersed, 1e-9))
        share: np.ndarray = 1.0 - self.smallness * (1.0 - still)
        return share

    @property
    def _load_fraction(self) -> np.ndarray:
        """Share [n] of a body's weight that the water bore in the last step, 0 to 1."""
        pushed = norms(self.impulse[:, :3])
        share: np.ndarray = np.minimum(1.0, pushed / np.maximum(self._weight_forces * self.last_dt, 1e-30))
        return share

    @property
    def fluid_inertia(self) -> np.ndarray:
        """Mass and moment of inertia [n, 2] that the fluid adds to bodies within a step, k + k_v."""
        return self.added_mass + self.viscous_mass

    def set_viscosity(self, dampers: np.ndarray, radii: np.ndarray, spacing: float, spread: float) -> None:
        """Set the viscous mass from wall dampers [n] [kg], `radii` [n] [m] and `spread` = nu dt [m^2]."""
        thin = 0.5 * spacing * (1.5 / radii + 1.0 / np.sqrt(np.pi * max(spread, 1e-30)))
        self._set_viscous_mass(dampers * np.minimum(1.0, thin))

    def _set_viscous_mass(self, mass: np.ndarray) -> None:
        self.viscous_mass = np.stack([mass, mass * self.reaches**2], axis=1)

    def predict(
        self, rotations: np.ndarray, held: np.ndarray, gravity: np.ndarray, dt: float, pushes: np.ndarray | None = None
    ) -> None:
        """Predict `target_velocity` [n, 6] for a step of `dt` [s] of bodies with these rotations [n, 4].

        Besides `gravity` [m/s^2], forces of the scene give them the impulses `pushes` [n, 6]. Bodies that are `held`
        [n] have no pending impulse.
        """
        self._weight_forces = self.weights * np.linalg.norm(gravity)
        self._fit_added_mass()
        pending, self.held = np.where(held[:, None], 0.0, self.pending_impulse), held
        weight = np.zeros_like(pending)
        falls = self.masses + self._load_fraction * (self.weights - self.masses)  # in the air as all bodies do
        weight[:, :3] = falls[:, None] * gravity * dt
        if pushes is not None:
            weight += pushes
        ratio = dt / (self.last_dt or dt)
        self.expected = pending + weight
        wanted = (
            AT_ONCE * pending
            + weight
            + ratio * (self.impulse + np.repeat(self.added_mass, 3, axis=1) * self.velocity_change)
        )
        self.target_velocity = self.velocity + self.velocity_change_by(rotations, wanted)
        self.warm_started_force, self._last_immersed = self.grid_force, self.immersed
        self._correction, self._late_expected = np.zeros_like(pending), ratio * self.late_impulse

    def add_late_impulse(self) -> None:
        """Add to the impulse so far what is expected of the last iterations and of friction, as in the steps before."""
        self._impulse_before = self.impulse
        self.impulse = self.impulse + self._late_expected

    def record_late_impulse(self) -> None:
        """Update the mean of late impulses with what came since `add_late_impulse`."""
        self.late_impulse += LATELY * (self.impulse - self._impulse_before - self.late_impulse)

    def record_step(self, rotations: np.ndarray, begun: np.ndarray, velocity: np.ndarray, dt: float) -> None:
        """Record a step of `dt` [s] of the engine, from velocities `begun` [n, 6] to `velocity` [n, 6].

        Contact and joints make up the difference. What the speed limit took off `target_velocity` is lost.
        """
        self.velocity, self.velocity_change = velocity, velocity - self.last_velocity - self._correction
        self.received = self.momentum_of(rotations, self.target_velocity - self.last_velocity)
        by_contact, added = velocity - begun, np.repeat(self.fluid_inertia, 3, axis=1)
        self.contact_impulse = self.momentum_of(rotations, by_contact) + added * by_contact
        self.received -= added * by_contact
        self.last_dt = dt

    def _fit_added_mass(self) -> None:
        """Fit the added mass to how impulses followed changes of velocity from step to step (least squares)."""
        gained = self.velocity - self.last_velocity
        self.last_velocity = self.velocity.copy()
        push, way = self.impulse - self.last_impulse, gained - self.last_gain
        self.last_impulse, self.last_gain = self.impulse.copy(), gained
        for part, block in enumerate(BLOCKS):
            now = np.stack([-(push[:, block] * way[:, block]).sum(axis=1), (way[:, block] ** 2).sum(axis=1)], axis=1)
            self.fit_sums[:, part] = STAYS * self.fit_sums[:, part] + now
        self.added_mass = self._bounded(self.fit_sums[..., 0] / np.maximum(self.fit_sums[..., 1], 1e-30))

    def _bounded(self, added: np.ndarray) -> np.ndarray:
        """Return added masses [n, 2] within their bounds, shares of those of the immersed bodies.

        The lower bound: the added mass of a plate on the surface is a third of a cube's (Lamb 1932, 108).
        """
        least = np.maximum(self.immersed, AFLOAT * self._load_fraction)
        return np.clip(added, least[:, None] * self.full_added_mass, MOST * self.full_added_mass)

    def iterate(self, rotations: np.ndarray, slow: float, farthest: float) -> bool:
        """Correct the target velocities that turned out wrong; return whether there are any.

        A velocity is wrong where its error, times added mass over mass, is above `TOLERANCE` of `slow` [m/s] or of the
        body's speed. Where the correction moves one by more than `farthest` [m], or a light one is hit hard, `is_hit`
        says that the step has to be taken again: water was displaced from where the body will not be.
        """
        before = self.added_mass
        self.added_mass = self._bounded(before)
        error = self.pending_impulse
        alone = self.velocity_change_by(rotations, error, 0.0)
        heavier = np.minimum(self.added_mass, self.full_added_mass) / self._inertias
        wrong = np.stack([norms(alone[:, block]) for block in BLOCKS], axis=1) * heavier
        wrong[:, 1] *= self.reaches
        speeds = norms(self.velocity[:, :3])
        wrong /= np.maximum(np.maximum(slow, speeds), 1e-30)[:, None]
        is_wrong = (wrong > TOLERANCE).any(axis=1)
        self.added_mass = np.where(is_wrong[:, None], self.added_mass, before)
        step = np.where(is_wrong[:, None], self.velocity_change_by(rotations, error), 0.0)
        ways = np.stack([norms(step[:, block]) for block in BLOCKS], axis=1) * self.last_dt
        is_thrown = (wrong[:, 0] > HARD) & (heavier[:, 0] > LIGHT) | self.sinks & (wrong.max(axis=1) > HARD)
        # A correction towards the water may jam particles that were placed by the motion without it.
        ways[:, 0] *= np.where((step[:, :3] * self.impulse[:, :3]).sum(axis=1) < 0.0, JAMMING, 1.0)
        self.is_hit = bool((is_thrown | (ways[:, 0] + self.reaches * ways[:, 1] > farthest)).any())
        self.target_velocity, self._correction = self.target_velocity + step, self._correction + step
        return bool(is_wrong.any())

    def limited_velocity(self, fastest: float) -> np.ndarray:
        """Return `target_velocity` [n, 6], scaled so that no part of a body is faster than `fastest` [m/s]."""
        speeds = np.sqrt((self.target_velocity * self.target_velocity).reshape(-1, 2, 3).sum(axis=2))
        speeds[:, 1] *= self.reaches
        shares = np.minimum(1.0, fastest / np.maximum(speeds, 1e-30))
        slowed: np.ndarray = self.target_velocity * np.repeat(shares, 3, axis=1)
        return slowed

    def velocity_change_by(self, rotations: np.ndarray, impulse: np.ndarray, share: float = 1.0) -> np.ndarray:
        """Return the change of velocity [n, 6] by an impulse [n, 6] of bodies with a `share` of the fluid's inertia."""
        added = share * self.fluid_inertia
        tensors = self._turned(rotations)[1] + added[:, 1, None, None] * np.eye(3)
        spin = np.linalg.solve(tensors, impulse[:, 3:, None])[..., 0]
        return np.concatenate([impulse[:, :3] / (self.masses + added[:, 0])[:, None], spin], axis=1)

    def _turned(self, rotations: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return matrices of the rotations [n, 4] and the tensors turned by them, [n, 3, 3]."""
        key = rotations.tobytes()
        if key not in self._turned_tensors:  # a step alternates between those of its start and its end
            if len(self._turned_tensors) > 1:
                self._turned_tensors.clear()
            turn = matrix_of(rotations)
            self._turned_tensors[key] = turn, turn @ self.tensors @ turn.transpose(0, 2, 1)
        return self._turned_tensors[key]

    def momentum_of(self, rotations: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        """Return the momentum [n, 6] of bodies with a velocity [n, 6]."""
        turn = self._turned(rotations)[0]
        spin = turn @ (self.tensors @ (turn.transpose(0, 2, 1) @ velocity[:, 3:, None]))
        return np.concatenate([velocity[:, :3] * self.masses[:, None], spin[..., 0]], axis=1)

    # --- states ---

    def to_rows(self) -> np.ndarray:
        """Return all that decides how it continues, float64 [n, 13, 6]: `ROWS`, then figures, then sums of the fit."""
        rest = np.zeros_like(self.impulse)
        rest[:, 0], rest[:, 1], rest[:, 2:4], rest[:, 4] = self.immersed, self.last_dt, self.added_mass, self.held
        rest[:, 5] = self.viscous_mass[:, 0]
        sums = np.pad(self.fit_sums.reshape(-1, 4), ((0, 0), (0, 2)))
        sums[:, 5] = self.displaced
        return np.stack([*(getattr(self, name) for name in ROWS), rest, sums], axis=1)

    def from_row(self, number: int, memory: np.ndarray) -> None:
        """Restore body `number` from its rows [13, 6] of `to_rows`."""
        for name, row in zip(ROWS, memory, strict=False):
            getattr(self, name)[number] = row
        rest = memory[len(ROWS)]
        self.immersed[number], self.last_dt = rest[0], float(rest[1])
        self.added_mass[number], self.held[number] = rest[2:4], bool(rest[4])
        mass = self.viscous_mass[:, 0].copy()
        mass[number] = rest[5]
        self._set_viscous_mass(mass)
        self.fit_sums[number], self.displaced[number] = memory[-1][:4].reshape(2, 2), memory[-1][5]
