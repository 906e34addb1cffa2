"""Outcomes of the identification of a payload, and the refusal of a negative mass."""

import enum

import numpy as np
from scipy.stats import norm

from exograv.errors import IdentificationError
from exograv.identification.core.interface import Estimate

from .first_fit import FirstFit
from .payload import NOTHING

STRANGE_RATIO = 2.0  # RMS residual with the payload over that without, in any joint
WELL_KNOWN = 0.05  # half of the mass interval as a share of the mass
STRANGE_SHARE = 0.3  # share of samples that the model did not explain
NOT_FITTED_RATIO = 2.0  # weighted squared residual over that of the direct fit
QUANTILE_95 = float(norm.ppf(0.975))


class PayloadOutcome(enum.Enum):
    """Outcome of an identification of a payload; the value is a sentence for the reader of the result."""

    FOUND = "The payload is identified: the 95 % interval of its mass is within ±5 %."
    COARSE = "A payload was found, but its mass is known only roughly. Record a longer or faster motion."
    NOTHING_THERE = "No payload was found: the interval of its mass contains zero. Check that this is the loaded log."
    STRANGE = "The torques fit no rigid payload at this frame. Check frame, gains, and that nothing touched the robot."
    NOT_FITTED = (
        "The method did not fit the log: its torque error is far above that of a direct fit. Its mass may be "
        "far off, and no interval is stated. Use --method recursive."
    )
    NO_INTERVAL = "The log is over. This method states no uncertainty, so the accuracy of the payload is not known."


def judge(
    estimate: Estimate, interval_kg: tuple[float, float] | None, unexplained_ratio: float, is_fitted: bool
) -> PayloadOutcome:
    """Determine the outcome at the end of the log.

    Args:
        estimate: Last estimate.
        interval_kg: 95 % interval of the mass; None if the method states no uncertainty.
        unexplained_ratio: RMS of the loaded residual over that of the unloaded residual, in the worst joint [-].
        is_fitted: False if the method did not reach the least squares of the log.
    """
    if not is_fitted:
        return PayloadOutcome.NOT_FITTED
    if interval_kg is None:
        return PayloadOutcome.NO_INTERVAL
    if interval_kg[0] <= 0.0:
        return PayloadOutcome.NOTHING_THERE
    if estimate.rejected_share > STRANGE_SHARE or unexplained_ratio > STRANGE_RATIO:
        return PayloadOutcome.STRANGE
    half = 0.5 * (interval_kg[1] - interval_kg[0])
    return PayloadOutcome.FOUND if half <= WELL_KNOWN * estimate.x[0] else PayloadOutcome.COARSE


def mass_interval(estimate: Estimate, gain_sd: float) -> tuple[float, float] | None:
    """95 % interval of the mass [kg]; None if the method states no uncertainty.

    Args:
        estimate: Estimate of the payload.
        gain_sd: Relative standard deviation that the torque gains of all joints share [-]. Torque and mass then have
            the same relative error. The covariance already contains independent errors of the joints.
    """
    if estimate.covariance is None:
        return None
    mass = float(estimate.x[0])
    half = QUANTILE_95 * float(np.hypot(estimate.sd[0], gain_sd * mass))
    return mass - half, mass + half


def refuse_negative_mass(first: FirstFit) -> None:
    """Refuse a log in which the robot carried less than in the unloaded log.

    Physical parameters cannot be negative and would hide this mistake.

    Raises:
        IdentificationError: The mass that explains the log best is significantly negative.
    """
    mass, sd_mass = float(first.x[0]), float(np.sqrt(first.covariance[0, 0]))
    if mass + QUANTILE_95 * sd_mass < -NOTHING[0]:
        raise IdentificationError(
            f"The log fits a payload of {mass:.2f} kg: the robot carried less there than in the unloaded log. "
            "Are the two logs swapped? Give the log with the payload first, the unloaded log with --unloaded. "
            "Or do the gains have the wrong sign?"
        )
