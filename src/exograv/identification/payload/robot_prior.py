"""Prior of a robot from its description, and of the changes of its friction between two logs."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.identification.core.interface import Covariance, Parameters
from exograv.identification.core.prior import COULOMB_DRIFT, VISCOUS_DRIFT
from exograv.model.tree import Tree

from .payload import RobotBlocks

# The description is only a prior: published inertias of robot arms are nominal, often those of simple shapes.
LINK_MASS_SD = 0.3  # share
LINK_CENTRE_SD_M = 0.10
LINK_INERTIA_SD = 0.5  # share of the mean moment
# Drives, as shares of the description's effort: friction of a geared joint is some tenths of it.
COULOMB_SD = 0.1  # of the effort
VISCOUS_SD = 1.0  # of effort over speed
ASYMMETRY_SD = 0.02  # of the effort
LOAD_SHARE_SD = 0.1
ROTOR_SD_S = 0.1  # of effort over speed: a drive needs at least a tenth of a second to reach its speed
CURVATURE_SD = 0.3  # of effort over squared speed

GAIN_SD = 0.05
"""Error of a stated torque gain, one standard deviation [-]: torque constant and efficiency of a drive that was not
calibrated, as at disturbance level 2 of the twin."""

ASYMMETRY_DRIFT = 0.02  # change of the torque offset between two logs, as a share of the Coulomb friction

FREEDOMS = 4.0
"""Degrees of freedom of Student's prior of a gain error [-]."""

GAIN_STEPS = 20

PRIOR_COUNT = 6.0
"""Number of observations that the assumed size of a gain error or of a change of friction counts for [-]."""


@dataclass(frozen=True)
class Spread:
    """Standard deviations that the logs themselves correct: gain errors, and changes of friction between two logs."""

    gain: float | Float[np.ndarray, " joint"] = GAIN_SD
    """Error of a joint's torque gain [-]; one for all joints, or one per joint."""

    coulomb: float = COULOMB_DRIFT
    """Change of the Coulomb friction [-]."""

    viscous: float = VISCOUS_DRIFT
    """Change of the viscous friction [-]."""

    asymmetry: float = ASYMMETRY_DRIFT
    """Change of the torque offset, as a share of the Coulomb friction [-]."""

    def changes(self, x: Parameters, n: int) -> Float[np.ndarray, " change"]:
        """Return the standard deviations of a log's changes, in the order of `changing`, for the robot `x`."""
        blocks = RobotBlocks(n)
        coulomb, viscous = np.abs(x[blocks.coulomb]), np.abs(x[blocks.viscous])
        return np.concatenate([self.coulomb * coulomb, self.viscous * viscous, self.asymmetry * coulomb])

    def corrected(
        self,
        gain: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]],
        changes: tuple[Float[np.ndarray, "log change"], Float[np.ndarray, "log change"]],
        x: Parameters,
    ) -> "Spread":
        """Sizes after one step of expectation and maximisation, with an inverse gamma prior around the assumed sizes.

        Args:
            gain: Gain errors and their variances.
            changes: Changes of each log and their variances.
            x: Robot, whose friction the changes are compared with.
        """
        n = len(gain[0])
        found = self._gain_sizes(gain[0] ** 2 + gain[1])
        if len(changes[0]) < 2:
            # One log cannot tell the changes from the friction itself.
            return replace(self, gain=found)
        squares = (changes[0] ** 2 + changes[1]) / np.maximum(Spread(1.0, 1.0, 1.0, 1.0).changes(x, n), 1e-12) ** 2
        coulomb, viscous, asymmetry = squares.reshape(len(squares), 3, n).swapaxes(0, 1).reshape(3, -1)
        return Spread(
            found,
            self._size(COULOMB_DRIFT, coulomb),
            self._size(VISCOUS_DRIFT, viscous),
            self._size(ASYMMETRY_DRIFT, asymmetry),
        )

    @classmethod
    def _gain_sizes(cls, squares: Float[np.ndarray, " joint"]) -> Float[np.ndarray, " joint"]:
        """Size of each joint's gain error, with Student's prior: one joint far off does not shift all others."""
        common, weight = GAIN_SD, np.ones_like(squares)
        for _ in range(GAIN_STEPS):
            common = cls._size(GAIN_SD, weight * squares)
            weight = (FREEDOMS + 1.0) / (FREEDOMS + squares / common**2)
        return common / np.sqrt(weight)

    @staticmethod
    def _size(assumed: float, squares: Float[np.ndarray, " value"]) -> float:
        return float(np.sqrt((PRIOR_COUNT * assumed**2 + squares.sum()) / (PRIOR_COUNT + len(squares))))


def changing(n: int) -> np.ndarray:
    """Return the indices of parameters that change between two logs: friction (Coulomb, viscous), and torque offset."""
    blocks = RobotBlocks(n)
    return np.r_[blocks.coulomb, blocks.viscous, blocks.asymmetry]


def robot_prior(tree: Tree) -> tuple[Parameters, Parameters]:
    """Prior mean and standard deviation of the robot's parameters from its description, without the payload's."""
    effort, speed = (np.array([getattr(joint, name) for joint in tree.joints]) for name in ("effort", "velocity"))
    blocks = RobotBlocks(len(tree.joints))
    mean = np.concatenate([tree.phi.ravel(), np.zeros(7 * blocks.n)])
    sds = [
        ROTOR_SD_S * effort / speed,
        COULOMB_SD * effort,
        VISCOUS_SD * effort / speed,
        np.full(blocks.n, LOAD_SHARE_SD),
        ASYMMETRY_SD * effort,
        CURVATURE_SD * effort / speed**2,
        np.full(blocks.n, GAIN_SD),
    ]
    links = [_link_sd(phi) for phi in tree.phi]
    return mean, np.concatenate([*links, *sds])


def with_changes(covariance: Covariance, spread: Spread, x: Parameters, n: int) -> Covariance:
    """Covariance (parameter, parameter) in a new log, whose friction differs from that of the unloaded logs."""
    later, entries = covariance.copy(), changing(n)
    later[entries, entries] += spread.changes(x, n) ** 2
    return later


def _link_sd(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, " 10"]:
    mass, moment = phi[0], (phi[4] + phi[6] + phi[9]) / 3
    inertia = LINK_INERTIA_SD * moment + mass * LINK_CENTRE_SD_M**2
    return np.array([LINK_MASS_SD * mass, *[mass * LINK_CENTRE_SD_M] * 3, *[inertia] * 6])
