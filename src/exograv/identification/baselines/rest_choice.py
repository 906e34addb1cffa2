"""Choice of resting postures that give the smallest expected weight error in all other postures."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.prior import prior

from .rest_statics import Balance, RestStatics

Gain = Float[np.ndarray, "phi row"]
"""Correction of the inertial parameters per residual torque at the rests, after subtraction of the table's weight."""

GainOf = Callable[[Float[np.ndarray, "row phi"]], Gain]


def gravity_spread(statics: RestStatics) -> Float[np.ndarray, "phi phi"]:
    """Return the table's covariance of masses and first moments; zero for inertias, which gravity does not show."""
    covariance = statics.assembly.arm.phi_covariance.copy()
    unseen = np.arange(len(covariance)) % 10 > 3
    covariance[unseen] = 0.0
    covariance[:, unseen] = 0.0
    return covariance


def best_rests(statics: RestStatics, gain_of: GainOf, count: int) -> Float[np.ndarray, "rest joint"]:
    """Return the postures [rad] with the smallest expected error of the arm's gravity torque over the workspace.

    The expectation is over arms with the table's spread, and over the elastic torque of usual joints, which these
    methods count as weight. It needs no measurement, so the postures are the same for all people with the same body
    measures.

    Args:
        statics: Statics of the arm in the machine.
        gain_of: Function from the stacked rows `Y` of the rests to the gain of the method.
        count: Number of postures, one or two; all combinations of candidates are tried.
    """
    postures = statics.candidates()
    balances = [statics.weight_at(q) for q in postures]
    pulls = _elastic_squares(statics, balances)
    spread = gravity_spread(statics)
    importance = np.sum([balance.Y.T @ balance.Y for balance in balances], axis=0)

    def expected_error(chosen: tuple[int, ...]) -> float:
        Y = np.vstack([balances[i].Y for i in chosen])
        gain = gain_of(Y)
        missed = gain @ Y - np.eye(len(spread))
        noise = gain * np.concatenate([pulls[i] for i in chosen])
        return float(np.trace(importance @ (missed @ spread @ missed.T + noise @ gain.T)))

    return postures[list(min(itertools.combinations(range(len(postures)), count), key=expected_error))]


def _elastic_squares(statics: RestStatics, balances: Sequence[Balance]) -> Float[np.ndarray, "posture freedom"]:
    """Mean square of the elastic torque K z − c of each freedom under the prior distribution [N²·m²]."""
    layout = ParameterLayout.of(statics.assembly)
    mean, covariance = prior(statics.assembly, statics.machine)
    K, c = layout.stiffness, layout.spring_offset
    z, variances = np.array([balance.z for balance in balances]), np.diag(covariance)
    variance = variances[K] * z**2 + variances[c] - 2.0 * z * np.diag(covariance[K, c])
    return (mean[K] * z - mean[c]) ** 2 + variance
