"""Elasticity of the gears: the motor's encoder leads the joint's by the torque in the gear times its compliance.

    q_motor − q = offset + compliance · torque in the gear

The torque in the gear is that of links and weights by the fitted model: friction and rotor are on the motor's side. The
lead therefore separates the inertia of a rotor from that of the links, which the torque of the motor does not.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit
from exograv.identification.calibration.empty_prior import Unknowns
from exograv.identification.core.correlation import integrated_correlation

from .measured_motion import Samples

ON_THE_MOTOR = ("coulomb", "viscous", "load_share", "asymmetry", "rotor", "ripple_sine", "ripple_cosine")
"""Unknowns of friction and rotor, which the gear does not transmit."""

LOAD_LEAST_NM = 0.5
"""Least standard deviation of the torque in a gear from which its compliance is told [N·m]."""

UPDATES = 3
"""Linearisations of the product of compliance and torque [-]."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class GearElasticity:
    """Compliance of each gear, and its standard deviation; NaN where the recordings do not tell it."""

    compliance: Joints
    """Angle between motor and joint per torque in the gear [rad/(N·m)]."""

    sd: Joints


def gear_elasticity(model: EmptyMachine, fit: Fit, samples: Samples) -> GearElasticity:
    """Fit the compliance of the gears whose motors have their own encoders."""
    layout, load = fit.prior.layout, _load(model, fit, samples)
    gain_sd = fit.sd[layout.of("inverse_gain")] / fit.theta[layout.of("inverse_gain")]
    compliance, sd = np.full((2, layout.joints), np.nan)
    for joint in _told(samples, load):
        known = np.isfinite(samples.wound_up[:, joint])
        line = _line(load[known, joint], samples.wound_up[known, joint])
        compliance[joint], sd[joint] = line.slope, np.hypot(line.slope_sd, line.slope * gain_sd[joint])
    return GearElasticity(compliance, sd)


def with_wind_up(model: EmptyMachine, fit: Fit, samples: Samples) -> Fit:
    """Correct a fit by the leads of the motors' encoders; each joint's compliance, offset and loss are free.

    The loss of a gear leads by its damping times the speed, and by a hysteresis with the sign of the speed.
    """
    before, updated = np.linalg.inv(fit.covariance), fit
    for _ in range(UPDATES):
        load, slope = _load(model, updated, samples), _load_derivative(model, updated, samples)
        information, pull = before.copy(), before @ (fit.theta - updated.theta)
        for joint in _told(samples, load):
            known = np.isfinite(samples.wound_up[:, joint])
            torque, wound, v = load[known, joint], samples.wound_up[known, joint], samples.sweeps.v[known, joint]
            line = _line(torque, wound)
            loss = np.column_stack([torque, np.ones(len(torque)), v, np.sign(v)])
            # Whatever compliance, offset and loss explain tells nothing about the links.
            of_links = (line.slope * slope[joint][:, known]).T
            of_links = of_links - loss @ np.linalg.lstsq(loss, of_links, rcond=None)[0]
            left = wound - loss @ np.linalg.lstsq(loss, wound, rcond=None)[0]
            sd = max(float(np.std(left)), np.finfo(float).tiny)
            weight = 1.0 / (sd**2 * _repeats(left))
            information += weight * of_links.T @ of_links
            pull += weight * of_links.T @ left
        covariance = np.linalg.inv(information)
        updated = replace(fit, theta=updated.theta + covariance @ pull, covariance=covariance)
    return updated


@dataclass(frozen=True)
class _Line:
    """Lead of a motor's encoder over the torque in its gear."""

    slope: float
    slope_sd: float


def _line(torque: Float[np.ndarray, " sample"], wound: Float[np.ndarray, " sample"]) -> _Line:
    design = np.column_stack([torque, np.ones(len(torque))])
    (slope, offset), *_ = np.linalg.lstsq(design, wound, rcond=None)
    left = wound - design @ np.array([slope, offset])
    return _Line(float(slope), float(np.std(left) * np.sqrt(_repeats(left) * np.linalg.inv(design.T @ design)[0, 0])))


def _repeats(left: Float[np.ndarray, " sample"]) -> float:
    """Return how many successive residuals repeat each other: the number of independent ones is smaller."""
    return max(integrated_correlation(left, SAMPLE_PERIOD_S) / SAMPLE_PERIOD_S, 1.0)


def _told(samples: Samples, load: Float[np.ndarray, "sample joint"]) -> list[int]:
    """Return the joints with an encoder on the motor, whose gears were loaded."""
    told = list[int]()
    for joint, wound in enumerate(samples.wound_up.T):
        known = np.isfinite(wound)
        if known.any() and np.std(load[known, joint]) >= LOAD_LEAST_NM and np.ptp(wound[known]):
            told.append(joint)
    return told


def _on_the_links(fit: Fit) -> Unknowns:
    """Return the unknowns without friction and rotors."""
    theta = fit.theta.copy()
    for name in ON_THE_MOTOR:
        theta[fit.prior.layout.of(name)] = 0.0
    return theta


def _load(model: EmptyMachine, fit: Fit, samples: Samples) -> Float[np.ndarray, "sample joint"]:
    """Torque in the gears by the fitted model [N·m]."""
    sweeps, theta = samples.sweeps, _on_the_links(fit)
    nominal = model.description.nominal_gain * sweeps.current - model.residual(sweeps, theta, float(sweeps.t[-1]))
    return nominal / theta[fit.prior.layout.of("inverse_gain")]


def _load_derivative(model: EmptyMachine, fit: Fit, samples: Samples) -> Float[np.ndarray, "joint unknown sample"]:
    """Differentiate the torque in the gears by the unknowns."""
    layout, theta = fit.prior.layout, _on_the_links(fit)
    derivative = model.derivative(samples.sweeps, theta) / theta[layout.of("inverse_gain")][:, None, None]
    for name in (*ON_THE_MOTOR, "inverse_gain"):
        derivative[:, layout.of(name)] = 0.0
    return derivative
