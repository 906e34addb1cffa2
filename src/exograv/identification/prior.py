"""What is believed about an arm in a machine before it moves: mean and covariance of everything that is learned."""

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.assembly import Assembly

# Arm joints: flexion, abduction, rotation, elbow. Elbow after Wiegner & Watts 1986 (0.4-1.8 N·m/rad, neutral
# 107° ± 10°); shoulder stiffness and all damping after the unverified ranges of docs/arm.md; the shoulder's neutral
# angles are assumed: mid-range, wide.
STIFFNESS, STIFFNESS_SD = np.array([1.8, 1.8, 1.8, 1.0]), np.array([1.2, 1.2, 1.2, 0.5])
NEUTRAL, NEUTRAL_SD = np.deg2rad([25.0, 25.0, 0.0, 107.0]), np.deg2rad([25.0, 25.0, 25.0, 15.0])
DAMPING, DAMPING_SD = np.array([0.6, 0.6, 0.6, 0.3]), np.array([0.35, 0.35, 0.35, 0.2])
# Donning error 10-30 mm per axis. The shoulder centre migrates 22 mm/rad with free arms (docs/arm.md); how much of that
# a seated wearer shows is not known: half of it, give or take all of it.
SHOULDER_OFFSET_SD = 0.015  # m
GLENOHUMERAL_SLOPE, GLENOHUMERAL_SLOPE_SD = 0.011, 0.011  # m/rad
LENGTH_SD = 0.03  # share of the measured upper arm
CUFF_LOG_STIFFNESS_SD = 0.4  # between people and straps: linear fits of one cuff reach from 2.1 to 4.6 N/mm
ROTOR_SD = 0.4  # share: a data sheet's reflected inertia against the real one
# Warm-up moves friction by a tenth to a fifth within half an hour (docs/arm.md): calibration is that old.
COULOMB_DRIFT, VISCOUS_DRIFT = 0.05, 0.10  # share


def prior(
    assembly: Assembly, machine: CalibratedMachine
) -> tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, "parameter parameter"]]:
    """Mean (parameter,) and covariance, in the order of `dynamics.parameters`."""
    n = assembly.n
    coulomb, viscous = np.asarray(machine.friction.coulomb), np.asarray(machine.friction.viscous)
    mean = parameters.table_parameters(assembly.arm, machine.rotor_inertia, coulomb, viscous)
    mean[parameters.STIFFNESS] = STIFFNESS
    mean[parameters.SPRING_OFFSET] = STIFFNESS * NEUTRAL
    mean[parameters.DAMPING] = DAMPING
    mean[parameters.FIT_OF_ARM] = [0.0, 0.0, 0.0, GLENOHUMERAL_SLOPE, 0.0, 0.0, 0.0]
    covariance = np.zeros((len(mean), len(mean)))
    covariance[parameters.PHI, parameters.PHI] = assembly.arm.phi_covariance
    for block, sd in (
        (parameters.DAMPING, DAMPING_SD),
        (parameters.FIT_OF_ARM, _fit_sd(assembly)),
        (parameters.rotor(n), ROTOR_SD * machine.rotor_inertia),
        (parameters.coulomb(n), np.hypot(machine.friction_sd.coulomb, COULOMB_DRIFT * machine.friction.coulomb)),
        (parameters.viscous(n), np.hypot(machine.friction_sd.viscous, VISCOUS_DRIFT * machine.friction.viscous)),
    ):
        covariance[block, block] = np.diag(sd**2)
    _add_springs(covariance)
    return mean, covariance


def _fit_sd(assembly: Assembly) -> Float[np.ndarray, " 7"]:
    length = LENGTH_SD * assembly.arm.lengths["upper_arm"]
    return np.array(
        [*[SHOULDER_OFFSET_SD] * 3, GLENOHUMERAL_SLOPE_SD, length, CUFF_LOG_STIFFNESS_SD, CUFF_LOG_STIFFNESS_SD]
    )


def _add_springs(covariance: Float[np.ndarray, "parameter parameter"]) -> None:
    """Stiffness and spring offset belong together: offset = stiffness · neutral angle."""
    K, c = parameters.STIFFNESS, parameters.SPRING_OFFSET
    covariance[K, K] = np.diag(STIFFNESS_SD**2)
    covariance[K, c] = covariance[c, K] = np.diag(NEUTRAL * STIFFNESS_SD**2)
    product = (NEUTRAL * STIFFNESS_SD) ** 2 + (STIFFNESS * NEUTRAL_SD) ** 2 + (STIFFNESS_SD * NEUTRAL_SD) ** 2
    covariance[c, c] = np.diag(product)


def disturbance_sd(n: int) -> Float[np.ndarray, " joint"]:
    """Slow torque of a wearer who should be relaxed, as assumed before the data weigh multiples of it (joint,) [N·m].

    2-5 % of what muscles can do is 0.5-3 N·m for people who do not let go at all; told to relax, a tenth of the upper
    end (docs/arm.md). Joints: three of the shoulder, then the elbow.
    """
    return np.array([0.3, 0.3, 0.3, 0.15])[:n]
