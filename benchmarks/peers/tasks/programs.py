"""Definition of each timed computation as one CasADi function: the reference for every opponent."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.control.returned_friction import returned_friction
from exograv.dynamics.friction import Friction, friction_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.passive import passive_torque
from exograv.dynamics.regressor import tree_regressor
from exograv.dynamics.rnea import rnea
from exograv.model.assembly import Assembly
from exograv.model.tree import Tree

ROTOR, COULOMB, VISCOUS = 0, 1, 2
"""Order of each joint's other parameters, after the bodies' inertial parameters."""


def rnea_function(tree: Tree) -> ca.Function:
    """Return the torque of the bare tree; masses are constants, as in every opponent."""
    q, v, a = _motion(tree)
    return ca.Function("rnea", [q, v, a], [rnea(tree, q, v, a, ca.SX(ca.DM(tree.phi.T)), _gravity())], *_names("tau"))


def derivatives_function(tree: Tree) -> ca.Function:
    """Return the derivatives of that torque with respect to position, velocity and acceleration."""
    q, v, a = _motion(tree)
    tau = rnea(tree, q, v, a, ca.SX(ca.DM(tree.phi.T)), _gravity())
    outputs = [ca.jacobian(tau, x) for x in (q, v, a)]
    return ca.Function("rnea_derivatives", [q, v, a], outputs, *_names("dtau_dq", "dtau_dv", "dtau_da"))


def regressor_function(tree: Tree) -> ca.Function:
    """Return the matrix (joint, 10 · joint) of the torque's dependence on all inertial parameters."""
    q, v, a = _motion(tree)
    return ca.Function("regressor", [q, v, a], [tree_regressor(tree, q, v, a, _gravity())], *_names("Y"))


def torque_gradient_function(tree: Tree, friction: Friction) -> ca.Function:
    """Return torque with rotors and friction, and the gradient of half its squared error by all parameters.

    Parameters are 13 per joint, 91 for seven: ten inertial ones of each body, then rotor inertia, Coulomb and viscous
    friction of all joints.
    """
    n = len(tree.joints)
    q, v, a = _motion(tree)
    x, tau_measured = ca.SX.sym("x", 13 * n), ca.SX.sym("tau_measured", n)
    of_joint = [x[(10 + i) * n : (11 + i) * n] for i in (ROTOR, COULOMB, VISCOUS)]
    load = rnea(tree, q, v, a, ca.reshape(x[: 10 * n], 10, n), _gravity()) + of_joint[ROTOR] * a
    learned = replace(friction, coulomb=of_joint[COULOMB], viscous=of_joint[VISCOUS])
    tau = load + friction_torque(learned, v, load)
    gradient = ca.gradient(0.5 * ca.sumsqr(tau - tau_measured), x)
    names = ["q", "v", "a", "x", "tau_measured"], ["tau", "gradient"]
    return ca.Function("torque_gradient", [q, v, a, x, tau_measured], [tau, gradient], *names)


@dataclass(frozen=True)
class AlignedTick:
    """Two trees that move as one: the loops are exactly determined and the shoulder centres coincide.

    Then the arm's joints move as the machine's (G is the unit matrix), no cuff is strained, and nothing is solved.
    """

    assembly: Assembly
    arm: Tree
    """Tree of the arm, with as many joints as the machine."""

    machine: CalibratedMachine

    @property
    def heavy(self) -> list[int]:
        """Indices of the arm's bodies that have mass."""
        return [i for i, phi in enumerate(self.arm.phi) if phi[0] > 0.0]

    @property
    def x(self) -> Float[np.ndarray, " parameter"]:
        """Parameters of the table's arm in the machine, with some elasticity, ordered as in `aligned_tick_function`."""
        n, friction = len(self.arm.joints), self.machine.friction
        passive = [np.full(n, 1.5), np.full(n, 0.4), np.full(n, 0.3)]  # N·m/rad, N·m, N·m·s/rad (docs: arm.md)
        joints = [self.machine.rotor_inertia, np.asarray(friction.coulomb), np.asarray(friction.viscous)]
        return np.concatenate([*self.arm.phi[self.heavy], *passive, *joints])

    @property
    def feedback(self) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
        """Gains of a weak PD controller [N·m/rad], [N·m·s/rad]."""
        description = self.assembly.description
        return description.per_actuator("weak_kp_Nm_per_rad"), description.per_actuator("weak_kd_Nms_per_rad")


def aligned_tick_function(tick: AlignedTick) -> ca.Function:
    """Return the control law of `control.tick` for an aligned machine.

    Parameters: ten of each of the arm's bodies with mass, then stiffness, spring offset, damping, rotor inertia,
    Coulomb and viscous friction of every joint.
    """
    arm, machine, heavy = tick.arm, tick.machine, tick.heavy
    n = len(arm.joints)
    q, v, q_reference, v_reference, a_reference = (
        ca.SX.sym(s, n) for s in ("q", "v", "q_reference", "v_reference", "a_reference")
    )
    x, mode = ca.SX.sym("x", 10 * len(heavy) + 6 * n), ca.SX.sym("mode", 3)
    q_before, spring_before = ca.SX.sym("q_before", n), ca.SX.sym("spring_before", n)
    drive, gravity_level, arm_share = mode[0], mode[1], mode[2]
    phi = ca.SX.zeros(10, n)
    for k, body in enumerate(heavy):
        phi[:, body] = arm_share * x[10 * k : 10 * (k + 1)]
    first = 10 * len(heavy)
    stiffness, offset, damping, rotor, coulomb, viscous = (x[first + i * n : first + (i + 1) * n] for i in range(6))
    motion = (q, drive * v_reference, drive * a_reference)
    tau_arm = rnea(arm, *motion, phi, (1 - gravity_level) * _gravity())
    tau_arm += drive * passive_torque(stiffness, offset, damping, q, motion[1])
    load = rnea(tick.assembly.exo, *motion, ca.SX(ca.DM(machine.phi.T)), _gravity()) + rotor * motion[2] + tau_arm
    friction = replace(machine.friction, coulomb=coulomb, viscous=viscous)
    spring = (1 - drive) * spring_before
    returned = returned_friction(friction, machine.friction_sd, load, q - q_before, v, spring)
    feedforward = load + drive * friction_torque(friction, v_reference, load) + (1 - drive) * returned.tau
    kp, kd = (ca.DM(gain) for gain in tick.feedback)
    desired = feedforward + drive * (kp * (q_reference - q) + kd * (v_reference - v))
    names = ["q", "v", "q_reference", "v_reference", "a_reference", "x", "mode", "q_before", "spring_before"]
    inputs = [q, v, q_reference, v_reference, a_reference, x, mode, q_before, spring_before]
    outputs = {
        "tau_desired": desired,
        "tau_feedforward": feedforward,
        "tau_arm": tau_arm,
        "spring": returned.spring,
    }
    return ca.Function("aligned_tick", inputs, list(outputs.values()), names, list(outputs))


def _motion(tree: Tree) -> tuple[ca.SX, ca.SX, ca.SX]:
    n = len(tree.joints)
    return ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n)


def _gravity() -> ca.SX:
    return ca.SX(ca.DM(GRAVITY))


def _names(*outputs: str) -> tuple[list[str], list[str]]:
    return ["q", "v", "a"], list(outputs)
