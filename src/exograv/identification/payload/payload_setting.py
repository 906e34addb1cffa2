"""Identification setting of a payload on a robot that was identified from its unloaded log."""

import numpy as np

from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.prior import COULOMB_DRIFT, VISCOUS_DRIFT
from exograv.identification.core.setting import Setting

from .payload import PAYLOAD, PayloadModel, payload_prior
from .robot_from_log import RobotFromLog, felt_covariance


def payload_setting(model: PayloadModel, robot: RobotFromLog, motion: list[Sample]) -> Setting:
    """Build the setting that every method starts from: a wide prior of the payload, a narrow one of the robot.

    Args:
        model: Model of the robot with a payload.
        robot: Robot as identified from the unloaded log.
        motion: Samples of both logs; their torque is not read.
    """
    phi, phi_covariance = payload_prior()
    mean = robot.x.copy()
    mean[PAYLOAD] = phi
    # The unloaded log leaves the robot slightly uncertain, and friction drifts between the logs.
    drift = np.zeros(model.n_parameters)
    for block, share in ((model.blocks.coulomb, COULOMB_DRIFT), (model.blocks.viscous, VISCOUS_DRIFT)):
        drift[block] = share * robot.x[block]
    covariance = felt_covariance(model, robot, robot.covariance + np.diag(drift**2), motion)
    covariance[PAYLOAD, PAYLOAD] = phi_covariance
    payload = np.zeros(model.n_parameters, dtype=bool)
    payload[PAYLOAD] = True
    return Setting(
        model=model,
        mean=mean,
        covariance=covariance,
        # Model errors that last for seconds are assumed as large as the residual; the data weight multiples of it.
        noise=Noise(robot.residual_sd, robot.correlation_s, disturbance_sd=robot.residual_sd),
        bodies=(PAYLOAD,),
        learned=payload,
        machine=~payload,
        # As for an arm, the unexplained torque of the unloaded log may repeat with the posture.
        # No field that changes sign with the direction: friction is in the state and may drift there.
        discrepancy=Discrepancy(robot.residual_sd, POSTURE_LENGTH_RAD, FEATURES, turning=False),
    )
