"""A virtual person of little strength who tries to reach: what is wanted, planned with the own arm, and felt.

Reads the twin's own arm, as a person knows theirs; nothing of control or identification is known here, and control
knows nothing of this.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from exograv import motion
from exograv.laboratory.movements import REST_DEG, TARGET_DEG
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.motion import Trajectory
from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.behaviour.weakness import Weakness, WeakWearer

MOVE_S = 2.0
"""For a reach, and for the way back; assumed: without hurry, as somebody who is weak is asked to."""

TABLE_EVERY = 40
"""Ticks between two at which it is worked out what a movement needs."""

POSTURE_WEIGHT = 0.03
"""Of an unusual posture [1/rad] against a finger that is off [1/m]: 10° for 5 mm."""

STRAYED_RAD = 0.02
"""From the posture that is kept, up to which nobody plans a way back."""

PerFreedom = Float[np.ndarray, " arm"]
Place = Float[np.ndarray, " 3"]


@dataclass(frozen=True)
class BodyKnowledge:
    """What somebody knows of the own arm and of the machine they are used to; made once a person."""

    own: ArmInverseDynamics
    worn_inertia: Float[np.ndarray, "arm arm"]
    lower: PerFreedom
    upper: PerFreedom
    """Postures into which the machine goes along [rad]."""

    @classmethod
    def of(cls, laboratory: VirtualLaboratory, lower: PerFreedom, upper: PerFreedom) -> "BodyKnowledge":
        """Of the laboratory's wearer in its machine."""
        return cls(laboratory.own_arm(), laboratory.worn_inertia(), lower, upper)

    def posture_at(self, place: Place) -> PerFreedom:
        """The most usual posture in which the fingertip is at a place [m], or nearest to it."""
        usual = np.clip(np.deg2rad(TARGET_DEG), self.lower, self.upper)

        def off(q: PerFreedom) -> Float[np.ndarray, " residual"]:
            return np.concatenate([self.own.fingertip(q) - place, POSTURE_WEIGHT * (q - usual)])

        return least_squares(off, usual, bounds=(self.lower, self.upper), xtol=1e-6, ftol=1e-8).x


class ReachingPerson:
    """In a twin that somebody else flies; `act` once a tick."""

    def __init__(self, body: BodyKnowledge, weakness: Weakness, twin: Twin, seed: int):
        """At rest, fully supported; `seed` draws what each attempt mobilises, and noise."""
        self._body, self._twin = body, twin
        self._muscles = WeakWearer(weakness, twin.period_s, np.random.default_rng([seed, 47]))
        self.rest = np.clip(np.deg2rad(REST_DEG), body.lower, body.upper)
        self._postures: dict[tuple[float, ...], PerFreedom] = {}
        self.gravity_felt = 0.0
        """Share of the arm's weight that muscles are prepared for; who lets it sink in feels it [-]."""

    def go_to(self, posture: PerFreedom, seconds: float = MOVE_S, gravity_level: float | None = None) -> None:
        """Want to be in a posture [rad], from where the arm is, feeling the gravity level come to another one."""
        at = self._twin.truth.q_arm
        if np.abs(at - posture).max() < STRAYED_RAD:
            at = posture
        level = self.gravity_felt if gravity_level is None else gravity_level
        self._want(motion.minimum_jerk(at, posture, seconds, self._twin.period_s), level)
        self.gravity_felt = level

    def reach(self, place: Place) -> None:
        """Want to have the fingertip at a place [m]."""
        key = tuple(place.tolist())
        if key not in self._postures:
            self._postures[key] = self._body.posture_at(place)
        self.go_to(self._postures[key])

    def attempt(self) -> None:
        """Pull oneself together for what comes."""
        self._muscles.attempt()

    def act(self) -> None:
        """Give the twin's arm this tick's muscle torque."""
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
