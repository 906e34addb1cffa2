"""What no parameter explains: a smooth field of torque over the postures, so that intervals stay true.

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
"""Of a joint's field [-]."""


class Discrepancy:
    """A Gaussian field per joint, by random Fourier features.

    Source: Rahimi & Recht 2007, NeurIPS 20 (features); Kennedy & O'Hagan 2001, JRSS B 63:425 (the idea).
    """

    def __init__(self, sd: Joints, length_rad: float, features: int, seed: int = 0):
        """Draw the features.

        Args:
            sd: Size of the field per joint [N·m].
            length_rad: Distance in posture over which the error changes [rad].
            features: Per joint; more follow the field more closely.
            seed: Of the features; part of the method, not of the data.
        """
        generator = np.random.default_rng(seed)
        self._frequencies = generator.standard_normal((features, len(sd))) / length_rad
        self._phases = generator.uniform(0.0, 2 * np.pi, features)
        self._sd = np.diag(sd)[:, :, None]
        self.count = features * len(sd)
        """Number of independent errors."""

    @classmethod
    def of_machine(cls, residual_sd: Joints) -> "Discrepancy":
        """What stage 0 left unexplained (joint,) [N·m] may be a function of posture as well as noise."""
        return cls(np.hypot(CLOSURE_ERROR_NM, residual_sd), POSTURE_LENGTH_RAD, FEATURES)

    def errors(self, q: Joints) -> Float[np.ndarray, "joint considered"]:
        """What each error of standard size adds to the torque at posture `q` [rad] [N·m]."""
        values = np.sqrt(2.0 / len(self._phases)) * np.cos(self._frequencies @ q + self._phases)
        return (self._sd * values).reshape(len(q), -1)
