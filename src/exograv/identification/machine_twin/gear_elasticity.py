"""Elasticity of the gears: the motor's encoder leads the joint's by the torque in the gear times its compliance.

    q_motor − q = offset + compliance · torque in the gear

The torque in the gear is that of links and weights by the fitted model: friction and rotor are on the motor's side.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit
from exograv.identification.core.correlation import integrated_correlation

from .measured_motion import Samples

ON_THE_MOTOR = ("coulomb", "viscous", "load_share", "asymmetry", "rotor", "ripple_sine", "ripple_cosine")
"""Unknowns of friction and rotor, which the gear does not transmit."""

LOAD_LEAST_NM = 0.5
"""Least standard deviation of the torque in a gear from which its compliance is told [N·m]."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class GearElasticity:
    """Compliance of each gear, and its standard deviation; NaN where the recordings do not tell it."""

    compliance: Joints
    """Angle between motor and joint per torque in the gear [rad/(N·m)]."""

    sd: Joints


def gear_elasticity(model: EmptyMachine, fit: Fit, samples: Samples) -> GearElasticity:
    """Fit the compliance of the gears whose motors have their own encoders."""
    sweeps, layout, theta = samples.sweeps, fit.prior.layout, fit.theta.copy()
    for name in ON_THE_MOTOR:
        theta[layout.of(name)] = 0.0
    nominal = model.description.nominal_gain * sweeps.current
    load = (nominal - model.residual(sweeps, theta, float(sweeps.t[-1]))) / theta[layout.of("inverse_gain")]
    gain_sd = fit.sd[layout.of("inverse_gain")] / fit.theta[layout.of("inverse_gain")]
    compliance, sd = np.full((2, layout.joints), np.nan)
    for joint in range(layout.joints):
        wound, torque = samples.wound_up[:, joint], load[:, joint]
        known = np.isfinite(wound)
        if not known.any() or np.std(torque[known]) < LOAD_LEAST_NM or not np.ptp(wound[known]):
            continue
        design = np.column_stack([torque[known], np.ones(int(known.sum()))])
        (value, offset), *_ = np.linalg.lstsq(design, wound[known], rcond=None)
        left = wound[known] - design @ np.array([value, offset])
        # Successive residuals repeat each other: the number of independent ones is smaller.
        repeats = max(integrated_correlation(left, SAMPLE_PERIOD_S) / SAMPLE_PERIOD_S, 1.0)
        by_residual = np.std(left) * np.sqrt(repeats * np.linalg.inv(design.T @ design)[0, 0])
        compliance[joint], sd[joint] = value, np.hypot(by_residual, value * gain_sd[joint])
    return GearElasticity(compliance, sd)
