"""Path of a shoulder's centre that no parameter describes: smooth errors over posture, considered like `Discrepancy`.

The cuffs turn an error of the path into torque, so that stiff cuffs need wider intervals. A field of torque of a fixed
size does not know the cuffs.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from .discrepancy import POSTURE_LENGTH_RAD, Joints

PATH_ERROR_M = 0.001
"""Standard deviation of the error of the path, per axis [m]: the size of the further shapes that are learned
(`prior.PATH_SD`). Assumed."""

PATH_FEATURES = 8
"""Number of random features of the error along each axis [-]."""

SEED = 7
"""Seed of the features; it belongs to the method, not to the data."""


class PathDiscrepancy:
    """Gaussian field of the error of the shoulder's centre along each axis, by random Fourier features."""

    def __init__(self, offsets: Sequence[slice], joints: int, sd_m: float = PATH_ERROR_M):
        """Draw the features.

        Args:
            offsets: Offset of the centre of each shoulder (3,) among the parameters [m].
            joints: Number of joints of the machine.
            sd_m: Standard deviation of the error per axis [m].
        """
        generator = np.random.default_rng(SEED)
        self._offsets = tuple(offsets)
        self._frequencies = generator.standard_normal((PATH_FEATURES, joints)) / POSTURE_LENGTH_RAD
        self._phases = generator.uniform(0.0, 2 * np.pi, PATH_FEATURES)
        self._size = sd_m * np.sqrt(2.0 / PATH_FEATURES)
        self.count_of_joint = 3 * PATH_FEATURES
        """Number of considered errors of each joint."""

    def displacements(self, q: Joints) -> Float[np.ndarray, " feature"]:
        """Displacement along an axis by each feature at one standard deviation, at posture `q` [m]."""
        return self._size * np.cos(self._frequencies @ q + self._phases)

    def errors_of_joint(
        self,
        derivative: Float[np.ndarray, "*sample joint parameter"],
        displacements: Float[np.ndarray, "*sample feature"],
    ) -> Float[np.ndarray, "*sample joint considered"]:
        """Torque [N·m] of each joint's own errors at one standard deviation.

        Args:
            derivative: Derivative of the torque with respect to the parameters.
            displacements: `displacements` of the same samples.
        """
        # A joint feels the shoulder of its own arm only; the errors of two shoulders may therefore share the columns.
        by_offset = np.sum([derivative[..., offset] for offset in self._offsets], axis=0)
        torque = by_offset[..., :, None] * displacements[..., None, None, :]
        return torque.reshape(*torque.shape[:-2], self.count_of_joint)
