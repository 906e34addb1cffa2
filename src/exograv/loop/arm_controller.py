"""Controller of a worn machine: the tick of the arm, with the arm parameters in force."""

import copy
from collections.abc import Mapping

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.control.controller_acts import (
    ArmControllerRecord,
    CarryWeight,
    ControllerAct,
    ForceParameters,
    LeadArm,
    PublishParameters,
)
from exograv.control.handover import Handover
from exograv.control.native_law import NativeLaw
from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.arm import WeightPlace, held_weight, is_plausible
from exograv.model.assembly import Assembly
from exograv.model.description import ArmSide
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.loops import arm_poses
from exograv.model.tree import Tree, is_physical
from exograv.signals import Reference
from exograv.spatial import Transform

Joints = Float[np.ndarray, " joint"]


class ArmController:
    """`Controller` of a worn machine. New parameters enter by a ramp."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: parameters.Parameters, dt: float):
        self.assembly, self.machine = assembly, machine
        self.acts: list[ControllerAct] = []
        """Commands since the last record was written."""
        self._tick = Tick(assembly, machine)
        self._trial = self._tick.again()
        self._dt = dt
        self._handover = Handover(x, dt)
        self._no_payload = np.zeros(parameters.ParameterLayout.of(assembly).phi.stop)
        self._payloads = Handover(self._no_payload, dt)
        self._weights: dict[WeightPlace, float] = {}
        self._fit = parameters.ParameterLayout.of(assembly).fit
        self._bodies = parameters.ParameterLayout.of(assembly).bodies
        self._skeleton = kernel.compile(kernel.Recipe(skeleton_function, (assembly,)))

    def again(self, x: parameters.Parameters) -> "ArmController":
        """Return a controller of the same arm and machine with parameters `x` in force. The compiled code is shared."""
        other = copy.copy(self)
        other._tick, other._trial = self._tick.again(), self._trial.again()
        other._handover, other._payloads = Handover(x, self._dt), Handover(self._no_payload, self._dt)
        other._weights, other.acts = {}, []
        return other

    def described(self) -> ArmControllerRecord:
        """Describe this controller for a recording, apart from the machine's files and the participant's data."""
        return ArmControllerRecord(self.machine, self.x.copy(), self.assembly.slid_m or None)

    @property
    def mode(self) -> ControlMode:
        """Control mode of the tick."""
        return self._tick.mode

    @property
    def tau_feedforward(self) -> Joints:
        """Joint torque that the model expects [N·m]."""
        return self._tick.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """Remaining slope of the cuff energy [N·m]; close to 0 where the loops are closed."""
        return self._tick.closure_slope

    @property
    def clearance(self) -> float:
        """Distance of the arm from a singular posture [-]: 1 far, 0 at the singularity."""
        return self._tick.clearance

    @property
    def x(self) -> parameters.Parameters:
        """Arm parameters with which the controller computes torques now."""
        return self._handover.x

    @property
    def z(self) -> Float[np.ndarray, " freedom"]:
        """Angles of the arm in its cuffs in the last step [rad]."""
        return self._tick.z

    @property
    def carried(self) -> parameters.Parameters:
        """Parameters of the arm with the payload in force, as a machine that carries both in full feels them."""
        x = self._handover.x.copy()
        x[: len(self._no_payload)] += self._payloads.x
        return x

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired joint torque [N·m]."""
        self._tick.payload[:] = self._payloads.step()
        return self._tick.step(q, v, reference, self._handover.step())

    @property
    def native_law(self) -> NativeLaw | None:
        """This controller for a caller in C; None before the first step."""
        return self._tick.native_law(self._handover, self._payloads)

    def forget(self) -> None:
        """Search the arm's posture with a cold start in the next step. Needed after a gap in the measurements."""
        self._tick.forget()

    def publish(self, x: parameters.Parameters, q: Joints) -> bool:
        """Publish new parameters. They fade in so slowly that the torque at `q` [rad] changes within its rate limit.

        Args:
            x: New parameters.
            q: Present joint positions [rad].

        Returns:
            True if the parameters are taken. Parameters of a physically impossible arm are refused; plain least squares
            may produce them. Implausible arms (`is_plausible`) are refused, and parameters with which the arm has no
            rest posture in its cuffs at `q`.
        """
        if not (np.isfinite(x).all() and all(is_physical(x[body]) for body in self._bodies)):
            return False
        if not is_plausible(self.assembly.arm, x):
            return False
        wanted = self.torque_at_rest(q, x)
        is_taken = self._trial.is_closed
        if is_taken:
            start = self.x.copy()
            middle = self.torque_at_rest(q, 0.5 * (start + x))
            self._handover.publish(x, steepest_change(self.torque_at_rest(q, start), middle, wanted))
        self.acts.append(PublishParameters(x.copy(), q.copy(), is_taken))
        return is_taken

    def put_in_force(self, x: parameters.Parameters) -> None:
        """Put parameters in force at once, without a ramp. Only before anything is driven, or to test the guard."""
        self._handover.force(x)
        self.acts.append(ForceParameters(x.copy()))

    def let_lead(self, side: ArmSide | None) -> None:
        """Let one of two arms (`side`) float in any drive and lead the other arm. With None, neither arm leads.

        Only allowed while nothing is driven, because the change has no ramp.
        """
        self._tick.led[:] = [limb.side != side for limb in self.assembly.arm.limbs]
        self.acts.append(LeadArm(side))

    @property
    def weights(self) -> Mapping[WeightPlace, float]:
        """Known weights that are carried in addition to the arm [kg]. The arm's parameters do not contain them."""
        return dict(self._weights)

    def carry(self, place: WeightPlace, mass: float, q: Joints) -> bool:
        """Carry a weight [kg] at this place from now on, in full at every gravity level. Zero removes the weight.

        The weight fades in or out so slowly that the torque at `q` [rad] changes within its rate limit. The arm's
        parameters stay as they are. Later published parameters do not change the weight.

        Returns:
            True if the weight is taken. It is refused if the arm with it has no rest posture in its cuffs at `q`.
        """
        weights: dict[WeightPlace, float] = {**self._weights, place: mass}
        # The sum is computed anew each time, so that a removed weight leaves no rounding error.
        wanted = sum(
            (held_weight(self.assembly.arm, m, at=where) for where, m in weights.items() if m), self._no_payload
        )
        before = self.torque_at_rest(q, self.x)
        after = self.torque_at_rest(q, self.x, wanted)
        is_taken = self._trial.is_closed
        if is_taken:
            self._weights = {where: m for where, m in weights.items() if m}
            self._payloads.publish(wanted, float(np.abs(after - before).max()))
        self.acts.append(CarryWeight(place, mass, q.copy(), is_taken))
        return is_taken

    def torque_at_rest(
        self, q: Joints, x: parameters.Parameters, payload: Float[np.ndarray, " phi"] | None = None
    ) -> Joints:
        """Desired torque of the floating controller at rest in the present posture, at its gravity level [N·m].

        `payload` replaces the payload in force.
        """
        self._trial.mode = ControlMode(0.0, self.mode.gravity_level, self.mode.arm_share)
        self._trial.payload[:] = self._payloads.x if payload is None else payload
        return self._trial.at_rest(q, x, self._tick.z)[0]

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points to draw in the base frame [m]: of the exoskeleton, and of the arm as the controller estimates it."""
        exo, arm = self._skeleton.of(q, self._tick.z, self.x[self._fit])
        return exo.T.round(5).tolist(), arm.T.round(5).tolist()


def steepest_change(start: Joints, middle: Joints, end: Joints) -> float:
    """Largest torque change of a ramp, if all of it were as steep as its steepest part [N·m].

    Along a ramp the torque is no straight line, because the arm's posture in its cuffs depends on the parameters.
    Through three points goes a parabola, which is steepest at one of its ends.
    """
    first, second = middle - start, end - middle
    return float(max(np.abs(3.0 * first - second).max(), np.abs(3.0 * second - first).max()))


def skeleton_function(assembly: Assembly) -> ca.Function:
    """Points (3, point) to draw of machine and arm [m], by `q`, the arm's freedoms and the parameters of its fit."""
    layout = parameters.ParameterLayout.of(assembly)
    q, z = ca.SX.sym("q", assembly.n), ca.SX.sym("z", layout.freedoms)
    fit = ca.SX.sym("fit", layout.fit.stop - layout.fit.start)
    exo = body_poses(assembly.exo, q)
    tree = assembly.arm.tree
    arm = arm_poses(assembly, z, fit)
    chains = [_exo_chain(assembly, exo, leaf) for leaf in _leaves(assembly.exo)]
    # Each chain except the last is also drawn backwards, so that one line draws a machine with branches.
    exo_points = [point for chain in chains[:-1] for point in (*chain, *reversed(chain))] + chains[-1]
    limbs = [
        [frame_pose(tree, arm, limb.prefix + name).p for name in ("upper_arm", "forearm", "wrist", "finger_tip")]
        for limb in assembly.arm.limbs
    ]
    # With two arms the line runs from one hand over the shoulders to the other hand.
    arm_points = limbs[0] if len(limbs) == 1 else [*reversed(limbs[0]), *limbs[1]]
    return ca.Function(
        "skeleton", [q, z, fit], [ca.horzcat(*exo_points), ca.horzcat(*arm_points)], ["q", "z", "fit"], ["exo", "arm"]
    )


def _leaves(tree: Tree) -> list[int]:
    parents = {joint.parent for joint in tree.joints}
    return [body for body in range(len(tree.joints)) if body not in parents]


def _exo_chain(assembly: Assembly, poses: list[Transform], leaf: int) -> list[ca.SX]:
    """Points from the base to the end of one chain, with the outermost cuff or mount on its last body."""
    joints, chain, body = assembly.exo.joints, [], leaf
    while body >= 0:
        chain.insert(0, poses[body].p)
        body = joints[body].parent
    calibration = assembly.description.settings.calibration
    named = [*(calibration.mounts if calibration else ()), *(cuff.exo_frame for cuff in assembly.cuffs)]
    on_leaf = [name for name in named if assembly.exo.frame(name).body == leaf]
    return [ca.SX.zeros(3), *chain, *(frame_pose(assembly.exo, poses, name).p for name in on_leaf[:1])]
