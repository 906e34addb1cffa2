"""Identification setting of a payload on a robot that was identified from its unloaded log."""

import numpy as np

from exograv.identification.core.interface import Parameters, Sample
from exograv.identification.core.noise import Noise
from exograv.identification.core.setting import Setting

from .load_discrepancy import LoadDiscrepancy
from .payload import PAYLOAD, PayloadModel, payload_prior
from .robot_from_log import RobotFromLog, felt_covariance


def payload_setting(
    model: PayloadModel, robot: RobotFromLog, motion: list[Sample], carried: Parameters | None = None
) -> Setting:
    """Build the setting that every method starts from: a wide prior of the payload, a narrow one of the robot.

    Args:
        model: Model of the robot with a payload.
        robot: Robot as identified from the unloaded log.
        motion: Samples of both logs; their torque is not read.
        carried: Robot with a first fit of the payload, whose load sets the size of the discrepancy; without it, the
            empty robot. No method learns from it.
    """
    phi, phi_covariance = payload_prior()
    mean = robot.x.copy()
    mean[PAYLOAD] = phi
    covariance = felt_covariance(model, robot, robot.covariance, motion)
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
        discrepancy=LoadDiscrepancy(model, robot, robot.x if carried is None else carried),
    )
