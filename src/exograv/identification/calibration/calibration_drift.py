"""Drift of a calibrated machine: gains, encoders and torque zeros, measured again by the weight of its own links.

Model and fit are those of the calibration. Links and tilt of the base are taken from the calibration. The quantities
that a fault may change between two days are free.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_fit import EmptyMachine, Sweeps
from .empty_machine import Calibration, as_it_was

GAIN_FREE_SD = 0.5
"""Standard deviation of a motor's inverse gain, as a share [-]; wide, to find torque constants of half or double."""

OFFSET_FREE_SD = np.deg2rad(5.0)  # standard deviation of an encoder's change since its calibration [rad]
BIAS_FREE_SD = 2.0  # standard deviation of a torque zero [N·m]

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class CalibrationChange:
    """Change of a machine since its calibration; each value with its standard deviation."""

    scale: Joints
    """Ratio of a motor's present torque per current to that of the calibration [-]."""

    scale_sd: Joints
    offset: Joints
    """Change of an encoder's reading since the calibration [rad]."""

    offset_sd: Joints
    bias: Joints
    """Change of the torque zero since the calibration: measured minus true torque [N·m]."""

    bias_sd: Joints
    unexplained: Joints
    """Standard deviation of the residual torque [N·m]."""


def weigh_again(description: RigDescription, tree: Tree, sweeps: Sweeps, before: Calibration) -> CalibrationChange:
    """Fit the quantities that may have changed to a motion of the empty machine; `tree` as in the calibration."""
    model = EmptyMachine(description, tree)
    prior = as_it_was(description, model.prior, before)
    layout = prior.layout
    known = description.nominal_gain / before.machine.actuators.gain
    prior = prior.with_sd(layout.of("inverse_gain"), GAIN_FREE_SD).with_sd(layout.of("offset"), OFFSET_FREE_SD)
    prior = prior.with_sd(layout.of("asymmetry"), BIAS_FREE_SD)
    fit = model.fit(sweeps, prior, model.fit(sweeps, prior))
    value, sd = fit.theta, fit.sd
    gain, offset, bias = (layout.of(name) for name in ("inverse_gain", "offset", "asymmetry"))
    scale = known / value[gain]
    return CalibrationChange(
        scale=scale,
        scale_sd=scale * sd[gain] / np.abs(value[gain]),
        offset=value[offset] - before.offset,
        offset_sd=sd[offset],
        # A direction-dependent friction acts like a constant torque, as a shifted torque zero does.
        bias=value[bias] - np.asarray(before.machine.friction.asymmetry),
        bias_sd=sd[bias],
        unexplained=fit.noise_and_ripple.sd,
    )
