"""What no parameter explains: smooth fields of torque over the postures, so that intervals stay true.

A model is never right everywhere. Without this every further pass through the same posture would be taken as new
evidence, and the intervals would shrink past the truth. The field is considered, not estimated: it widens the
covariance by what it could have done to the estimate.
"""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]

CLOSURE_ERROR_NM = 0.05
"""Of the soft loops, as tests/agreement holds them to [N·m]."""

POSTURE_LENGTH_RAD = 0.5
"""Distance in posture over which an error of the model changes: half a joint's range [rad]."""

FEATURES = 16
"""Of a joint's field, and again of the one that turns its sign with the motion [-]."""

TURNS_RAD_S = 0.05
"""Joint speed over which an error of the friction turns its sign [rad/s]."""


class Discrepancy:
    """Two Gaussian fields per joint, by random Fourier features: one that stays, and one that turns with the motion.

    Source: Rahimi & Recht 2007, NeurIPS 20 (features); Kennedy & O'Hagan 2001, JRSS B 63:425 (the idea).
    """

    def __init__(self, sd: Joints, length_rad: float, features: int, seed: int = 0, turning: bool = True):
        """Draw the features.

        Args:
            sd: Size of the field per joint [N·m].
            length_rad: Distance in posture over which the error changes [rad].
            features: Per joint; more follow the field more closely.
            seed: Of the features; part of the method, not of the data.
            turning: Whether there is an error that turns its sign with the motion.
        """
        generator = np.random.default_rng(seed)
        self._frequencies = generator.standard_normal((2 * features, len(sd))) / length_rad
        self._phases = generator.uniform(0.0, 2 * np.pi, 2 * features)
        self._features, self._sd, self._turning_sd = features, sd, sd if turning else np.zeros_like(sd)
        self.count = 2 * features * len(sd)
        """Number of independent errors."""

    @classmethod
    def of_machine(cls, residual_sd: Joints) -> "Discrepancy":
        """What stage 0 left unexplained (joint,) [N·m] may be a function of posture as well as noise."""
        return cls(np.hypot(CLOSURE_ERROR_NM, residual_sd), POSTURE_LENGTH_RAD, FEATURES)

    def errors(self, q: Joints, v: Joints) -> Float[np.ndarray, "joint considered"]:
        """What each error of standard size adds to the torque [N·m] at posture `q` [rad] and speed `v` [rad/s]."""
        n, values = self._features, np.cos(self._frequencies @ q + self._phases)
        turning = np.outer(self._turning_sd * np.tanh(v / TURNS_RAD_S), values[n:])
        by_joint = np.hstack([np.outer(self._sd, values[:n]), turning])
        errors = np.zeros((len(q), len(q), 2 * n))
        errors[np.arange(len(q)), np.arange(len(q))] = np.sqrt(2.0 / n) * by_joint
        return errors.reshape(len(q), -1)
