"""The setting of a payload on a robot that its own unloaded log has identified."""

import numpy as np

from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.prior import COULOMB_DRIFT, VISCOUS_DRIFT
from exograv.identification.core.setting import Setting

from .payload import PAYLOAD, PayloadModel, payload_prior
from .robot_from_log import RobotFromLog, felt_covariance


def payload_setting(model: PayloadModel, robot: RobotFromLog, motion: list[Sample]) -> Setting:
    """What every method starts from: next to nothing known of the payload, and what remains unknown of the robot.

    Args:
        model: The robot.
        robot: By the unloaded log.
        motion: Of both logs; no torque is read.
    """
    phi, phi_covariance = payload_prior()
    mean = robot.x.copy()
    mean[PAYLOAD] = phi
    # The unloaded log leaves the robot a little uncertain; and between the logs friction drifts.
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
        # Errors of the model that last for seconds are expected as large as the residual; the data weigh multiples.
        noise=Noise(robot.residual_sd, robot.correlation_s, disturbance_sd=robot.residual_sd),
        bodies=(PAYLOAD,),
        learned=payload,
        machine=~payload,
        # As of an arm: what the unloaded log leaves unexplained may repeat with the posture.
        # The robot's friction is learned from its own log, and may drift in the state: no second error that turns.
        discrepancy=Discrepancy(robot.residual_sd, POSTURE_LENGTH_RAD, FEATURES, turning=False),
    )
