"""Prior of an arm in a machine: mean and covariance of all learned parameters before any motion."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, table_parameters
from exograv.model.arm import Arm
from exograv.model.assembly import Assembly
from exograv.model.limb import Limb
from exograv.model.loops import FIT, SHIFT_ENTRIES
from exograv.model.rig_settings import Place

# Freedom: stiffness [N·m/rad], neutral angle [°], damping [N·m·s/rad], each with its standard deviation. Elbow after
# Wiegner & Watts 1986 (0.4-1.8 N·m/rad, neutral 107° ± 10°); shoulder stiffness and all damping after the unverified
# ranges of docs/explanation/arm.md; the shoulder's neutral angles are assumed: mid-range, wide; so are forearm and
# wrist.
SPRINGS = {
    "flexion": ((1.8, 1.2), (25.0, 25.0), (0.6, 0.35)),
    "abduction": ((1.8, 1.2), (25.0, 25.0), (0.6, 0.35)),
    "rotation": ((1.8, 1.2), (0.0, 25.0), (0.6, 0.35)),
    "elbow": ((1.0, 0.5), (107.0, 15.0), (0.3, 0.2)),
    "forearm_roll": ((0.3, 0.25), (0.0, 20.0), (0.05, 0.04)),
    "wrist_flexion": ((0.6, 0.4), (0.0, 15.0), (0.05, 0.04)),
    "wrist_deviation": ((1.0, 0.6), (0.0, 10.0), (0.05, 0.04)),
}
# Donning error 10-30 mm per axis. The shoulder centre migrates 22 mm/rad with free arms (docs/explanation/arm.md); how
# much of that
# a seated wearer shows is not known: assumed are a mean of half of it and a standard deviation of half of it.
SHOULDER_OFFSET_SD = 0.015  # m
GLENOHUMERAL_SLOPE, GLENOHUMERAL_SLOPE_SD = 0.011, 0.011  # m/rad
# The direction of the migration is unverified, and no source gives its spread. Assumed is an error of about 30° about
# each of two axes: the tangent of 30° times the mean slope.
GLENOHUMERAL_ACROSS_SD = 0.006  # m/rad
# Further shapes of the path, in the order of `model.loops.PATH_SHAPES`. No source gives their spread: assumed are a few
# percent of the usual migration at 90° (17 mm), chosen on tuning seeds (docs/results/results.md, Information bound).
PATH_SD = np.array([0.00075, 0.0004, 0.001, 0.001])  # m
LENGTH_SD = 0.03  # share of the measured upper arm
CUFF_LOG_STIFFNESS_SD = 0.4  # between people and straps: linear fits of one cuff reach from 2.1 to 4.6 N/mm
ROTOR_SD = 0.4  # share: error of the reflected inertia in a data sheet
# Warm-up changes friction by 10-20 % within half an hour (docs/explanation/arm.md), and the calibration is about that
# old.
COULOMB_DRIFT, VISCOUS_DRIFT = 0.05, 0.10  # share


# Assumed slow torque of a wearer who should be relaxed, by place of the joint [N·m]; the filter weights multiples of
# it by the data. People who do not relax use 2-5 % of their maximal torque, 0.5-3 N·m. When told to relax they use
# a tenth of the upper end (docs/explanation/arm.md).
DISTURBANCE_SD = {"shoulder": 0.3, "elbow": 0.15, "wrist": 0.05}


def prior(
    assembly: Assembly, machine: CalibratedMachine
) -> tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, "parameter parameter"]]:
    """Prior mean (parameter,) and covariance, in the order of `dynamics.parameters`."""
    layout, arm = ParameterLayout.of(assembly), assembly.arm
    friction, sd = machine.friction, machine.friction_sd
    stiffness, neutral, damping = _springs(arm)
    mean = table_parameters(arm, machine.rotor_inertia, np.asarray(friction.coulomb), np.asarray(friction.viscous))
    mean[layout.stiffness] = stiffness[0]
    mean[layout.spring_offset] = stiffness[0] * neutral[0]
    mean[layout.damping] = damping[0]
    mean[layout.fit] = np.concatenate([_fit_mean(arm, limb) for limb in arm.limbs])
    covariance = np.zeros((len(mean), len(mean)))
    covariance[layout.phi, layout.phi] = arm.phi_covariance
    for block, spread in (
        (layout.damping, damping[1]),
        (layout.fit, np.tile(_fit_sd(arm), len(arm.limbs))),
        (layout.rotor, ROTOR_SD * machine.rotor_inertia),
        (layout.coulomb, np.hypot(sd.coulomb, COULOMB_DRIFT * friction.coulomb)),
        (layout.viscous, np.hypot(sd.viscous, VISCOUS_DRIFT * friction.viscous)),
    ):
        covariance[block, block] = np.diag(spread**2)
    _add_springs(covariance, layout, stiffness, neutral)
    return mean, covariance


def usual_springs(arm: Arm) -> tuple[Float[np.ndarray, " freedom"], Float[np.ndarray, " freedom"]]:
    """Return the mean stiffness [N·m/rad] and neutral angle [rad] of each freedom over all people."""
    stiffness, neutral, _ = _springs(arm)
    return stiffness[0], neutral[0]


def _springs(arm: Arm) -> Float[np.ndarray, "3 2 freedom"]:
    """Stiffness [N·m/rad], neutral angle [rad] and damping [N·m·s/rad]; mean and standard deviation per freedom."""
    names = (name.removeprefix(limb.prefix) for limb in arm.limbs for name in arm.freedoms[limb.freedoms])
    table = np.array([SPRINGS[name] for name in names]).transpose(1, 2, 0)
    table[1] = np.deg2rad(table[1])
    return table


def _fit_mean(arm: Arm, limb: Limb) -> Float[np.ndarray, " fit"]:
    mean = np.zeros(len(FIT))
    mean[SHIFT_ENTRIES[0]] = GLENOHUMERAL_SLOPE
    mean[[FIT.index("elbow_axis_x"), FIT.index("elbow_axis_z")]] = arm.elbow_axis(limb)[0]
    return mean


def _fit_sd(arm: Arm) -> Float[np.ndarray, " fit"]:
    length = LENGTH_SD * arm.lengths["upper_arm"]
    return np.array(
        [
            *[SHOULDER_OFFSET_SD] * 3,
            GLENOHUMERAL_SLOPE_SD,
            length,
            CUFF_LOG_STIFFNESS_SD,
            CUFF_LOG_STIFFNESS_SD,
            *arm.elbow_axis(arm.limbs[0])[1],
            GLENOHUMERAL_ACROSS_SD,
            GLENOHUMERAL_ACROSS_SD,
            *np.repeat(PATH_SD, 3),
        ]
    )


def _add_springs(
    covariance: Float[np.ndarray, "parameter parameter"],
    layout: ParameterLayout,
    stiffness: Float[np.ndarray, "2 freedom"],
    neutral: Float[np.ndarray, "2 freedom"],
) -> None:
    """Add the covariance of stiffness and spring offset, which are correlated: offset = stiffness · neutral angle."""
    K, c = layout.stiffness, layout.spring_offset
    (k, k_sd), (angle, angle_sd) = stiffness, neutral
    covariance[K, K] = np.diag(k_sd**2)
    covariance[K, c] = covariance[c, K] = np.diag(angle * k_sd**2)
    covariance[c, c] = np.diag((angle * k_sd) ** 2 + (k * angle_sd) ** 2 + (k_sd * angle_sd) ** 2)


def disturbance_sd(places: Sequence[Place]) -> Float[np.ndarray, " joint"]:
    """`DISTURBANCE_SD` of a machine's joints (joint,) [N·m]."""
    return np.array([DISTURBANCE_SD[place] for place in places])
