"""Residual torque from the uncertainty of an estimate: arms drawn from it, each put into the controller's machine."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.control.resting import RestingTorque
from exograv.identification.core.interface import Estimate
from exograv.model.assembly import Assembly
from exograv.model.support import sample_postures

Joints = Float[np.ndarray, " joint"]

DRAWS = 512
"""Number of drawn arms. The 95th percentile of so many has an error of 4 % of itself."""

POSTURES = 32
"""Number of postures of the task workspace, in addition to the donning posture."""

SEED = 20_260_103


@dataclass(frozen=True)
class PosteriorTorque:
    """RMS over postures of the torque that may be left over because of the uncertainty of the arm [N·m]."""

    median: Joints
    p95: Joints
    """95th percentile of the residual torque over the arms that the data allow, joint by joint [N·m]."""

    draws: int
    """Number of drawn arms for which the machine's loops could be closed [-]."""


def posterior_torque(resting: RestingTorque, assembly: Assembly, estimate: Estimate) -> PosteriorTorque | None:
    """Compute the torque by Monte Carlo on an estimate's covariance, with the closed-loop model; None without one."""
    if estimate.covariance is None:
        return None
    postures = sample_postures(assembly.description, POSTURES)
    x = estimate.x
    known = resting(postures, np.tile(x, (len(postures), 1)), resting.cold_start(postures, x))
    rng = np.random.default_rng(SEED)
    # By eigenvalues: parameters that are not learned have no variance, and a Cholesky factor needs a positive definite
    # matrix.
    values, vectors = np.linalg.eigh(estimate.covariance)
    spread = vectors * np.sqrt(np.maximum(values, 0.0))
    arms = x + rng.standard_normal((DRAWS, len(x))) @ spread.T
    possible = resting(
        np.tile(postures, (DRAWS, 1)),
        np.repeat(arms, len(postures), axis=0),
        np.tile(known.z, (DRAWS, 1)),
        x_start=np.tile(x, (DRAWS * len(postures), 1)),
    )
    error = possible.tau_desired.reshape(DRAWS, len(postures), -1) - known.tau_desired
    usable = known.is_closed.all() & possible.is_closed.reshape(DRAWS, -1).all(axis=1)
    if not usable.any():
        return None
    rms = np.sqrt(np.mean(error[usable] ** 2, axis=1))
    median, p95 = np.percentile(rms, [50, 95], axis=0)
    return PosteriorTorque(median, p95, int(usable.sum()))
