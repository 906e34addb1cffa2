"""Decision to float: the part of an estimate that the machine carries, in place of the arm of the body table.

The table's arm is carried before any motion. Carrying an estimate changes its torque. On each axis the decision asks:
can that change make the left over larger? It can if the error of the estimate along the change may exceed half of the
change, because the table is then nearer to the arm. On such an axis only that part of the change is carried for which
the answer is no. Nothing but the estimate's own uncertainty enters.
"""

from dataclasses import dataclass, replace

import numpy as np

from .interface import Agreement, Covariance, Estimate, Joints, Parameters
from .left_over import LeftOverPrediction, PostureTorque
from .physical import PhysicalProjection
from .square_root import square_root

CONFIDENCE_SD = 1.96
"""Bound of the error along a change [standard deviations]: that of a 95 % interval."""

MARGIN_NM = 0.05
"""Increase of the left over that does not count [N·m]: half of the elbow's target."""

WHOLE_SHARE = 1.0 - 1e-9
"""Share from which a change counts as carried in full [-]: below it by rounding only."""

BLEND_ERROR_NM = 0.01
"""Torque error at which a change of the parameters by one standard deviation weighs as much [N·m]."""

BLENDS = 4
"""Number of blends, each with smaller shares on axes where the one before may be worse than the table [-]."""


@dataclass(frozen=True)
class BodyTable:
    """Arm of the body table for the same person in the same machine."""

    x: Parameters
    """Parameters with which the arm is carried before any motion."""

    covariance: Covariance
    """Covariance of the prior."""


@dataclass(frozen=True)
class CarriedArm:
    """Arm that the machine carries while it floats.

    All bounds are NaN for a method without uncertainty, and for parameters that are not finite. The controller refuses
    the latter.
    """

    x: Parameters
    """Parameters: the estimate's where it is carried in full, else between those of the table and of the estimate."""

    covariance: Covariance | None
    """Mean square error of `x`; None if the method states no uncertainty."""

    share: Joints
    """Share of the change of torque, from the table to the estimate, that is carried [-]."""

    change_Nm: Joints
    """Change of torque from the table to the estimate, RMS over the task workspace [N·m]."""

    bound_Nm: Joints
    """95 % bound of the estimate's error along that change [N·m]."""

    stated_Nm: Joints
    """Left over that the estimate states for itself [N·m]."""

    table_Nm: Joints
    """Left over that the prior states for the table [N·m]."""

    @property
    def is_whole(self) -> bool:
        """True if the estimate is carried in full on every axis."""
        return bool((self.share >= WHOLE_SHARE).all())


def carried_arm(
    estimate: Estimate,
    table: BodyTable,
    prediction: LeftOverPrediction,
    bodies: tuple[slice, ...],
) -> CarriedArm:
    """Decide how much of an estimate is carried.

    Args:
        estimate: Estimate of the arm.
        table: Arm of the body table.
        prediction: Prediction of the left over for this arm in this machine.
        bodies: Slices with the inertial parameters of the bodies.
    """
    change = prediction.torque_of(estimate.x - table.x)
    unknown, size = np.full(change.shape[1], np.nan), _rms(change)
    covariance, stated, slip = estimate.covariance, prediction.of(estimate), prediction.by_slip(estimate)
    if covariance is None or stated is None or not np.isfinite(estimate.x).all():
        return CarriedArm(estimate.x, covariance, np.ones_like(unknown), size, unknown, unknown, unknown)
    of_table = np.hypot(prediction.rms(table.covariance), slip)

    def bound(torque: PostureTorque) -> Joints:
        return CONFIDENCE_SD * np.hypot(prediction.sd_along(torque, covariance), slip)

    def safe_share(torque: PostureTorque) -> Joints:
        share = largest_share(_along(change, torque), _rms(torque), bound(torque))
        return np.where(stated <= of_table, share, np.minimum(share, _within_margin(_rms(torque))))

    share = safe_share(change)
    found = share, size, bound(change), stated, of_table
    if (share >= WHOLE_SHARE).all():
        return CarriedArm(estimate.x, covariance, *found)
    goal, x, safe, project = share, estimate.x, share, PhysicalProjection(bodies, table.x)
    for _ in range(BLENDS):
        # The axes share the masses, so a blend meets the shares only nearly.
        x = project(_blended(estimate.x, covariance, (goal - 1.0) * change, prediction), covariance)
        safe = safe_share(prediction.torque_of(x - table.x))
        goal = goal * safe
    # Less of the whole change is always safe, and possible bodies form a convex set that holds the table's.
    x = table.x + float(safe.min()) * (x - table.x)
    away = x - estimate.x
    share = _along(prediction.torque_of(x - table.x), change) / np.maximum(size, MARGIN_NM * 1e-6)
    return CarriedArm(x, covariance + np.outer(away, away), np.clip(share, 0.0, 1.0), *found[1:])


