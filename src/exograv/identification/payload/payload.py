"""Torque model of a robot with a payload: unknown body at a frame, and uncertain parameters of the robot."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.friction import Friction, friction_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.errors import ModelError
from exograv.identification.calibration.empty_machine import V_REST, V_STRIBECK
from exograv.identification.core.arm_model import SLOW_V
from exograv.identification.core.interface import Joints, Parameters, Sample
from exograv.model.tree import Frame, Tree, from_pseudo_inertia, inertial_parameters, pseudo_inertia

PAYLOAD = slice(0, 10)
"""Inertial parameters of the payload about the origin of its frame, in that frame."""

# kg, kg·m, kg·m²: wide, because almost nothing is known of a payload of a hand or small robot.
MASS_SD, FIRST_MOMENT_SD, INERTIA_SD = 3.0, 0.3, 0.1
NOTHING = inertial_parameters(0.1, np.zeros(3), 1e-3 * np.eye(3))
"""Prior mean: a body of negligible mass that is physically possible."""


@dataclass(frozen=True)
class RobotBlocks:
    """Slices of the robot's own parameters, for n joints: links, then one entry per joint for each drive parameter."""

    n: int

    @property
    def links(self) -> slice:
        """Inertial parameters (n · 10) of the links."""
        return slice(10, 10 + 10 * self.n)

    @property
    def rotor(self) -> slice:
        """Rotor inertia, reflected to the joint [kg·m²]."""
        return self._joint_block(0)

    @property
    def coulomb(self) -> slice:
        """Slice of the Coulomb friction in the parameter vector [N·m]."""
        return self._joint_block(1)

    @property
    def viscous(self) -> slice:
        """Slice of the viscous friction in the parameter vector [N·m·s/rad]."""
        return self._joint_block(2)

    @property
    def load_share(self) -> slice:
        """Coulomb torque per torque that the gear carries [-]."""
        return self._joint_block(3)

    @property
    def asymmetry(self) -> slice:
        """Torque that is independent of the direction of motion: current offset, or unequal friction [N·m]."""
        return self._joint_block(4)

    @property
    def curvature(self) -> slice:
        """Further viscous friction per unit of speed, usually negative [N·m·s²/rad²]."""
        return self._joint_block(5)

    @property
    def gain(self) -> slice:
        """Relative error of the stated torque gain: measured torque = (1 + gain) · torque [-]."""
        return self._joint_block(6)

    @property
    def robot(self) -> slice:
        """Slice of all parameters except the payload's."""
        return slice(10, self.count)

    @property
    def count(self) -> int:
        """Length of the parameter vector."""
        return 10 + 17 * self.n

    def _joint_block(self, i: int) -> slice:
        start = 10 + (10 + i) * self.n
        return slice(start, start + self.n)


class PayloadModel:
    """Torque model of a robot with a payload; parameters `x`: payload (10,), then the robot as in `RobotBlocks`."""

    def __init__(self, tree: Tree, payload_frame: str):
        self.tree, self.frame = tree, tree.frame(payload_frame)
        if self.frame.body < 0:
            moving = sorted(name for name, frame in tree.frames.items() if frame.body >= 0)
            raise ModelError(
                f"Frame '{payload_frame}' of {tree.name} does not move, so no motor carries a payload there. "
                f"Moving frames: {', '.join(moving)}."
            )
        self.n_joints = len(tree.joints)
        self.blocks = RobotBlocks(self.n_joints)
        self.n_parameters = self.blocks.count
        self._kernel = kernel.compile(_torque_and_derivative(tree, self.frame, self.blocks))
        self._coulomb = np.zeros(self.n_joints)

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return expected torque (joint,) [N·m] at `x` and its derivative; linear except for friction under load."""
        self._coulomb[:] = x[self.blocks.coulomb]
        tau, derivative = self._kernel.of(sample.q, sample.v, sample.a, x)
        return tau, derivative

    def restart(self) -> None:
        """Do nothing: the samples are independent of each other."""

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m]: the last Coulomb torque at rest, zero in clear motion."""
        return np.abs(self._coulomb) / np.cosh(np.minimum(np.abs(v) / SLOW_V, 20.0)) ** 2


def payload_prior() -> tuple[Float[np.ndarray, " 10"], Float[np.ndarray, "10 10"]]:
    """Prior mean and covariance of an unknown payload."""
    sd = np.array([MASS_SD, *[FIRST_MOMENT_SD] * 3, *[INERTIA_SD] * 6])
    return NOTHING.copy(), np.diag(sd**2)


def robot_torque(tree: Tree, motion: tuple[ca.SX, ca.SX, ca.SX], x: ca.SX, phi_extra: ca.SX, body: int) -> ca.SX:
    """Measured torque (joint,) [N·m] of a robot with extra inertial parameters (10,) on one of its bodies.

    Args:
        tree: Joints and links of the robot.
        motion: q, v, a (joint,) each.
        x: All parameters in the order of `RobotBlocks`; only the robot's are read.
        phi_extra: Inertial parameters of the payload about the body's origin.
        body: Index of the body that carries it.
    """
    q, v, a = motion
    blocks = RobotBlocks(len(tree.joints))
    phi = ca.reshape(x[blocks.links], 10, blocks.n)
    phi[:, body] += phi_extra
    load = rnea(tree, q, v, a, phi, ca.SX(ca.DM(GRAVITY))) + x[blocks.rotor] * a
    friction = Friction(
        coulomb=x[blocks.coulomb],
        viscous=x[blocks.viscous],
        breakaway=np.ones(blocks.n),
        load_share=x[blocks.load_share],
        asymmetry=x[blocks.asymmetry],
        v_stribeck=np.full(blocks.n, V_STRIBECK),
        v_rest=V_REST,
    )
    # Friction of a harmonic drive grows more slowly than its speed: the viscous term has a curvature.
    return (1.0 + x[blocks.gain]) * (load + friction_torque(friction, v, load) + x[blocks.curvature] * v * ca.fabs(v))


def about_body(frame: Frame) -> Float[np.ndarray, "10 10"]:
    """Matrix from inertial parameters about the frame's origin to those about the origin of the carrying body."""
    T_body_frame = np.eye(4)
    T_body_frame[:3, :3], T_body_frame[:3, 3] = frame.R_body_frame, frame.p_body_frame
    columns = [from_pseudo_inertia(T_body_frame @ pseudo_inertia(unit) @ T_body_frame.T) for unit in np.eye(10)]
    return np.column_stack(columns)


def _torque_and_derivative(tree: Tree, frame: Frame, blocks: RobotBlocks) -> ca.Function:
    q, v, a = (ca.SX.sym(name, blocks.n) for name in ("q", "v", "a"))
    x = ca.SX.sym("x", blocks.count)
    tau = robot_torque(tree, (q, v, a), x, ca.DM(about_body(frame)) @ x[PAYLOAD], frame.body)
    return ca.Function("payload", [q, v, a, x], [tau, ca.jacobian(tau, x)], ["q", "v", "a", "x"], ["tau", "derivative"])
