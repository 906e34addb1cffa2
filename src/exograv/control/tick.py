"""Control law of one tick: desired motor torque from joint positions and velocities, in one compiled kernel."""

import copy
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.closure import PIVOT_MIN, closure, cuff_energy, newton_step
from exograv.dynamics.friction import friction_torque
from exograv.dynamics.loop_torque import ArmExpression, LoopTorque, arm_load, exo_torque, static_load
from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.model.assembly import Assembly
from exograv.model.loops import TWIST_COSINE_MIN, LoopSolver, away_from_singular, clearance
from exograv.signals import Reference

from .handover import Handover
from .native_law import NativeLaw
from .returned_friction import returned_friction

Joints = Float[np.ndarray, " joint"]
Freedoms = Float[np.ndarray, " freedom"]

NEWTON_STEPS = 5
"""Newton steps from the posture of the cuffs alone to the posture under load; convergence is quadratic."""

SETTLED_SLOPE = 1e-9
"""Remaining gradient at which further Newton steps change nothing [N·m]."""

SLOPE_MAX = 1e-6
"""Largest remaining gradient of the cuff energy at which loops at rest count as closed [N·m]."""

HELD_COSINE, TURNED_COSINE = 0.86, 0.7
"""Cosines of the rotation of the most turned cuff [-]. Up to 31° the arm's identified elasticity is carried in full.
Above 46° a cuff resists no further rotation, and no elasticity is carried."""

HELD_TICKS = 20
"""Time constant with which the carried elasticity follows the cuff rotation [ticks]. An immediate change would move the
posture that it depends on."""

FAR_RAD_S, FAR_DAMPING_S = 0.3, 0.1
"""Difference from the reference velocity beyond which the weak feedback damps more [rad/s], and the least damping
there, as a share of the stiffness [s]. Tuned on bursts of 6 N·m at the elbow of quasi-direct drives (level 2, seeds
1000-1003): 4 of 12 flights were stopped before, and none with these; a damping from 0.5 rad/s on was too late."""


@dataclass
class ControlMode:
    """Mode of the control law; changed between ticks."""

    drive: float = 0.0
    """Drive factor [-]: 1 follows the reference with inertial feed-forward and weak PD; 0 carries the weight only."""

    gravity_level: float = 0.0
    """Fraction of the arm's own weight that the wearer feels [-]: 0 weightless, 1 Earth."""

    arm_share: float = 1.0
    """Share of the arm that the machine carries [-]: 0 carries the exoskeleton alone. It is ramped, never stepped."""


