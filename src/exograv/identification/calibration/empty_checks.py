"""What a calibration must look like to be believed: weights, gains, encoders, links and residuals that can be."""

import numpy as np

from exograv.errors import IdentificationError
from exograv.model.description import RigDescription

from .empty_fit import Fit

SURE_SD = 4.0
"""Standard deviations from which a disagreement is none of chance [-]."""
WEIGHT_MAX = 0.10
"""Share by which a known weight may seem wrong before the gains are known: pounds for kilograms are 55 % off."""
GAIN_MAX = 0.35
"""Share by which a gain may differ from the data sheet's. Unit tolerance is 5-10 % and the worst twins have a standard
deviation of 10 %; the commonest mistakes are larger: peak for effective current 41 %, line for phase 73 %."""
OFFSET_MAX = np.deg2rad(3.0)
"""Of an encoder: three standard deviations of the worst twins; an arm held level then weighs 0.5 N·m too much or too
little [rad]."""
TILT_MAX = np.sin(np.deg2rad(4.5))
"""Of the base: three standard deviations of the worst twins; a spirit level shows a tenth of it [-]."""
LINK_SD = 12.0
"""Prior standard deviations by which a link's weight may differ from the URDF's; five of the worst twins."""
RESIDUAL_SHARE = 0.04
"""Of the motor's largest torque: what may stay unexplained; ripple of the worst twins is half of it."""


def refuse_wrong_weights(description: RigDescription, first: Fit) -> None:
    """Compare each known weight with links and data sheets, in a fit that does not trust it.

    Raises:
        IdentificationError: A weight is not what it is said to be.
    """
    block = first.prior.layout.weight
    for stated, share, sd in zip(description.calibration.weights_kg, first.theta[block], first.sd[block], strict=True):
        if abs(share - 1.0) > max(WEIGHT_MAX, SURE_SD * sd):
            low, high = stated * (share - 1.96 * sd), stated * (share + 1.96 * sd)
            raise IdentificationError(
                f"The weight of {stated:g} kg acts like {stated * share:.2f} kg (95 % interval {low:.2f} to {high:.2f} "
                f"kg); {WEIGHT_MAX:.0%} are allowed. Put it on a scale: is it marked in pounds, not hung at the mount, "
                "or another one than calibration.weights_kg in rig.toml says? If it is right, some joint's encoder and "
                "motor are both reversed, or joints are swapped. Correct that and repeat."
            )


def refuse_incredible(description: RigDescription, fit: Fit) -> None:
    """Look at everything that was found.

    Raises:
        IdentificationError: Something is farther off than such a machine can be.
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
    """How the base would lean if all encoders were right: the first joint's and the base cannot be told apart."""
    tilt, offset = fit.prior.layout.tilt, fit.prior.layout.of("offset")
    shared = np.linalg.solve(fit.covariance[offset, offset], fit.theta[offset])
    leaning = np.rad2deg(np.arcsin(np.clip(fit.theta[tilt] - fit.covariance[tilt, offset] @ shared, -1.0, 1.0)))
    allowed = float(np.rad2deg(np.arcsin(TILT_MAX)))
    if np.abs(leaning).max() > allowed:
        raise IdentificationError(
            f"As the weights say, the base leans by {leaning[0]:+.1f}° forward and {leaning[1]:+.1f}° to the left, or "
            f"the encoder of joint '{description.joints[0]}' is off by as much; {allowed:.1f}° are allowed. Level the "
            "base; if it is level, set that encoder's zero; if both are right, joints are swapped."
        )


def _refuse_offsets(description: RigDescription, fit: Fit) -> None:
    offsets = fit.theta[fit.prior.layout.of("offset")]
    for joint, offset in zip(description.joints, offsets, strict=True):
        if abs(offset) > OFFSET_MAX:
            raise IdentificationError(
                f"The encoder of joint '{joint}' reads {np.rad2deg(offset):+.1f}° more than the joint turns, as the "
                f"weights say; {np.rad2deg(OFFSET_MAX):.0f}° are allowed. Set its zero at the jig or the stop, then "
                "repeat; if it is right, the URDF's frames or the order of the joints are wrong."
            )


def _refuse_links(description: RigDescription, fit: Fit) -> None:
    """By how many prior standard deviations each link's mass and first moments are off."""
    block = fit.prior.layout.links
    off = (fit.theta - fit.prior.mean)[block] / np.sqrt(np.diag(fit.prior.covariance)[block])
    worst = np.abs(off.reshape(-1, 10)[:, :4]).max(axis=1)
    for joint, sds in zip(description.joints, worst, strict=True):
        if sds > LINK_SD:
            raise IdentificationError(
                f"The link behind joint '{joint}' weighs other than in the URDF by {sds:.0f} standard deviations of a "
                f"drawing (4 % of mass, 4 mm of centre); {LINK_SD:.0f} are allowed. Is something on it, are two joints "
                "swapped, or an encoder and its motor both reversed? Correct the URDF, the driver or the machine."
            )


def _refuse_residuals(description: RigDescription, fit: Fit) -> None:
    torque_max = description.per_actuator("torque_max_Nm")
    for joint, sd, most in zip(description.joints, fit.noise_and_ripple.sd, RESIDUAL_SHARE * torque_max, strict=True):
        if sd > most:
            raise IdentificationError(
                f"The model leaves {sd:.2f} N·m of the torque of joint '{joint}' unexplained; {most:.2f} N·m are "
                "allowed. Two joints may be swapped, an encoder reversed together with its motor, or something rubs. "
                "Look at the machine while one joint moves, then repeat."
            )
