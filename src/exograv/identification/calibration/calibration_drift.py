"""A calibrated machine is weighed again by its own links: are gains, encoders and torque zeros still what they were?

The model and its fit are those of the calibration. What the calibration is sure of, links and lean, is taken from it;
what a fault changes between two days is free.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.model.tree import Tree

from .empty_fit import EmptyMachine, Sweeps
from .empty_machine import Calibration, as_it_was

GAIN_FREE_SD = 0.5
"""Of a motor's inverse gain, as share: torque constants that are half or double must not be pulled back [-]."""

OFFSET_FREE_SD = np.deg2rad(5.0)  # of an encoder against its calibration [rad]
BIAS_FREE_SD = 2.0  # of a torque's zero [N·m]

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class CalibrationChange:
    """What a machine is now against its calibration; each with its standard deviation."""

    scale: Joints
    """Torque that a motor gives per current over that of the calibration [-]."""

    scale_sd: Joints
    offset: Joints
    """What an encoder reads more than in the calibration [rad]."""

    offset_sd: Joints
    bias: Joints
    """Torque that is measured, and not there, more than in the calibration [N·m]."""

    bias_sd: Joints
    unexplained: Joints
    """What is left of the torque, as standard deviation [N·m]."""


def weigh_again(description: RigDescription, tree: Tree, sweeps: Sweeps, before: Calibration) -> CalibrationChange:
    """Fit what may have changed to the motion of the empty machine; `tree` as in the calibration."""
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
        # Friction that is larger one way is a torque that is always there.
        bias=value[bias] - np.asarray(before.machine.friction.asymmetry),
        bias_sd=sd[bias],
        unexplained=fit.noise_and_ripple.sd,
    )