class Tick:
    """Control law of an arm in a machine. Memory is fixed; `step` allocates only the arrays that NumPy returns."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        self.assembly = assembly
        # The posture of this tick is the warm start of the next one.
        carry = {"q_before": "q", "z_before": "z", "G_before": "G", "spring_before": "spring", "held_before": "held"}
        self._solver, self._layout = LoopSolver(assembly), ParameterLayout.of(assembly)
        self._start(kernel.compile(kernel.Recipe(tick_function, (assembly, machine)), carry=carry))
        self.n_instructions = self._kernel.n_instructions

    def again(self) -> "Tick":
        """Return a second controller with its own posture and mode; it shares the compiled code."""
        other = copy.copy(self)
        other._start(self._kernel.again())
        return other

    def _start(self, compiled: kernel.Kernel) -> None:
        self.mode = ControlMode()
        buffers = compiled.inputs
        buffers["payload"][:], buffers["led"][:] = 0.0, 1.0
        self.payload = buffers["payload"]
        """Payload of the arm, as a change of its inertial parameters (phi,); written between ticks. The machine carries
        it in full at every gravity level."""
        self.led = buffers["led"]
        """Share of `mode.drive` for each arm (limb,); written between ticks. An arm that leads the other arm has zero
        and floats."""
        self._kernel = compiled
        self._in, self._out, self._evaluate = buffers, compiled.outputs, compiled.evaluate
        names = "q", "v", "q_reference", "v_reference", "a_reference", "x"
        self._written = tuple(buffers[name] for name in names)
        self._mode, self._tau_desired = kernel.numbers(buffers["mode"]), compiled.outputs["tau_desired"]
        self._slope, self._clearance = (
            kernel.numbers(compiled.outputs["slope"]),
            kernel.numbers(compiled.outputs["clearance"]),
        )
        self._closed = False

    @property
    def tau_desired(self) -> Joints:
        """Desired motor torque [N·m]."""
        return self._out["tau_desired"]

    @property
    def tau_feedforward(self) -> Joints:
        """Motor torque that the model predicts [N·m]; with friction, without feedback."""
        return self._out["tau_feedforward"]

    @property
    def z(self) -> Freedoms:
        """Freedoms of the arm [rad]."""
        return self._out["z"]

    @property
    def closure_slope(self) -> float:
        """Remaining gradient of the closure, summed over freedoms [N·m]; above `SLOPE_MAX` the loops are not closed."""
        return self._slope[0]

    @property
    def clearance(self) -> float:
        """Distance of the arm from a singular posture (`model.loops.clearance`) [-]; near if below `NEAR_SINGULAR`."""
        return self._clearance[0]

    def step(self, q: Joints, v: Joints, reference: Reference, x: Parameters) -> Joints:
        """Compute the desired torque (joint,) [N·m].

        Args:
            q: Joint positions from the observer [rad].
            v: Joint velocities from the observer [rad/s].
            reference: Reference motion; used if `mode.drive` is not 0.
            x: All parameters, in the order of `dynamics.parameters`.
        """
        in_q, in_v, in_q_reference, in_v_reference, in_a_reference, in_x = self._written
        in_q[:], in_v[:], in_x[:] = q, v, x
        in_q_reference[:], in_v_reference[:], in_a_reference[:] = reference
        mode, wanted = self._mode, self.mode
        mode[0], mode[1], mode[2] = wanted.drive, wanted.gravity_level, wanted.arm_share
        if not self._closed:
            self.close(q, x)
            for _ in range(NEWTON_STEPS):
                self._evaluate()
        self._evaluate()
        return self._tau_desired

    def native_law(self, x: Handover, payload: Handover) -> NativeLaw | None:
        """Return this law for a caller in C, which advances both ramps; None before the first step."""
        if not self._closed or self._kernel.native is None:
            return None
        *motion, in_x = self._written
        ramps = (payload, self.payload), (x, in_x)
        out = self._out
        return NativeLaw(
            self._tau_desired,
            out["tau_feedforward"],
            self._kernel.native,
            tuple(motion),
            self._in["mode"],
            out["slope"],
            ramps,
        )

    def at_rest(self, q: Joints, x: Parameters, z_start: Freedoms) -> tuple[Joints, Joints, Freedoms]:
        """Compute the desired torque at rest at a posture `q`. Use it for planning and checks, not in the loop.

        Args:
            q: Measured joint positions (joint,) [rad].
            x: All parameters, in the order of `dynamics.parameters`.
            z_start: Freedoms of the arm near the closed posture (freedom,) [rad].

        Returns:
            Desired torque, its part for the arm (both (joint,) [N·m]) and the closed posture (freedom,) [rad].
        """
        still = np.zeros(len(q))
        self._start_from(q, z_start)
        reference = Reference(q, still, still)
        self._settle(q, still, reference, x)
        if not self.is_closed:
            # From a distant start Newton's method can end on a saddle of the cuff energy; the cold solver cannot.
            self.close(q, x)
            self._settle(q, still, reference, x)
        return self._out["tau_desired"].copy(), self._out["tau_arm"].copy(), self._out["z"].copy()

    def _settle(self, q: Joints, v: Joints, reference: Reference, x: Parameters) -> None:
        """Make Newton steps until the arm's posture is at its minimum of energy."""
        for _ in range(NEWTON_STEPS):
            self.step(q, v, reference, x)
            if self.closure_slope < SETTLED_SLOPE:
                break

    def forget(self) -> None:
        """Discard the posture: the next step finds the closed posture from a cold start."""
        self._closed = False

    def close(self, q: Joints, x: Parameters) -> None:
        """Find the closed posture from a cold start, outside the loop: at the beginning and after a jump of `q`."""
        self._start_from(q, self._solver.solve(q, fit=x[self._layout.fit])[0])

    @property
    def is_closed(self) -> bool:
        """True if the arm's posture is the minimum of the cuff energy and is held there with enough stiffness."""
        z = self._out["z"]
        untwisted = self._out["cosine"][0] > TWIST_COSINE_MIN and self.assembly.arm.is_reachable(z)
        return bool(self.closure_slope < SLOPE_MAX and self._out["pivot"][0] > PIVOT_MIN and untwisted)

    def _start_from(self, q: Joints, z: Freedoms) -> None:
        self._in["q_before"][:] = q
        self._in["z_before"][:] = z
        self._in["G_before"][:] = 0.0
        self._in["spring_before"][:] = 0.0
        self._in["held_before"][:] = 1.0
        self._closed = True


