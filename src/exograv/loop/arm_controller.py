"""The arm's tick together with the parameters in force: what the pilot flies a worn machine with."""

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
from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.assembly import Assembly
from exograv.model.description import ArmSide
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.loops import arm_positions, arm_roots
from exograv.model.tree import Tree, is_physical
from exograv.signals import Reference
from exograv.spatial import Transform

Joints = Float[np.ndarray, " joint"]


class ArmController:
    """`Controller` of a worn machine; new parameters fade in."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: parameters.Parameters, dt: float):
        self.assembly, self.machine = assembly, machine
        self.acts: list[ControllerAct] = []
        """Commands since they were last recorded."""
        self._tick = Tick(assembly, machine)
        self._trial = self._tick.again()
        self._dt = dt
        self._handover = Handover(x, dt)
        self._no_payload = np.zeros(parameters.ParameterLayout.of(assembly).phi.stop)
        self._payloads = Handover(self._no_payload, dt)
        self._weights: dict[WeightPlace, float] = {}
        self._fit = parameters.ParameterLayout.of(assembly).fit
        self._bodies = parameters.ParameterLayout.of(assembly).bodies
        self._skeleton = kernel.compile(skeleton_function(assembly))

    def again(self, x: parameters.Parameters) -> "ArmController":
        """Another controller of the same arm and machine, with these parameters in force; nothing is compiled anew."""
        other = copy.copy(self)
        other._tick, other._trial = self._tick.again(), self._trial.again()
        other._handover, other._payloads = Handover(x, self._dt), Handover(self._no_payload, self._dt)
        other._weights, other.acts = {}, []
        return other

    def described(self) -> ArmControllerRecord:
        """Describe this controller for a recording, which holds the machine's own files and the person."""
        return ArmControllerRecord(self.machine, self.x.copy())

    @property
    def mode(self) -> ControlMode:
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
    def clearance(self) -> float:
        """How far the arm is from a singular posture [-]."""
        return self._tick.clearance

    @property
    def x(self) -> parameters.Parameters:
        """Parameters in force."""
        return self._handover.x

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired torque [N·m]."""
        self._tick.payload[:] = self._payloads.step()
        return self._tick.step(q, v, reference, self._handover.step())

    def forget(self) -> None:
        """Find the arm's posture from cold in the next step: after a time that nobody saw."""
        self._tick.forget()

    def publish(self, x: parameters.Parameters, q: Joints) -> bool:
        """Head for new parameters; they enter no faster than the torque at `q` may change.

        Returns:
            Whether they are taken: not those of an impossible arm, which plain least squares may arrive at, nor where
            an arm of these parameters would not lie at rest in its cuffs at `q`.
        """
        if not (np.isfinite(x).all() and all(is_physical(x[body]) for body in self._bodies)):
            return False
        wanted = self.torque_at_rest(q, x)
        is_taken = self._trial.is_closed
        if is_taken:
            change = wanted - self.torque_at_rest(q, self.x)
            self._handover.publish(x, float(np.abs(change).max()))
        self.acts.append(PublishParameters(x.copy(), q.copy(), is_taken))
        return is_taken

    def put_in_force(self, x: parameters.Parameters) -> None:
        """Parameters at once and unseen: at a beginning, before anything is driven, and to prove the guard."""
        self._handover = Handover(x, self._dt)
        self.acts.append(ForceParameters(x.copy()))

    def let_lead(self, side: ArmSide | None) -> None:
        """One of two arms floats from now on whatever drives the other, which it leads; None where none does.

        Only while nothing is driven: it takes no ramp.
        """
        self._tick.led[:] = [limb.side != side for limb in self.assembly.arm.limbs]
        self.acts.append(LeadArm(side))

    @property
    def weights(self) -> Mapping[WeightPlace, float]:
        """Known weights that are carried beside the arm [kg]; the arm's parameters know nothing of them."""
        return dict(self._weights)

    def carry(self, place: WeightPlace, mass: float, q: Joints) -> bool:
        """Carry a weight [kg] at this place from now on, in full at every gravity level; zero takes it off.

        It fades in or out no faster than the torque at `q` [rad] may change. The arm's parameters stay untouched, and
        publishing new ones leaves the weight where it is.

        Returns:
            Whether it is taken: not where the arm with it would not lie at rest in its cuffs at `q`.
        """
        weights: dict[WeightPlace, float] = {**self._weights, place: mass}
        # Summed anew: what is taken off is gone to the last bit.
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
        """Desired torque of the floating controller, in its gravity level, at the present posture at rest [N·m].

        With the payload in force, or another one.
        """
        self._trial.mode = ControlMode(0.0, self.mode.gravity_level, self.mode.arm_share)
        self._trial.payload[:] = self._payloads.x if payload is None else payload
        return self._trial.at_rest(q, x, self._tick.z)[0]

    def skeleton(self, q: Joints) -> tuple[list[list[float]], list[list[float]]]:
        """Points to draw in the base frame [m]: along the exoskeleton, and along the arm as the controller sees it."""
        exo, arm = self._skeleton.of(q, self._tick.z, self.x[self._fit])
        return exo.T.round(5).tolist(), arm.T.round(5).tolist()


def skeleton_function(assembly: Assembly) -> ca.Function:
    """Points (3, point) to draw of machine and arm by `q`, the arm's freedoms and what fits the arm's place [m]."""
    layout = parameters.ParameterLayout.of(assembly)
    q, z = ca.SX.sym("q", assembly.n), ca.SX.sym("z", layout.freedoms)
    fit = ca.SX.sym("fit", layout.fit.stop - layout.fit.start)
    exo = body_poses(assembly.exo, q)
    tree = assembly.arm.tree
    arm = body_poses(tree, arm_positions(assembly.arm, z, fit), arm_roots(assembly, fit))
    chains = [_exo_chain(assembly, exo, leaf) for leaf in _leaves(assembly.exo)]
    # Back along each chain but the last, so that one line draws a machine with branches.
    exo_points = [point for chain in chains[:-1] for point in (*chain, *reversed(chain))] + chains[-1]
    limbs = [
        [frame_pose(tree, arm, limb.prefix + name).p for name in ("upper_arm", "forearm", "wrist", "finger_tip")]
        for limb in assembly.arm.limbs
    ]
    # Two arms: from one hand over the shoulders to the other.
    arm_points = limbs[0] if len(limbs) == 1 else [*reversed(limbs[0]), *limbs[1]]
    return ca.Function(
        "skeleton", [q, z, fit], [ca.horzcat(*exo_points), ca.horzcat(*arm_points)], ["q", "z", "fit"], ["exo", "arm"]
    )


def _leaves(tree: Tree) -> list[int]:
    parents = {joint.parent for joint in tree.joints}
    return [body for body in range(len(tree.joints)) if body not in parents]


def _exo_chain(assembly: Assembly, poses: list[Transform], leaf: int) -> list[ca.SX]:
    """Points from the base to the end of one chain, with the cuff or mount that is farthest out on its last body."""
    joints, chain, body = assembly.exo.joints, [], leaf
    while body >= 0:
        chain.insert(0, poses[body].p)
        body = joints[body].parent
    calibration = assembly.description.settings.calibration
    named = [*(calibration.mounts if calibration else ()), *(cuff.exo_frame for cuff in assembly.cuffs)]
    on_leaf = [name for name in named if assembly.exo.frame(name).body == leaf]
    return [ca.SX.zeros(3), *chain, *(frame_pose(assembly.exo, poses, name).p for name in on_leaf[:1])]
