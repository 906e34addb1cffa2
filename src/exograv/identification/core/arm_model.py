"""Expected torque of the arm in the machine, and its derivative with respect to all learned parameters."""

import copy
from dataclasses import replace

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.closure import PIVOT_MIN, closure, cuff_energy, newton_step
from exograv.dynamics.friction import friction_torque
from exograv.dynamics.loop_torque import ArmExpression, arm_load, exo_torque, static_load
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.model.arm import ENDS_DEG
from exograv.model.assembly import Assembly
from exograv.model.limb import FREEDOMS
from exograv.model.loops import NEAR_SINGULAR, LoopSolver
from exograv.spatial import solve_symmetric

from .hidden_cuffs import CuffLoads
from .interface import Joints, Parameters, Sample

SLOW_V = 0.1
"""Speed below which the direction of friction is uncertain [rad/s]: the delays of the filters blur a reversal."""

SAG_STEPS = 5
"""Newton steps from the posture of least cuff energy to the posture under load; convergence is quadratic."""

SINGULAR_SD = 1e3
"""Standard deviation of a sample near a singular posture of the arm [N·m]: spring and damping torques have no
meaning there."""

END_STOP_NM, END_STOP_DEG = 10.0, 5.0
"""Standard deviation of the torque of an end stop at the end of a joint's range [N·m], and angle over which it falls by
a factor of e [°]: assumed (docs/explanation/identification.md)."""

STOPPED = "flexion", "abduction", "rotation", "elbow"
"""Freedoms with end stops. Those of forearm and wrist are left out: they are weak."""

SLOPE_MAX = 0.01
"""Largest gradient of the cuff energy after closure [N·m]; above it the closure is repeated from a cold start."""