def tick_function(assembly: Assembly, machine: CalibratedMachine) -> ca.Function:
    """Control law as one CasADi function."""
    n, freedoms, layout = assembly.n, assembly.n_freedoms, ParameterLayout.of(assembly)
    q, v, q_before = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("q_before", n)
    z_before, G_before = ca.SX.sym("z_before", freedoms), ca.SX.sym("G_before", freedoms, n)
    q_reference, v_reference, a_reference = (ca.SX.sym(s, n) for s in ("q_reference", "v_reference", "a_reference"))
    x, mode, spring_before = ca.SX.sym("x", layout.count), ca.SX.sym("mode", 3), ca.SX.sym("spring_before", n)
    gravity_level, arm_share = mode[1], mode[2]
    payload, held_before = ca.SX.sym("payload", layout.phi.stop), ca.SX.sym("held_before")
    led = ca.SX.sym("led", len(assembly.arm.limbs))
    drive, drive_freedom = _drive(assembly, mode[0] * led)

    cuffs = cuff_energy(assembly)
    fit = x[layout.fit]
    predicted = z_before + G_before @ (q - q_before)
    gravity = ca.DM(machine.gravity)
    felt = (1 - gravity_level) * gravity
    arm = ArmExpression(
        arm_share * x[layout.phi] + payload,
        fit,
        x[layout.stiffness],
        x[layout.spring_offset],
        x[layout.damping],
    )
    # The gravity level applies to the arm alone: the machine carries 1 − gravity_level of it, and the whole payload.
    carried = replace(arm, phi=(1 - gravity_level) * arm_share * x[layout.phi] + payload)
    unfelt = replace(arm, phi=gravity_level * payload)
    clear = clearance(assembly.arm, predicted)
    passive_share = drive_freedom * away_from_singular(clear) * held_before
    z = newton_step(cuffs, q, predicted, fit, static_load(assembly, carried, predicted, gravity, passive_share))
    closed = closure(cuffs, q, z, fit, static_load(assembly, carried, z, gravity, passive_share))
    motion = (q, drive * v_reference, drive * a_reference)
    load = arm_load(assembly, arm, cuffs, closed, motion, felt, passive_share)
    load += static_load(assembly, unfelt, z, gravity, 0.0).torque
    torque = LoopTorque(
        exo_torque(assembly, machine.phi, x[layout.rotor], motion, gravity),
        closed.G.T @ load,
        arm_share * closed.strain,
    )
    coulomb, viscous = x[layout.coulomb], x[layout.viscous]
    friction = replace(machine.friction, coulomb=coulomb, viscous=viscous)
    driven_friction = friction_torque(friction, v_reference, torque.total)
    # The spring is reset while the machine is driven, and it starts relaxed. In between, its torque is faded.
    spring = ca.if_else(drive < 1, spring_before, 0)
    returned = returned_friction(friction, machine.friction_sd, torque.total, q - q_before, v, spring)
    tau_feedforward = torque.total + drive * driven_friction + (1 - drive) * returned.tau
    kp = ca.DM(assembly.description.per_actuator("weak_kp_Nm_per_rad"))
    kd = ca.DM(assembly.description.per_actuator("weak_kd_Nms_per_rad"))
    feedback = drive * (kp * (q_reference - q) + weak_damping(kp, kd, v_reference - v))
    names = ["q", "v", "q_reference", "v_reference", "a_reference", "x", "mode"]
    names += ["q_before", "z_before", "G_before", "spring_before", "held_before", "payload", "led"]
    inputs = [q, v, q_reference, v_reference, a_reference, x, mode]
    inputs += [q_before, z_before, G_before, spring_before, held_before, payload, led]
    outputs = {
        "tau_desired": tau_feedforward + feedback,
        "tau_feedforward": tau_feedforward,
        "tau_arm": torque.arm,
        "z": closed.z,
        "G": closed.G,
        "spring": returned.spring,
        "held": held_before + (_held_share(closed.cosine) - held_before) / HELD_TICKS,
        # The sum, not the maximum: CasADi's fmax would hide a NaN.
        "slope": ca.norm_1(closed.slope),
        "pivot": closed.pivot,
        "cosine": closed.cosine,
        "clearance": clear,
    }
    return ca.Function("tick", inputs, list(outputs.values()), names, list(outputs))


def weak_damping(kp: ca.DM, kd: ca.DM, dv: ca.SX) -> ca.SX:
    """Damping torque of the weak feedback (joint,) [N·m].

    A drive with dead time rings with more damping than `kd`, so that its spring throws a joint which the wearer has
    held back. Beyond `FAR_RAD_S` the damping is larger: ringing does not get there.

    Args:
        kp: Stiffness of the feedback (joint,) [N·m/rad].
        kd: Damping of the feedback (joint,) [N·m·s/rad].
        dv: Reference velocity minus velocity (joint,) [rad/s].
    """
    far = dv - ca.fmin(ca.fmax(dv, -FAR_RAD_S), FAR_RAD_S)
    return kd * dv + ca.fmax(FAR_DAMPING_S * kp - kd, 0) * far


def _drive(assembly: Assembly, of_arm: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the drive factor of each joint (joint,) and of each arm freedom (freedom,), from that of each arm (limb,).

    The drive of a joint that moves both arms, as in a torso, is the product of both.
    """
    limbs = assembly.arm.limbs
    joints = []
    for name in assembly.description.joints:
        own = [of_arm[limb.number] for limb in limbs if name.startswith(limb.prefix)]
        joints.append(own[0] if len(own) == 1 else of_arm[0] * of_arm[1])
    return ca.vertcat(*joints), ca.vertcat(*(of_arm[limb.number] for limb in limbs for _ in range(limb.n_freedoms)))


def _held_share(cosine: ca.SX) -> ca.SX:
    """Share of the arm's elasticity that its cuffs can hold, from the cosine of the most turned cuff."""
    s = ca.fmin(ca.fmax((cosine - TURNED_COSINE) / (HELD_COSINE - TURNED_COSINE), 0), 1)
    return 3 * s**2 - 2 * s**3
