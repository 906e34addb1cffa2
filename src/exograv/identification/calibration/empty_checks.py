"""Plausibility checks of a calibration: weights, gains, encoders, tilt, links and residuals."""

import numpy as np

from exograv.errors import IdentificationError
from exograv.model.description import RigDescription

from .empty_fit import Fit

SURE_SD = 4.0
"""Standard deviations above which a disagreement is not chance [-]."""
WEIGHT_MAX = 0.10
"""Largest relative error of a known weight before the gains are known [-]; pounds for kilograms are 55 % off."""
GAIN_MAX = 0.35
"""Largest relative difference of a gain from the data sheet [-]. Unit tolerance is 5-10 %, and the worst twins have a
standard deviation of 10 %. Common mistakes are larger: peak for effective current 41 %, line for phase 73 %."""
OFFSET_MAX = np.deg2rad(3.0)
"""Largest offset of an encoder [rad]: three standard deviations of the worst twins. It changes the gravity torque of a
horizontal arm by 0.5 N·m."""
TILT_MAX = np.sin(np.deg2rad(4.5))
"""Largest tilt of the base [-]: three standard deviations of the worst twins; a spirit level shows a tenth of it."""
LINK_SD = 12.0
"""Largest difference of a link's weight from the URDF, in prior standard deviations [-]; five of the worst twins."""
RESIDUAL_SHARE = 0.04
"""Largest residual, as a share of the motor's largest torque [-]; the ripple of the worst twins is half of it."""


def refuse_wrong_weights(description: RigDescription, first: Fit) -> None:
    """Compare each known weight with links and data sheets, in a fit with a wide prior of the weights.

    Raises:
        IdentificationError: A weight differs from its stated mass.
    """
    block = first.prior.layout.weight
    for stated, share, sd in zip(description.calibration.weights_kg, first.theta[block], first.sd[block], strict=True):
        if abs(share - 1.0) > max(WEIGHT_MAX, SURE_SD * sd):
            low, high = stated * (share - 1.96 * sd), stated * (share + 1.96 * sd)
            raise IdentificationError(
                f"The weight of {stated:g} kg acts like {stated * share:.2f} kg (95 % interval {low:.2f} to {high:.2f} "
                f"kg); {WEIGHT_MAX:.0%} are allowed. Put it on a scale: is it marked in pounds, not hung at the mount, "
                "or different from calibration.weights_kg in rig.toml? If it is right, encoder and motor of a joint "
                "are both reversed, or joints are swapped. Correct that and repeat."
            )


def refuse_incredible(description: RigDescription, fit: Fit) -> None:
    """Refuse a calibration with implausible gains, tilt, offsets, links or residuals.

    Raises:
        IdentificationError: A value is outside its allowed range.
    """
    _refuse_gains(description, fit)
    _refuse_leaning(description, fit)
    _refuse_offsets(description, fit)
    _refuse_links(description, fit)
    _refuse_residuals(description, fit)


def _refuse_gains(description: RigDescription, fit: Fit) -> None:
    share = 1.0 / fit.theta[fit.prior.layout.of("inverse_gain")]
    for joint, nominal, found in zip(description.joints, description.nominal_gain, share, strict=True):
        if not 1.0 - GAIN_MAX <= found <= 1.0 + GAIN_MAX:
            raise IdentificationError(
                f"The gain of joint '{joint}' is {nominal * found:.3g} N·m/A, {found - 1.0:+.0%} off rig.toml's "
                f"{nominal:.3g} N·m/A; {GAIN_MAX:.0%} are allowed. Correct torque_constant_Nm_per_A, gear_ratio or "
                "efficiency in rig.toml (peak or effective current, which gear stage?), or repair the drive."
            )


def _refuse_leaning(description: RigDescription, fit: Fit) -> None:
    """Refuse a tilt of the base that is too large if all encoders are right.

    A tilt of the base and an encoder offset of the first joint cannot be distinguished.
    """
    tilt, offset = fit.prior.layout.tilt, fit.prior.layout.of("offset")
    shared = np.linalg.solve(fit.covariance[offset, offset], fit.theta[offset])
    leaning = np.rad2deg(np.arcsin(np.clip(fit.theta[tilt] - fit.covariance[tilt, offset] @ shared, -1.0, 1.0)))
    allowed = float(np.rad2deg(np.arcsin(TILT_MAX)))
    if np.abs(leaning).max() > allowed:
        raise IdentificationError(
            f"The base leans by {leaning[0]:+.1f}° forward and {leaning[1]:+.1f}° to the left by the weights, or the "
            f"encoder of joint '{description.joints[0]}' is off by as much; {allowed:.1f}° are allowed. "
            "Level the base. If it is level, set the zero of that encoder. If both are right, joints are swapped."
        )


def _refuse_offsets(description: RigDescription, fit: Fit) -> None:
    offsets = fit.theta[fit.prior.layout.of("offset")]
    for joint, offset in zip(description.joints, offsets, strict=True):
        if abs(offset) > OFFSET_MAX:
            raise IdentificationError(
                f"The encoder of joint '{joint}' reads {np.rad2deg(offset):+.1f}° more than the true angle according "
                f"to the weights; {np.rad2deg(OFFSET_MAX):.0f}° are allowed. Set its zero at the jig or the stop, then "
                "repeat. If the zero is right, the URDF's frames or the order of the joints are wrong."
            )


def _refuse_links(description: RigDescription, fit: Fit) -> None:
    """Refuse links whose mass or first moments differ from the URDF by more than `LINK_SD`."""
    block = fit.prior.layout.links
    off = (fit.theta - fit.prior.mean)[block] / np.sqrt(np.diag(fit.prior.covariance)[block])
    worst = np.abs(off.reshape(-1, 10)[:, :4]).max(axis=1)
    for joint, sds in zip(description.joints, worst, strict=True):
        if sds > LINK_SD:
            raise IdentificationError(
                f"The weight of the link behind joint '{joint}' differs from the URDF by {sds:.0f} standard deviations "
                f"(4 % of mass, 4 mm of centre); {LINK_SD:.0f} are allowed. Is a part attached to it, are two joints "
                "swapped, or are an encoder and its motor both reversed? Correct the URDF, the driver or the machine. "
                "If the drawing is rough: fit the machine's twin, and calibrate with --prior twin."
            )


def _refuse_residuals(description: RigDescription, fit: Fit) -> None:
    torque_max = description.per_actuator("torque_max_Nm")
    for joint, sd, most in zip(description.joints, fit.noise_and_ripple.sd, RESIDUAL_SHARE * torque_max, strict=True):
        if sd > most:
            raise IdentificationError(
                f"The model leaves {sd:.2f} N·m of the torque of joint '{joint}' unexplained; {most:.2f} N·m are "
                "allowed. Two joints may be swapped, an encoder and its motor may both be reversed, or a part rubs. "
                "Watch the machine while one joint moves, then repeat."
            )
