"""Discrepancy of the model: smooth torque fields over posture that no parameter explains.

Every model has errors that depend on posture. Without the fields, each repeated pass through the same posture would
count as new evidence, and the intervals would become smaller than the real error. The fields are considered, not
estimated (Schmidt): they widen the covariance by their possible effect on the estimate.
"""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]

CLOSURE_ERROR_NM = 0.05
"""Torque error of the soft loops, as bounded in tests/agreement [N·m]."""

POSTURE_LENGTH_RAD = 0.5
"""Correlation length of a model error over posture [rad]: half a joint's range."""

FEATURES = 16
"""Number of random features of each joint's field, and of the field that changes sign with the direction [-]."""

TURNS_RAD_S = 0.05
"""Joint speed over which a friction error changes sign [rad/s]."""


class Discrepancy:
    """Two Gaussian fields per joint, by random Fourier features: one static, one that changes sign with the direction.

    Source: Rahimi & Recht 2007, NeurIPS 20 (features); Kennedy & O'Hagan 2001, JRSS B 63:425 (the idea).
    """

    def __init__(self, sd: Joints, length_rad: float, features: int, seed: int = 0, turning: bool = True):
        """Draw the features.

        Args:
            sd: Standard deviation of the field per joint [N·m].
            length_rad: Correlation length of the error over posture [rad].
            features: Number of features per joint; more of them approximate the field better.
            seed: Seed of the features; it belongs to the method, not to the data.
            turning: True to add an error that changes sign with the direction of motion.
        """
        generator = np.random.default_rng(seed)
        self._frequencies = generator.standard_normal((2 * features, len(sd))) / length_rad
        self._phases = generator.uniform(0.0, 2 * np.pi, 2 * features)
        self._features, self._sd, self._turning_sd = features, sd, sd if turning else np.zeros_like(sd)
        self.count = 2 * features * len(sd)
        """Number of independent errors of all joints together."""

    @classmethod
    def of_machine(cls, residual_sd: Joints) -> "Discrepancy":
        """Discrepancy of a calibrated machine.

        The residual of stage 0 `residual_sd` (joint,) [N·m] may be a function of posture as well as noise.
        """
        return cls(np.hypot(CLOSURE_ERROR_NM, residual_sd), POSTURE_LENGTH_RAD, FEATURES)

    @property
    def count_of_joint(self) -> int:
        """Number of independent errors of one joint."""
        return 2 * self._features

    def errors_of_joint(self, q: Joints, v: Joints) -> Float[np.ndarray, "joint considered"]:
        """Torque [N·m] of each joint's own errors at one standard deviation, at posture `q` and velocity `v`."""
        n, values = self._features, np.cos(self._frequencies @ q + self._phases)
        turning = np.outer(self._turning_sd * np.tanh(v / TURNS_RAD_S), values[n:])
        return np.sqrt(2.0 / n) * np.hstack([np.outer(self._sd, values[:n]), turning])

    def errors(self, q: Joints, v: Joints) -> Float[np.ndarray, "joint considered"]:
        """Torque [N·m] of all errors at one standard deviation, at posture `q` [rad] and velocity `v` [rad/s]."""
        errors = np.zeros((len(q), len(q), self.count_of_joint))
        errors[np.arange(len(q)), np.arange(len(q))] = self.errors_of_joint(q, v)
        return errors.reshape(len(q), -1)