class ArmModel:
    """Model of an arm in a calibrated machine (a `TorqueModel`); parameters in the order of `dynamics.parameters`."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        self.assembly, self.machine = assembly, machine
        self._layout = ParameterLayout.of(assembly)
        self.n_joints, self.n_parameters = assembly.n, self._layout.count
        self._kernel = kernel.compile(kernel.Recipe(_torque_and_derivative, (assembly, machine)))
        self._solver = LoopSolver(assembly)
        self._abductions = [limb.freedoms.start + 1 for limb in assembly.arm.limbs]
        self._coulomb = np.asarray(machine.friction.coulomb)
        names = [name for limb in assembly.arm.limbs for name in FREEDOMS[: limb.n_freedoms]]
        self._stopped = np.array([k for k, name in enumerate(names) if name in STOPPED])
        self._ends = np.deg2rad([ENDS_DEG[names[k]] for k in self._stopped]).T
        self._forget()

    @property
    def z(self) -> Float[np.ndarray, " freedom"]:
        """Arm angles in the sample that was linearised last [rad]."""
        return self._z

    def again(self) -> "ArmModel":
        """Return a second model of the same arm and machine for another motion; it shares the compiled code."""
        other = copy.copy(self)
        other._kernel = self._kernel.again()
        other._forget()
        return other

    def _forget(self) -> None:
        self._inputs = tuple(self._kernel.inputs.values())
        tau, derivative, z, G, *others = self._kernel.outputs.values()
        # A kernel keeps the single column of a one-joint machine as a vector.
        self._outputs = tau, derivative, z, G.reshape(len(z), self.n_joints, order="F"), *others
        self._q_before: Joints | None = None
        self._is_lost = False
        self._z = np.zeros(self.assembly.n_freedoms)
        self._G = np.zeros((self.assembly.n_freedoms, self.n_joints))
        cuffs = len(self.assembly.cuffs)
        self._by_moved, self._stretch = np.zeros((self.n_joints, 3 * cuffs)), np.zeros(3 * cuffs)

    def cuff_loads(self) -> CuffLoads:
        """Return the loads of the cuffs in the sample that was linearised last."""
        return CuffLoads(self._by_moved.reshape(self.n_joints, -1, 3).copy(), self._stretch.reshape(-1, 3).copy())

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative.

        The closure starts from the posture of the previous sample (warm start).
        """
        motion = (sample.q, sample.v, sample.a)
        if self._q_before is None:
            self._close(motion, x)
        else:
            self._z += self._G @ (sample.q - self._q_before)
        self._q_before = sample.q.copy()
        tau, derivative, slope = self._evaluate(motion, x)
        if not slope < SLOPE_MAX:
            tau, derivative, slope = self._evaluate(motion, x)  # a cold start takes seven
        if not slope < SLOPE_MAX:
            self._close(motion, x)
            tau, derivative, slope = self._evaluate(motion, x)
        self._is_lost = not slope < SLOPE_MAX
        if self._is_lost:
            # With implausible parameters the closure does not converge: zero rows keep the sample out of the estimate.
            self.restart()
            return np.zeros_like(tau), np.zeros_like(derivative)
        return tau, derivative

    def restart(self) -> None:
        """Start a new motion: the next sample is closed from a cold start."""
        self._q_before = None

    def continue_at(self, q: Joints, z: Float[np.ndarray, " freedom"]) -> None:
        """Take the arm's angles `z` [rad] at the posture `q` [rad] from a closure that is solved already."""
        self._z[:], self._q_before = z, q.copy()

    def at_rest(self, q: Joints, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Torque (joint,) that holds exoskeleton and arm at rest at `q` [rad], and its derivative.

        Friction and the elasticity of the wearer's joints are not included.
        """
        motion = (q, np.zeros(self.n_joints), np.zeros(self.n_joints))
        springs = slice(self._layout.stiffness.start, self._layout.spring_offset.stop)
        held = x.copy()
        held[springs] = 0.0
        self._close(motion, held)
        tau, derivative, _ = self._evaluate(motion, held)
        self.restart()
        derivative[:, springs] = 0.0
        return tau, derivative

    def _close(self, motion: tuple[Joints, Joints, Joints], x: Parameters) -> None:
        """Close the loops under load from a cold start."""
        q = motion[0]
        self._z[:] = self._solver.solve(q, fit=x[self._layout.fit])[0]
        for _ in range(SAG_STEPS):
            self._evaluate(motion, x)

    def _evaluate(
        self, motion: tuple[Joints, Joints, Joints], x: Parameters
    ) -> tuple[Joints, Float[np.ndarray, "joint parameter"], float]:
        """Torque, its derivative, and largest remaining gradient of the cuff energy [N·m]; updates posture and load."""
        for memory, values in zip(self._inputs, (*motion, self._z, x), strict=True):
            memory[:] = values
        self._kernel.evaluate()
        tau, derivative, self._z[:], self._G[:], slope, self._by_moved[:], self._stretch[:] = self._outputs
        return tau.copy(), derivative.copy(), float(np.abs(slope).max())

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m]: the whole Coulomb torque at rest, zero in clear motion.

        It is `SINGULAR_SD` if the last sample was near a singular posture or its closure did not converge.
        """
        if self._is_lost:
            return np.full(self.n_joints, SINGULAR_SD)
        singular = float((np.cos(self._z[self._abductions]) ** 2).min()) < NEAR_SINGULAR
        return self._coulomb / np.cosh(v / SLOW_V) ** 2 + singular * SINGULAR_SD

    def end_stop_uncertainty(self) -> Joints:
        """Return the standard deviation of the torque (joint,) by the arm's end stops in the last sample [N·m]."""
        z = self._z[self._stopped]
        inside = np.maximum(np.minimum(z - self._ends[0], self._ends[1] - z), 0.0)
        return np.abs(self._G[self._stopped]).T @ (END_STOP_NM * np.exp(-inside / np.deg2rad(END_STOP_DEG)))


def _torque_and_derivative(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    n, freedoms, layout = assembly.n, assembly.n_freedoms, ParameterLayout.of(assembly)
    q, v, a = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n)
    z_before, x = ca.SX.sym("z_before", freedoms), ca.SX.sym("x", layout.count)
    moved = ca.SX.sym("moved", 3, len(assembly.cuffs))
    cuffs = cuff_energy(assembly, moved)
    fit = x[layout.fit]
    arm = ArmExpression(x[layout.phi], fit, x[layout.stiffness], x[layout.spring_offset], x[layout.damping])
    z = ca.SX.sym("z", freedoms)
    closed = closure(cuffs, q, z, fit, static_load(assembly, arm, z, machine.gravity))
    load = arm_load(assembly, arm, cuffs, closed, (q, v, a), machine.gravity)
    carried = (
        exo_torque(assembly, machine.phi, x[layout.rotor], (q, v, a), machine.gravity)
        + closed.G.T @ load
        + closed.strain
    )
    friction = replace(machine.friction, coulomb=x[layout.coulomb], viscous=x[layout.viscous])
    tau = carried + friction_torque(friction, v, carried)
    # Implicit differentiation: the posture keeps the gradient zero. Cheaper than a derivative of the Newton step.
    unknown = ca.vertcat(x, ca.vec(moved))
    z_by_unknown, _ = solve_symmetric(closed.H, -ca.jacobian(closed.slope, unknown), PIVOT_MIN)
    by_both = ca.jacobian(tau, ca.vertcat(unknown, z))
    derivative = by_both[:, : unknown.numel()] + by_both[:, unknown.numel() :] @ z_by_unknown
    results = [tau, derivative[:, : x.numel()], closed.z, closed.G, closed.slope]
    results += [derivative[:, x.numel() :], ca.vec(closed.stretch)]
    at = ca.Function("at", [q, v, a, z, x, moved], results)
    # One Newton step is enough: the warm start is nearly closed.
    z_closed = newton_step(cuffs, q, z_before, fit, static_load(assembly, arm, z_before, machine.gravity))
    inputs = [q, v, a, z_before, x]
    displaced = ca.Function("displaced", [*inputs, moved], at.call([q, v, a, z_closed, x, moved]))
    names = ["q", "v", "a", "z_before", "x"], ["tau", "derivative", "z", "G", "slope", "by_moved", "stretch"]
    return ca.Function("torque_and_derivative", inputs, displaced.call([*inputs, ca.SX.zeros(*moved.shape)]), *names)