def largest_share(along: Joints, size: Joints, bound: Joints) -> Joints:
    """Largest share of a change that, within its bound, leaves at most `MARGIN_NM` more than the table does [-].

    Let δ be the change from the table to the estimate, e the error of the estimate, and u a share of a change γ in
    the direction n. The table leaves |e − δ| and the share leaves |e − δ + u γ|, both RMS over postures. Both squares
    differ by u |γ| (2 ⟨e, n⟩ − 2 ⟨δ, n⟩ + u |γ|). The difference of the roots stays within the margin if

        ⟨e, n⟩ ≤ ⟨δ, n⟩ − u |γ| / 2 + margin / 2,  or if  u |γ| ≤ margin

    because the sum of both roots is at least u |γ|.

    Args:
        along: Component of δ along the change, ⟨δ, n⟩ [N·m].
        size: RMS of the change, |γ| [N·m].
        bound: Bound of the estimate's error along the change, of ⟨e, n⟩ [N·m].
    """
    enough = 2.0 * (along - bound + 0.5 * MARGIN_NM) / np.maximum(size, MARGIN_NM)
    return np.clip(np.maximum(enough, _within_margin(size)), 0.0, 1.0)


def widened_by_check(estimate: Estimate, prediction: LeftOverPrediction, agreement: Agreement | None) -> Estimate:
    """Return the estimate with a covariance that allows for the residual of a check that disagrees.

    The part of the residual that the estimate does not explain is added to its left over. The joint that needs most
    decides for all parameters, because no joint has parameters of its own.
    """
    stated = prediction.of(estimate)
    if agreement is None or agreement.holds or stated is None or estimate.covariance is None:
        return estimate
    excess = np.maximum(agreement.residual**2 - agreement.expected**2, 0.0)
    excess[agreement.p >= agreement.least_p] = 0.0
    return replace(estimate, covariance=estimate.covariance * (1.0 + float((excess / stated**2).max())))


def _within_margin(size: Joints) -> Joints:
    return np.minimum(MARGIN_NM / np.maximum(size, MARGIN_NM), 1.0)


def _rms(torque: PostureTorque) -> Joints:
    return np.sqrt(np.mean(torque**2, axis=0))


def _along(torque: PostureTorque, other: PostureTorque) -> Joints:
    """Component of a torque along the direction of another, mean over postures [N·m]."""
    return np.mean(torque * other, axis=0) / np.maximum(_rms(other), 1e-12)


def _blended(
    x: Parameters, covariance: Covariance, wanted: PostureTorque, prediction: LeftOverPrediction
) -> Parameters:
    """Return parameters near `x` that change its torque as wanted: ridge regression in the metric of the covariance."""
    factor = square_root(covariance)
    rows = np.stack([prediction.torque_of(column) for column in factor.T], axis=-1).reshape(wanted.size, -1)
    weight = BLEND_ERROR_NM**2 * np.eye(factor.shape[1])
    return x + factor @ np.linalg.solve(rows.T @ rows + weight, rows.T @ wanted.ravel())
