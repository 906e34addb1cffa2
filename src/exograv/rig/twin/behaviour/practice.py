"""Practice of a repeated movement: the anticipated torque is corrected from the error of the last repetition.

    tau ← tau + rate · (M a_e + (1 + reflex) (damping v_e + stiffness q_e))(t + muscle lag) − let_go · [q_e small] · tau

q_e, v_e, a_e are wanted minus true. The bracket is the torque that would have prevented the error, by the inertia and
impedance of the own arm, without knowledge of the machine. Torque that is not needed decays, because people produce no
more torque than the task requires.

Source: anticipation learned from the last repetition's error, and reduced where the error is small, after Franklin et
al. (2008), J Neurosci 28:11165; here with torques in place of muscles, and a whole impedance in place of one gain.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory

from .acting_wearer import Physiology

Table = Float[np.ndarray, "tick arm"]


@dataclass(frozen=True)
class Learner:
    """Learning rates of a participant; all assumed."""

    rate: float = 0.5
    """Share of an error that the next repetition prevents [-]."""

    let_go: float = 0.1
    """Share of the torque that is given up per repetition where the error is small [-]."""

    tolerance: float = float(np.deg2rad(0.5))
    """Error below which torque is not missed [rad]: half of the limit of a transparency test."""

    bandwidth_Hz: float = 2.0
    """Bandwidth of the anticipated torque [Hz].

    At a higher bandwidth, arm and machine move apart in their cuffs, and practice teaches a tremor.
    """


SENSITIVITY, GROWTH = (0.3, 4.0), 0.25
"""Range of the sensitivity to an error, over the torque that it would need without friction, and its rate of change.

Sensitivity to errors grows while they are consistent: Herzfeld et al. (2014), Science 345:1349 (unverified); the
numbers are assumed.
"""


TENSION_MAX, TENSE, EASE = 3.0, 1.15, 0.98
"""Greatest stiffening, and its factors after a repetition with a large and with a small error [-]; assumed.

Stiffness measured in the arm grows by about as much from rest to strong co-contraction (Gomi & Osu 1998, unverified).
"""


def tensed(tension: Float[np.ndarray, " arm"], error: Table, kept: float) -> Float[np.ndarray, " arm"]:
    """Co-contraction for the next repetition [-], after one with this error (tick, arm) [rad].

    Joints with an RMS error above `kept` [rad] are stiffened, the others eased. This is the second part of the rule of
    Franklin et al. (2008).
    """
    strays = np.sqrt(np.mean(error**2, axis=0)) > kept
    return np.clip(tension * np.where(strays, TENSE, EASE), 1.0, TENSION_MAX)


class Practice:
    """Anticipated torque of a wearer in one movement that ends where it began."""

    def __init__(
        self,
        movement: Trajectory,
        physiology: Physiology,
        inertia: Float[np.ndarray, "arm arm"],
        first_guess: Table,
        learner: Learner | None = None,
    ):
        """Start with `first_guess`; `inertia` is the own arm's [kg·m²]."""
        self._dt, self._body, self._inertia = movement.dt, physiology, inertia
        self._learner = learner or Learner()
        self.anticipated = first_guess
        """Anticipated torque for the next repetition (tick, arm) [N·m]."""
        self._sensitivity = np.ones(movement.q.shape[1])
        self._last: Table | None = None

    def repeated(self, error: Table) -> None:
        """Learn from one repetition's `error`, wanted minus true position in every tick (tick, arm) [rad]."""
        body, learner = self._body, self._learner
        q, v, a = smooth_derivatives(error, self._dt, learner.bandwidth_Hz)
        self._become_sensitive(v)
        missed = a @ self._inertia.T
        missed += (1.0 + body.nerves.reflex_share) * (self._sensitivity * v * body.damping + q * body.stiffness)
        missed = np.roll(missed, -round(body.nerves.muscle_lag / self._dt), axis=0)
        # No torque is given up at a joint with large errors: on friction it would slip from one side to the other for
        # ever.
        strays = np.sqrt(np.mean(error**2, axis=0)) / (2.0 * learner.tolerance)
        share = learner.let_go * _spare(np.abs(q) / learner.tolerance) * _spare(strays)
        learned = (1.0 - share) * self.anticipated + learner.rate * missed
        self.anticipated = smooth_derivatives(learned, self._dt, learner.bandwidth_Hz)[0]

    def _become_sensitive(self, v: Table) -> None:
        """Raise the sensitivity to errors that repeat, and lower it for errors that change sign."""
        if self._last is not None:
            alike = (v * self._last).sum(axis=0) / (np.linalg.norm(v, axis=0) * np.linalg.norm(self._last, axis=0))
            self._sensitivity = np.clip(self._sensitivity * (1.0 + GROWTH * alike), *SENSITIVITY)
        self._last = v


def _spare(error: Table | Float[np.ndarray, " arm"]) -> Table | Float[np.ndarray, " arm"]:
    """Share of torque that is not needed: 1 without error, 0 from the tolerance on."""
    return np.clip(1.0 - error, 0.0, 1.0)


def smooth_derivatives(values: Table, dt: float, bandwidth_Hz: float) -> tuple[Table, Table, Table]:
    """Periodic values (tick, arm), and their first and second derivative, low-pass filtered without lag."""
    frequency = np.fft.rfftfreq(len(values), dt)[:, None]
    # The filter is flat up to its edge, so that values that are filtered at every repetition do not decay.
    smooth = np.fft.rfft(values, axis=0) / (1.0 + (frequency / bandwidth_Hz) ** 8)
    first, second = 2j * np.pi * frequency, -((2.0 * np.pi * frequency) ** 2)
    q, v, a = (np.fft.irfft(factor * smooth, len(values), axis=0) for factor in (np.ones_like(first), first, second))
    return q, v, a
