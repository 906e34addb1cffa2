"""Control law of the empty machine: it follows a reference with feed-forward and PD, with known weights at mounts."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.description import RigDescription
from exograv.model.tree import Tree, inertial_parameters
from exograv.signals import Reference

from .controller_acts import ControllerAct, EmptyControllerRecord, HangWeight
from .native_law import NativeLaw

Joints = Float[np.ndarray, " joint"]

STIFFER_KP, STIFFER_KD = 2.0, 1.5
"""Factors on the weak PD gains [-]: the machine has no wearer, and stick-slip would disturb slow sweeps."""
DAMPING_RATE, STIFFNESS_RATE = 35.0, 15.0
"""Largest damping per inertia [1/s], and largest stiffness per damping [1/s]. More damping conflicts with the delays
and the drives' bandwidth of 25 Hz: a light machine without an arm would shake."""


class ExoTick:
    """Controller from URDF and data sheet alone; the calibration that corrects both needs it."""

    def __init__(self, description: RigDescription, tree: Tree, gravity: Float[np.ndarray, " 3"] = GRAVITY):
        """Take a tree and the `gravity` (3,) in its base [m/s²], from the calibration if there is one."""
        n = len(tree.joints)
        self._mounts = description.mounts
        q, v, weights = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("weights", len(self._mounts))
        q_reference, v_reference, a_reference = (ca.SX.sym(s, n) for s in ("q_reference", "v_reference", "a_reference"))
        phi = ca.SX(ca.DM(tree.phi.T))
        for mount, weight in zip(self._mounts, ca.vertsplit(weights), strict=True):
            frame = tree.frame(mount)
            phi[:, frame.body] += weight * ca.DM(inertial_parameters(1.0, frame.p_body_frame, np.zeros((3, 3))))
        rotor = ca.DM(description.per_actuator("rotor_inertia_kgm2"))
        feedforward = rnea(tree, q, v_reference, a_reference, phi, ca.SX(ca.DM(gravity))) + rotor * a_reference
        kp, kd = (ca.DM(gains) for gains in empty_gains(description, tree))
        desired = feedforward + kp * (q_reference - q) + kd * (v_reference - v)
        names = ["q", "v", "q_reference", "v_reference", "a_reference", "weights"]
        arguments = [q, v, q_reference, v_reference, a_reference, weights]
        function = ca.Function("exo_tick", arguments, [desired, feedforward], names, ["tau_desired", "tau_feedforward"])
        self._kernel = kernel.compile(function)
        self._written = tuple(self._kernel.inputs[name] for name in names[:5])
        self._tau_desired = self._kernel.outputs["tau_desired"]
        self.tau_feedforward: Joints = self._kernel.outputs["tau_feedforward"]
        """Motor torque that the model predicts [N·m]."""
        native = self._kernel.native
        self.native_law = native and NativeLaw(self._tau_desired, self.tau_feedforward, native, self._written)
        """This controller for a caller in C; None if there is no native code."""
        self.closure_slope = 0.0
        """Remaining gradient of the closure [N·m]: zero, because the empty machine has no loop."""
        self.clearance = 1.0
        """Distance from a singular posture [-]: 1, because there is no arm."""
        self.acts: list[ControllerAct] = []
        """Commands since the last recording of commands."""

    def described(self) -> EmptyControllerRecord:
        """Describe this controller for a recording, which holds the machine's own files."""
        return EmptyControllerRecord()

    def hang(self, mount: str, mass_kg: float) -> None:
        """Carry a known weight at a mount from now on; zero removes it."""
        self._kernel.inputs["weights"][self._mounts.index(mount)] = mass_kg
        self.acts.append(HangWeight(mount, mass_kg))

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Compute the desired torque (joint,) [N·m]; arguments as in `Tick.step`."""
        in_q, in_v, in_q_reference, in_v_reference, in_a_reference = self._written
        in_q[:], in_v[:] = q, v
        in_q_reference[:], in_v_reference[:], in_a_reference[:] = reference
        self._kernel.evaluate()
        return self._tau_desired


def empty_gains(description: RigDescription, tree: Tree) -> tuple[Joints, Joints]:
    """Stiffness [N·m/rad] and damping [N·m·s/rad] of each joint of the empty machine."""
    kd = STIFFER_KD * description.per_actuator("weak_kd_Nms_per_rad")
    kd = np.minimum(kd, most_damping(description, tree))
    return np.minimum(STIFFER_KP * description.per_actuator("weak_kp_Nm_per_rad"), STIFFNESS_RATE * kd), kd


def most_damping(description: RigDescription, tree: Tree) -> Joints:
    """Largest damping by the computer at which no joint of the empty machine shakes [N·m·s/rad]."""
    return DAMPING_RATE * _least_inertia(description, tree)


def _least_inertia(description: RigDescription, tree: Tree) -> Joints:
    """Inertia of each joint while all others are free, minimum over the postures of the sweeps [kg·m²]."""
    n = len(tree.joints)
    q, a = ca.SX.sym("q", n), ca.SX.sym("a", n)
    tau = rnea(tree, q, ca.SX.zeros(n), a, ca.SX(ca.DM(tree.phi.T)), ca.SX.zeros(3))
    mass_matrix = ca.Function("mass_matrix", [q], [ca.jacobian(tau, a)])
    rotors = np.diag(description.per_actuator("rotor_inertia_kgm2"))
    postures = np.deg2rad([sweep.posture_deg for sweep in description.calibration.sweeps])
    inverses = [np.linalg.inv(mass_matrix(posture).full() + rotors) for posture in postures]
    return 1.0 / np.max([np.diag(inverse) for inverse in inverses], axis=0)
