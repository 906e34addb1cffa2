"""Decision to float: the part of an estimate that the machine carries, in place of the arm of the body table.

The table's arm is carried before any motion. Carrying an estimate changes its torque. On each axis the decision asks:
can that change make the left over larger? It can if the error of the estimate along the change may exceed half of the
change, because the table is then nearer to the arm. On such an axis only that part of the change is carried for which
the answer is no. Nothing but the estimate's own uncertainty enters.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from .interface import Agreement, Covariance, Estimate, Joints, Parameters
from .left_over import LeftOverPrediction, PostureTorque
from .physical import PhysicalProjection

CONFIDENCE_SD = 1.96
"""Bound of the error along a change [standard deviations]: that of a 95 % interval."""

MARGIN_NM = 0.05
"""Increase of the left over that does not count [N·m]: half of the elbow's target."""

WHOLE_SHARE = 1.0 - 1e-9
"""Share from which a change counts as carried in full [-]: below it by rounding only."""

ROUNDS, HEAVIER, MET_SHARE = 6, 2.5, 0.99
"""Number of blends that are tried [-]. Axes whose safe share of a blend is below `MET_SHARE` have `HEAVIER` times the
weight in the next one."""

RIDGE = 0.02
"""Cost of a parameter that goes back to the table's value, over that of a torque as large as the stated left over [-]:
only parameters that matter go back."""


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

    def of(self, estimate: Estimate) -> Estimate:
        """Return the estimate with the parameters that the machine carries, and their mean square error."""
        return replace(estimate, x=self.x, covariance=self.covariance)


def carried_arm(
    estimate: Estimate, table: BodyTable, prediction: LeftOverPrediction, bodies: tuple[slice, ...]
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
    covariance, stated = estimate.covariance, prediction.of(estimate)
    if covariance is None or stated is None or not np.isfinite(estimate.x).all():
        return CarriedArm(estimate.x, covariance, np.ones_like(unknown), size, unknown, unknown, unknown)
    of_table = np.hypot(prediction.rms(table.covariance), prediction.by_slip(estimate))
    axes = _Axes(estimate, covariance, prediction, change, stated, of_table)
    share, bounds = axes.safe_share(change), (size, axes.bound(change), stated, of_table)
    if (share >= WHOLE_SHARE).all():
        return CarriedArm(estimate.x, covariance, share, *bounds)
    x = _blended(axes, share, table.x, PhysicalProjection(bodies, table.x))
    away = x - estimate.x
    share = _along(prediction.torque_of(x - table.x), change) / np.maximum(size, 1e-12)
    return CarriedArm(x, covariance + np.outer(away, away), np.clip(share, 0.0, 1.0), *bounds)


@dataclass(frozen=True)
class _Axes:
    """Estimate and table, compared by axis."""

    estimate: Estimate
    covariance: Covariance
    prediction: LeftOverPrediction
    change: PostureTorque
    """Change of torque from the table to the estimate [N·m]."""
    stated: Joints
    of_table: Joints

    def bound(self, torque: PostureTorque) -> Joints:
        """Bound of the estimate's error along a torque [N·m]."""
        sd = self.prediction.sd_along(torque, self.covariance)
        return CONFIDENCE_SD * np.hypot(sd, self.prediction.by_slip(self.estimate))

    def safe_share(self, torque: PostureTorque) -> Joints:
        """Share of a change from the table that is surely no worse than the table [-]."""
        share = largest_share(_along(self.change, torque), _rms(torque), self.bound(torque))
        return np.where(self.stated <= self.of_table, share, np.minimum(share, _within_margin(_rms(torque))))

    def loss(self, torque: PostureTorque) -> float:
        """Mean square of the estimate's torque that a change from the table leaves out, over that stated [-]."""
        return float(np.sum((_rms(torque - self.change) / self.stated) ** 2))


def _blended(axes: _Axes, share: Joints, table: Parameters, project: PhysicalProjection) -> Parameters:
    """Return parameters whose change from the table is safe on each axis, and loses little of the estimate.

    The axes have common masses, so blends of table and estimate, parameter by parameter, meet the shares only nearly.
    Less of a blend's whole change is always safe, and possible bodies form a convex set that holds the table's.
    """
    estimate, prediction = axes.estimate.x, axes.prediction
    parts = prediction.parts_of(estimate - table)
    matter = np.flatnonzero(np.abs(parts).max(axis=(0, 1)) > 0.0)
    best = table + float(share.min()) * (estimate - table)
    weight = 1.0 / axes.stated
    for _ in range(ROUNDS):
        x = estimate.copy()
        x[matter] += (_bounded_fit(parts[..., matter], share * axes.change, weight) - 1.0) * (estimate - table)[matter]
        x = project(x, axes.covariance)
        safe = axes.safe_share(prediction.torque_of(x - table))
        x = table + float(safe.min()) * (x - table)
        best = min(best, x, key=lambda one: axes.loss(prediction.torque_of(one - table)))
        if safe.min() > MET_SHARE:
            break
        weight = np.where(safe < MET_SHARE, HEAVIER * weight, weight)
    return best


def _bounded_fit(
    parts: Float[np.ndarray, "posture joint part"], wanted: PostureTorque, weight: Joints
) -> Float[np.ndarray, " part"]:
    """Return the shares between 0 and 1 with which the parts come nearest to the wanted torque; else they stay near 1.

    Shares outside would leave the range in which the torque is linear in the parameters.
    """
    from scipy.optimize import lsq_linear  # imported here: takes 0.1 s, and most estimates are carried in full

    count, root = parts.shape[2], RIDGE * np.sqrt(len(parts))
    rows = (weight[:, None] * parts).reshape(-1, count)
    A = np.vstack([rows, root * np.eye(count)])
    return lsq_linear(A, np.concatenate([(weight * wanted).ravel(), np.full(count, root)]), (0.0, 1.0)).x


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
