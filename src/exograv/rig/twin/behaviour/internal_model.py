"""Internal model of a wearer's own arm: torque that a movement needs, at the felt or believed gravity."""

from dataclasses import replace

import casadi as ca
import mujoco
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.model.description import RigDescription
from exograv.motion import Trajectory
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.wearer.arm_bodies import body_name
from exograv.rig.twin.wearer.passive import elastic_torque, follower_paths
from exograv.rig.twin.wearer.wearer import Cuffs, Wearer
from exograv.rig.twin.world.scene import build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.rig.twin.world.surroundings import fingertip_of

DIFFERENCE = 1e-3
"""Turn of a joint of the machine for the finite difference of the arm's motion [rad]."""

PerFreedom = Float[np.ndarray, " arm"]


class ArmInverseDynamics:
    """Inverse dynamics of the arm alone, without the machine, by the twin's engine."""

    def __init__(self, description: RigDescription, machine: Machine, wearer: Wearer):
        """Build the model. The machine only defines the arm's place and the direction of gravity."""
        self._scene, self._wearer, self._gravity = build_scene(description, machine, wearer), wearer, machine.gravity
        q = ca.SX.sym("q", len(self._scene.arm))
        led = follower_paths(wearer, q)
        results = [led, ca.densify(ca.jacobian(led, q)), elastic_torque(wearer.passive, q)]
        self._at_posture = kernel.compile(ca.Function("own_arm", [q], results, ["q"], ["led", "slope", "elastic"]))
        skeleton = self._scene.arms[0].skeleton
        bone, self._tip = fingertip_of(skeleton)
        self._finger = self._scene.data.body(body_name(skeleton, bone))
        self._turns, self._no_turns = np.zeros((3, self._scene.model.nv)), None

    def torque(
        self, q: PerFreedom, v: PerFreedom, a: PerFreedom, gravity_level: float = 1.0, inertia_share: float = 1.0
    ) -> PerFreedom:
        """Muscle torque [N·m] for position [rad], velocity [rad/s] and acceleration [rad/s²] of the arm's freedoms.

        `inertia_share` scales the believed inertia of the arm at unchanged weight. The shoulder's own path is followed
        to first order; hysteresis is not modelled.
        """
        scene, model, data = self._scene, self._scene.model, self._scene.data
        led, slope, elastic = self._follow(q)
        slowed = np.sqrt(inertia_share) * v  # velocity torques grow with the square of speed
        model.opt.gravity = gravity_level * self._gravity
        data.qpos[scene.arm], data.qvel[scene.arm], data.qacc[scene.arm] = q, slowed, inertia_share * a
        followers = scene.followers
        data.qpos[followers], data.qvel[followers], data.qacc[followers] = (
            led,
            slope @ slowed,
            inertia_share * (slope @ a),
        )
        mujoco.mj_inverse(model, data)
        load = data.qfrc_inverse
        return load[scene.arm] + slope.T @ load[followers] - elastic + self._wearer.passive.damping * v

    def torques(self, movement: Trajectory, gravity_level: float = 1.0) -> Float[np.ndarray, "tick arm"]:
        """Muscle torques along a movement of the arm's freedoms [N·m]."""
        rows = zip(movement.q, movement.v, movement.a, strict=True)
        return np.array([self.torque(q, v, a, gravity_level) for q, v, a in rows])

    def fingertip(self, q: PerFreedom) -> Float[np.ndarray, " 3"]:
        """Position of the first arm's fingertip in the base frame with the freedoms at `q` [m]."""
        scene, data = self._scene, self._scene.data
        data.qpos[scene.arm] = q
        data.qpos[scene.followers] = self._follow(q)[0]
        mujoco.mj_kinematics(scene.model, data)
        return self._finger.xpos + self._finger.xmat.reshape(3, 3) @ self._tip

    def fingertip_slope(self, q: PerFreedom) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 arm"]]:
        """Position of the fingertip [m] and its derivative by the freedoms [m/rad]."""
        tip, scene = self.fingertip(q), self._scene
        mujoco.mj_comPos(scene.model, scene.data)
        mujoco.mj_jac(scene.model, scene.data, self._turns, self._no_turns, tip, self._finger.id)
        return tip, self._turns[:, scene.arm] + self._turns[:, scene.followers] @ self._at_posture.outputs["slope"]

    def _follow(self, q: PerFreedom) -> tuple[np.ndarray, np.ndarray, PerFreedom]:
        """Followers of the freedoms (follower,), their slope (follower, arm), and elastic torque (arm,) [N·m]."""
        at_posture = self._at_posture
        at_posture.inputs["q"][:] = q
        at_posture.evaluate()
        outputs = at_posture.outputs
        return outputs["led"], outputs["slope"], outputs["elastic"]

    def inertia(self, q: PerFreedom) -> Float[np.ndarray, "arm arm"]:
        """Inertia matrix of the arm's freedoms [kg·m²]."""
        still = np.zeros_like(q)
        at_rest = self.torque(q, still, still)
        return np.array([self.torque(q, still, row) - at_rest for row in np.eye(len(q))])


def out_of_the_machine(wearer: Wearer) -> Wearer:
    """Return the same person with open cuffs: machine and arm share the room but do not touch."""
    return replace(wearer, cuffs=Cuffs(np.zeros(6), 0.0, 0.0))


def in_gravity(machine: Machine, level: float) -> Machine:
    """Return the same machine in a room with this share of Earth's gravity [-], as an aircraft on a parabola."""
    return replace(machine, gravity=level * machine.gravity)


def worn_inertia(description: RigDescription, machine: Machine, wearer: Wearer) -> Float[np.ndarray, "arm arm"]:
    """Inertia of links and rotors that a wearer accelerates beside the own arm, in the arm's freedoms [kg·m²].

    Computed at the donning posture. A wearer who is used to the machine has learned about this much.
    """
    scene = build_scene(description, machine, wearer)
    statics, (q, q_arm) = Statics(scene, wearer, with_passive=True), scene.fastened
    rest = statics.settle(q, q_arm)[0]
    slope = np.array([statics.settle(turned, rest)[0] - rest for turned in q + DIFFERENCE * np.eye(len(q))]).T
    links = np.zeros((scene.model.nv, scene.model.nv))
    mujoco.mj_fullM(scene.model, scene.data, links)
    soft_gears = np.isfinite(machine.drives.gear_stiffness)  # rotors of rigid ones are among the links
    inertia = links[np.ix_(scene.exo, scene.exo)] + np.diag(soft_gears * machine.drives.rotor_inertia)
    machine_per_arm = np.linalg.pinv(slope / DIFFERENCE)
    return machine_per_arm.T @ inertia @ machine_per_arm
