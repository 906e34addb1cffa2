"""Tables of an arm for the example: position of the finger along a reach, and gravity torque there."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.laboratory.movements import REST_DEG, TARGET_DEG
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import skeleton_function
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.task.task_settings import TargetSettings

NODES = 25
"""Number of nodes along a reach, with linear interpolation between them."""

DIFFERENCE = 1e-5


@dataclass(frozen=True)
class ArmTables:
    """Tables of one arm, at even shares of the way from lap to screen."""

    rest: Float[np.ndarray, " arm"]
    touch: Float[np.ndarray, " arm"]
    """Postures at rest and at the touch [rad]."""

    weight: Float[np.ndarray, " arm"]
    """Torque of the arm's whole weight at the screen [N·m]."""

    screen_slope: Float[np.ndarray, "2 arm"]
    """Derivative of the finger's position right and up on the screen by the freedoms [m/rad]."""

    tip_slope: Float[np.ndarray, "3 arm"]
    """Derivative of the finger's position in the base frame by the freedoms [m/rad]."""

    weights: Float[np.ndarray, "node arm"]
    """Torque that carries the arm's whole weight, along the path from lap to screen [N·m]."""

    exo: Float[np.ndarray, "node corner 3"]
    arm: Float[np.ndarray, "node point 3"]
    """Points to draw, of machine and arm [m]."""

    def posture_change(self, off_m: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " arm"]:
        """Smallest posture change that moves the finger by this distance right and up [m]."""
        return np.linalg.pinv(self.screen_slope) @ off_m


def arm_tables(laboratory: VirtualLaboratory, room: SimulatedRoom, target: TargetSettings) -> ArmTables:
    """Compute the tables of this laboratory's wearer before this screen."""
    assembly = laboratory.assembly()
    skeleton = skeleton_function(assembly)
    axes = room.around(assembly, target).screen_axes
    rest, touch = np.deg2rad(REST_DEG), np.deg2rad(TARGET_DEG)

    def points(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        exo, arm = skeleton(q, q, np.zeros(skeleton.size1_in(2)))
        return np.asarray(exo).T, np.asarray(arm).T

    tip = points(touch)[1][-1]
    slope = np.column_stack([(points(touch + row)[1][-1] - tip) / DIFFERENCE for row in DIFFERENCE * np.eye(len(rest))])
    own = ArmInverseDynamics(laboratory.description, laboratory.machine, laboratory.wearer)
    still = np.zeros(len(rest))

    def weight(q: np.ndarray) -> np.ndarray:
        return own.torque(q, still, still, 1.0) - own.torque(q, still, still, 0.0)

    way = [rest + share * (touch - rest) for share in np.linspace(0.0, 1.0, NODES)]
    exo, arm = zip(*(points(q) for q in way), strict=True)
    return ArmTables(
        rest,
        touch,
        weight(touch),
        axes[:, :2].T @ slope,
        slope,
        np.array([weight(q) for q in way]),
        np.array(exo),
        np.array(arm),
    )
