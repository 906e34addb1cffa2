"""Checks of a fit to recordings: what is refused, and what the report doubts."""

import numpy as np

from exograv.errors import ConfigError, IdentificationError
from exograv.identification.machine_twin.drive_response import SURE_PERIOD_S
from exograv.identification.machine_twin.machine_fit import MachineFit
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .read_motions import ReadRecording

SURPRISE_SD = 4.0
"""Distance of a gain from the data sheet's from which units and machine are in doubt [standard deviations]."""

WRONG_OVER_NOISE = 5.0
"""Residual on the held-out part over the noise from which units and signs are in doubt [-]."""

OVER_NOISE_MAX = 1.2
"""Largest residual on the held-out part over the noise without a warning [-]."""

SPREAD_MAX = 3.0
"""Largest disagreement of the joints' delays without a warning, in standard deviations [-]."""


def refuse_unknown_frame(tree: Tree, force_frame: str) -> None:
    """Refuse a force sensor at a frame that the machine does not have.

    Raises:
        ConfigError: No frame has this name.
    """
    if force_frame not in tree.frames:
        raise ConfigError(
            f"--force-frame is '{force_frame}', which is no frame of {tree.name}. Frames: "
            f"{', '.join(sorted(tree.frames))}."
        )


def refuse_other_frame(recordings: tuple[ReadRecording, ...], mount: str) -> None:
    """Refuse forces whose recording states another frame than the mount of the calibration.

    Raises:
        ConfigError: A recording states another frame.
    """
    for one in recordings:
        if one.force_frame not in (None, mount):
            raise ConfigError(
                f"{one.path} states forces at the frame '{one.force_frame}', not at '{mount}'. Name the frame of the "
                "URDF with the origin and the axes of the sensor by --force-frame."
            )


def refuse_reversed_currents(description: RigDescription, found: MachineFit) -> None:
    """Refuse a fit in which a motor drives its joint backwards.

    Raises:
        IdentificationError: The gain of a joint is not positive.
    """
    gains = found.fit.theta[found.fit.prior.layout.of("inverse_gain")].tolist()
    for joint, inverse in zip(description.joints, gains, strict=True):
        if inverse <= 0.0:
            raise IdentificationError(
                f"The current of joint '{joint}' and its position have opposite signs: torque per current comes out "
                "negative. Reverse the sign of one of the two columns in the recording."
            )


def fit_warnings(description: RigDescription, found: MachineFit, recordings: tuple[ReadRecording, ...]) -> list[str]:
    """Name what is in doubt: gains far from the data sheet, residuals beyond noise, slow logs and unlike delays."""
    told = _surprising_gains(description, found)
    for joint, over in zip(description.joints, found.validation.over_noise.tolist(), strict=True):
        if over > WRONG_OVER_NOISE:
            told.append(
                f"The residual of joint '{joint}' on the held-out part is {over:.1f} times its noise: this is no fit. "
                "Check the units of all columns (rad, A or N·m, s, kg), the signs and order of the joints, the machine "
                "of the recording, and the weights."
            )
        elif over > OVER_NOISE_MAX:
            told.append(
                f"The residual of joint '{joint}' on the held-out part is {over:.2f} times its noise; the law of "
                "friction may be another, a part may rub, or a weight is not stated."
            )
    motions = [one for recording in recordings for one in recording.motions if not one.has_all_commands]
    slowest_s = max((one.period_s for one in motions), default=0.0)
    if slowest_s > SURE_PERIOD_S and np.isfinite(found.response.delay_s):
        told.append(
            f"A recording has rows {1e3 * slowest_s:.3g} ms apart, and may lack commands between them: the delay is "
            "uncertain by half of this time. Record each command of the loop, at 1 kHz if possible."
        )
    if found.response.delay_spread > SPREAD_MAX:
        told.append(
            f"The delays of the joints differ by {found.response.delay_spread:.1f} standard deviations: the twin has "
            "one delay for all, with a wider interval."
        )
    return told


def _surprising_gains(description: RigDescription, found: MachineFit) -> list[str]:
    """Name the joints whose torque per current is far from the data sheet."""
    prior, told = found.fit.prior, list[str]()
    place = prior.layout.of("inverse_gain")
    columns = (prior.mean[place], np.sqrt(np.diag(prior.covariance)[place]), found.fit.theta[place])
    for joint, *values in zip(description.joints, *(one.tolist() for one in columns), strict=True):
        before, sd, now = values
        if abs(now - before) > SURPRISE_SD * sd:
            told.append(
                f"The torque per current of joint '{joint}' is {before / now:.2g} times that of the data sheet, "
                f"{abs(now - before) / sd:.0f} standard deviations away. Check the unit of its current (A), the "
                "machine of the recording, and torque_constant_Nm_per_A and gear_ratio in rig.toml."
            )
    return told
