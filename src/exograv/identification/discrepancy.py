"""What no parameter explains: a smooth field of torque over the postures, so that intervals stay true.

A model is never right everywhere. Without this term every further pass through the same posture would be taken as new
evidence, and the intervals would shrink past the truth.
"""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


class Discrepancy:
    """A Gaussian field per joint, by random Fourier features; its values are unknowns beside the parameters.

    Source: Rahimi & Recht 2007, NeurIPS 20 (features); Kennedy & O'Hagan 2001, JRSS B 63:425 (the idea).
    """

    def __init__(self, sd: Joints, length_rad: float, features: int, seed: int = 0):
        """
        Args:
            sd: Size of the field per joint [N·m].
            length_rad: Distance in posture over which the error changes [rad].
            features: Per joint; more follow the field more freely.
            seed: Of the features; part of the method, not of the data.
        """
        generator = np.random.default_rng(seed)
        self._frequencies = generator.standard_normal((features, len(sd))) / length_rad
        self._phases = generator.uniform(0.0, 2 * np.pi, features)
        self._sd = sd
        self.count = features * len(sd)
        """Number of unknowns."""

    def rows(self, q: Joints) -> Float[np.ndarray, "joint unknown"]:
        """Derivative of the torque [N·m] with respect to the unknowns, each of them N(0, 1), at posture q [rad]."""
        values = np.sqrt(2.0 / len(self._phases)) * np.cos(self._frequencies @ q + self._phases)
        return np.kron(np.diag(self._sd), values)
