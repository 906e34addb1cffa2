"""The arm's tick together with the parameters in force: what the pilot flies a worn machine with."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.control.handover import Handover
from exograv.control.tick import Mode, Tick
from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.assembly import Assembly
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.loops import FIT, arm_base, arm_positions
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]


class ArmController:
    """`Controller` of a worn machine; new parameters fade in."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: parameters.Parameters, dt: float):
        self.assembly = assembly
        self._tick = Tick(assembly, machine)
        self._trial = self._tick.again()
        self._handover = Handover(x, dt)
        self._skeleton = kernel.compile(_skeleton_function(assembly))

    @property
    def mode(self) -> Mode:
        """What the tick is for."""
        return self._tick.mode

    @property
    def tau_feedforward(self) -> Joints:
        """What the model expects [N·m]."""
        return self._tick.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """How far the loops are from closed [N·m]."""
        return self._tick.closure_slope

    @property
    def x(self) -> parameters.Parameters:
        """Parameters in force."""
        return self._handover.x

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired torque [N·m]."""
        return self._tick.step(q, v, reference, self._handover.step())

    def publish(self, x: parameters.Parameters, q: Joints) -> bool:
        """Head for new parameters; they enter no faster than the torque at `q` may change.

        Returns:
            Whether they are taken: not where an arm of these parameters would not lie at rest in its cuffs at `q`.
        """
        wanted = self.torque_at_rest(q, x)
        if not self._trial.is_closed:
            return False
        change = wanted - self.torque_at_rest(q, self.x)
        self._handover.publish(x, float(np.abs(change).max()))
        return True

    def torque_at_rest(self, q: Joints, x: parameters.Parameters) -> Joints:
        """Desired torque of the floating controller, in its gravity level, at the present posture at rest [N·m]."""
        self._trial.mode = Mode(0.0, self.mode.gravity_level, self.mode.arm_share)
        return self._trial.at_rest(q, x, self._tick.z)[0]

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points to draw in the base frame [m]: along the exoskeleton, and along the arm as the controller sees it."""
        exo, arm = self._skeleton.of(q, self._tick.z, self.x[parameters.FIT_OF_ARM])
        return exo.T.round(5).tolist(), arm.T.round(5).tolist()


def _skeleton_function(assembly: Assembly) -> ca.Function:
    q, z, fit = ca.SX.sym("q", assembly.n), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT))
    exo = body_poses(assembly.exo, q)
    mount = assembly.description.calibration.mount
    exo_points = [ca.SX.zeros(3), *(pose.p for pose in exo), frame_pose(assembly.exo, exo, mount).p]
    base = arm_base(assembly, fit)
    tree = assembly.arm.tree
    arm = body_poses(tree, arm_positions(z, fit), base)
    arm_points = [frame_pose(tree, arm, name, base).p for name in ("upper_arm", "forearm", "wrist", "finger_tip")]
    return ca.Function(
        "skeleton", [q, z, fit], [ca.horzcat(*exo_points), ca.horzcat(*arm_points)], ["q", "z", "fit"], ["exo", "arm"]
    )
