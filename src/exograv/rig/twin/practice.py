"""Practice: what a person comes to anticipate in a movement that is repeated, from what went wrong the last time.

    tau ← tau + rate · (M a_e + (1 + reflex) (damping v_e + stiffness q_e))(t + muscle lag) − let_go · [q_e small] · tau

q_e, v_e, a_e are wanted minus true. The bracket is the torque that would have prevented the error, by the own arm's
inertia and impedance; nothing of the machine is known. Torque that is not missed is let go: people make no more of it
than the task asks for.

Source: anticipation learned from the last repetition's error, and let go where the error is small, after Franklin et
al. (2008), J Neurosci 28:11165; here torques in place of muscles, and a whole impedance in place of one gain.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory

from .acting import Physiology

Table = Float[np.ndarray, "tick arm"]


@dataclass(frozen=True)
class Learner:
    """How somebody learns a movement; all assumed."""

    rate: float = 0.6
    """Share of an error that the next repetition prevents [-]."""

    let_go: float = 0.1
    """Share of the torque that is given up where it is not missed, each time [-]."""

    tolerance: float = float(np.deg2rad(0.5))
    """Error below which torque is not missed [rad]: half of what a transparency test allows."""

    bandwidth_Hz: float = 3.0
    """Of what is anticipated [Hz]. Faster, arm and machine move apart in their cuffs, and practice would teach a tremor."""


class Practice:
    """What somebody anticipates in one movement that ends where it began."""

    def __init__(
        self,
        movement: Trajectory,
        physiology: Physiology,
        inertia: Float[np.ndarray, "arm arm"],
        first_guess: Table,
        learner: Learner | None = None,
    ):
        """`inertia` is the own arm's [kg·m²]."""
        self._dt, self._body, self._inertia = movement.dt, physiology, inertia
        self._learner = learner or Learner()
        self.anticipated = first_guess
        """For the next repetition (tick, arm) [N·m]."""

    def repeated(self, error: Table) -> None:
        """Learn from one repetition's `error`, wanted minus true position in every tick (tick, arm) [rad]."""
        body, learner = self._body, self._learner
        q, v, a = smooth_derivatives(error, self._dt, learner.bandwidth_Hz)
        missed = a @ self._inertia.T + (1.0 + body.reflex_share) * (v * body.damping + q * body.stiffness)
        missed = np.roll(missed, -round(body.muscle_lag / self._dt), axis=0)
        share = learner.let_go * np.clip(1.0 - np.abs(q) / learner.tolerance, 0.0, 1.0)
        learned = (1.0 - share) * self.anticipated + learner.rate * missed
        self.anticipated = smooth_derivatives(learned, self._dt, learner.bandwidth_Hz)[0]


def smooth_derivatives(values: Table, dt: float, bandwidth_Hz: float) -> tuple[Table, Table, Table]:
    """Periodic values (tick, arm), their first and second derivative, without lag and without what is faster."""
    frequency = np.fft.rfftfreq(len(values), dt)[:, None]
    # Flat up to the edge: what is smoothed again at every repetition must not fade.
    smooth = np.fft.rfft(values, axis=0) / (1.0 + (frequency / bandwidth_Hz) ** 8)
    first, second = 2j * np.pi * frequency, -((2.0 * np.pi * frequency) ** 2)
    q, v, a = (np.fft.irfft(factor * smooth, len(values), axis=0) for factor in (np.ones_like(first), first, second))
    return q, v, a
