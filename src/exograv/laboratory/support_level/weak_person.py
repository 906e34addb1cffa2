"""Virtual person of little strength who tries to reach targets: intended motion, its plan and felt weight.

The person reads the twin's true arm, as people know their own. It has no access to control or identification, and
the controller has none to it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from exograv import motion
from exograv.laboratory.movements import REST_DEG, TARGET_DEG
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.motion import Trajectory
from exograv.procedures.rehabilitation.support_level.flight import MOVE_S
from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.behaviour.weakness import Weakness, WeakWearer

TABLE_EVERY = 40
"""Ticks between two samples of the torque that a movement needs."""

POSTURE_WEIGHT = 0.03
"""Weight of an unusual posture [1/rad] against an error of the finger [1/m]: 10° for 5 mm."""

STRAYED_RAD = 0.02
"""Largest deviation from the intended posture that causes no corrective path."""

PerFreedom = Float[np.ndarray, " arm"]
Place = Float[np.ndarray, " 3"]


@dataclass(frozen=True)
class BodyKnowledge:
    """Knowledge of the own arm and of the familiar machine; computed once per person."""

    own: ArmInverseDynamics
    worn_inertia: Float[np.ndarray, "arm arm"]
    lower: PerFreedom
    upper: PerFreedom
    """Limits of postures that the machine can follow [rad]."""

    @classmethod
    def of(cls, laboratory: VirtualLaboratory, lower: PerFreedom, upper: PerFreedom) -> "BodyKnowledge":
        """Build the person's internal model of the laboratory's wearer in its machine."""
        return cls(laboratory.own_arm(), laboratory.worn_inertia(), lower, upper)

    def posture_at(self, place: Place) -> PerFreedom:
        """Return the most usual posture in which the fingertip is at a place [m], or nearest to it."""
        usual = np.clip(np.deg2rad(TARGET_DEG), self.lower, self.upper)

        def off(q: PerFreedom) -> Float[np.ndarray, " residual"]:
            return np.concatenate([self.own.fingertip(q) - place, POSTURE_WEIGHT * (q - usual)])

        return least_squares(off, usual, bounds=(self.lower, self.upper), xtol=1e-6, ftol=1e-8).x


class ReachingPerson:
    """Person in a running twin. Call `act` once per tick."""

    def __init__(self, body: BodyKnowledge, weakness: Weakness, twin: Twin, seed: int):
        """Start at rest, fully supported. `seed` draws the strength that each attempt mobilises, and the noise."""
        self._body, self._twin = body, twin
        self._muscles = WeakWearer(weakness, twin.period_s, np.random.default_rng([seed, 47]))
        self._rest = np.clip(np.deg2rad(REST_DEG), body.lower, body.upper)
        self._postures: dict[tuple[float, ...], PerFreedom] = {}
        self.gravity_felt = 0.0
        """Share of the arm's weight for which the muscles are prepared [-]. It follows the felt level."""

    def go_to(self, posture: PerFreedom, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Plan a motion to a posture [rad] from the present one, while the felt gravity level changes."""
        at = self._twin.truth.q_arm
        if np.abs(at - posture).max() < STRAYED_RAD:
            at = posture
        level = self.gravity_felt if gravity_level is None else gravity_level
        self._want(motion.minimum_jerk(at, posture, seconds, self._twin.period_s), level)
        self.gravity_felt = level

    def rest(self, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Plan the return to rest, while the felt gravity level changes."""
        self.go_to(self._rest, seconds, gravity_level)

    def reach(self, target: int, place: Place) -> None:
        """Plan a motion of the fingertip to a target at this place [m]."""
        key = tuple(place.tolist())
        if key not in self._postures:
            self._postures[key] = self._body.posture_at(place)
        self.go_to(self._postures[key])

    def attempt(self) -> None:
        """Mobilise strength for the next attempt."""
        self._muscles.attempt()

    def act(self) -> None:
        """Set the muscle torque of this tick."""
        truth = self._twin.truth
        self._twin.tau_voluntary[:] = self._muscles.step(self._twin.t, truth.q_arm, truth.v_arm)

    def _want(self, path: Trajectory, level: float) -> None:
        body, ticks = self._body, np.arange(len(path))
        rows = np.unique([*range(0, len(path), TABLE_EVERY), len(path) - 1])
        felt = self.gravity_felt + (level - self.gravity_felt) * rows / ticks[-1]
        needed = np.array([
            body.own.torque(path.q[k], path.v[k], path.a[k], g) + body.worn_inertia @ path.a[k]
            for k, g in zip(rows, felt, strict=True)
        ])  # fmt: skip
        self._muscles.want(path, np.column_stack([np.interp(ticks, rows, one) for one in needed.T]), self._twin.t)
