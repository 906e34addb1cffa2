"""Discrepancy of a robot's torque model, which grows with the load of each joint."""

import numpy as np
from jaxtyping import Float

from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Joints, Parameters, Sample

from .payload import PayloadModel
from .robot_from_log import RobotFromLog


class LoadDiscrepancy(Discrepancy):
    """Smooth torque fields over posture: one static, one that changes sign with the direction of motion.

    Their size is that of the residual which repeats with the posture, in the parts of the unloaded logs that were held
    out. A second part is in proportion to the load that the joint carries at the posture.
    """

    def __init__(self, model: PayloadModel, robot: RobotFromLog, carried: Parameters):
        """Draw the features.

        Args:
            model: Model of the robot with a payload.
            robot: Robot from its unloaded logs.
            carried: All parameters of the robot with the load that it carries.
        """
        super().__init__(np.ones(model.n_joints), POSTURE_LENGTH_RAD, FEATURES)
        self._model, self._residuals, self._carried = model, robot.residuals, carried

    def errors_of_joint(self, q: Joints, v: Joints) -> Float[np.ndarray, "joint considered"]:
        """Torque [N·m] of each joint's own errors at one standard deviation, at posture `q` and velocity `v`."""
        still = np.zeros_like(q)
        load = self._model.linearise(Sample(0.0, q, still, still, still), self._carried)[0]
        size = np.hypot(self._residuals.field_sd, self._residuals.per_load * load)
        return size[:, None] * super().errors_of_joint(q, v)
