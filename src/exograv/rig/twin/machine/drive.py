"""Drives of the twin: torque lag, gear spring, rotor, and friction with true sticking on the motor's side of the gear.

Friction is LuGre's bristle law with an elastic zone in which a bristle does not slip, so that a stuck joint does not
creep. The bristle follows its exact exponential over a step, because the explicit form can diverge at 0.5 ms.

Source: Canudas de Wit et al. (1995), IEEE TAC 40(3); Dupont et al. (2002), IEEE TAC 47(5), for the elastic zone;
exponent 1.3 and load-dependent Coulomb friction after Bittencourt & Gunnarsson (2012), form unverified.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from .foreign_drive import ELEMENTS, ForeignDrives, ForeignStep, dahl, gear_hysteresis, heated, maxwell_slip
from .machine import Machine

STRIBECK_EXPONENT = 1.3
BRISTLE_TRAVEL = 3.0e-4
"""Deflection at which a bristle reaches Coulomb friction: a few encoder steps. Assumed [rad]."""

ELASTIC_SHARE = 0.7
"""Share of that deflection within which no bristle slips. Assumed [-]."""

BRISTLE_DAMPING_RATIO = 0.3
"""Damping ratio of the rotor on its bristles, where passivity allows as much. Assumed [-]."""

GEAR_DAMPING_RATIO = 0.02
"""Damping ratio of the rotor on its gear, which is metal. Assumed [-]."""

FRICTION_FLOOR = 0.1
"""Smallest share of Coulomb friction that is left where ripple lowers it [-]."""

SLOWEST = 1e-2
"""Speed below which viscous friction is proportional to the speed, whatever its power [rad/s].

At a lower one the slope of a small power would be too steep for the time step.
"""

DRIVE_STATES = ("bristle", "theta", "omega", "tau_motor")
"""Bristle deflection [rad]; position [rad] and speed [rad/s] of a rotor behind its gear; motor torque [N·m]."""

THETA, OMEGA, TAU_MOTOR = (DRIVE_STATES.index(name) for name in ("theta", "omega", "tau_motor"))


FOREIGN_STATES = ELEMENTS + 2
"""Number of states of a drive in a foreign world: torques of the friction's elements [N·m], heat [-], torque of the
gear's hysteresis [N·m]."""


@dataclass(frozen=True)
class FrictionState:
    """Quantities on which friction depends at one instant."""

    theta: ca.SX
    """Position on the motor's side of the gear, as angle of the joint [rad]."""

    omega: ca.SX
    """Speed on the motor's side of the gear [rad/s]."""

    load: ca.SX
    """Torque through the gear [N·m]."""

    warmth: ca.SX
    """Warm-up of the drive: 0 cold, 1 after a long run [-]."""


@dataclass(frozen=True)
class DriveInput:
    """Inputs of a drive at one instant."""

    tau_asked: ca.SX
    """Torque at the joint that the current asks of the motor [N·m]."""

    q: ca.SX
    """Position of the joint [rad]."""

    v: ca.SX
    """Velocity of the joint [rad/s]."""

    warmth: ca.SX
    """Warm-up of the drive: 0 cold, 1 after a long run [-]."""

    damping: ca.SX
    """Coefficient with which the drive brakes its motor, from the encoder on the motor's shaft [N·m·s/rad]."""


@dataclass(frozen=True)
class DriveStep:
    """Result of one step of one drive."""

    tau_joint: ca.SX
    """Torque that the drive applies to the joint [N·m]."""

    state_next: ca.SX
    """Next state, in the order of `DRIVE_STATES`."""

    foreign_next: ca.SX | None = None
    """Next state of the laws of a foreign world, in the order of `FOREIGN_STATES`."""


def drive_step(machine: Machine, joint: int, state: ca.SX, now: DriveInput, dt: float) -> DriveStep:
    """Advance the drive of a joint by `dt` [s] from a state in the order of `DRIVE_STATES`; laws of the home world."""
    drives = machine.drives
    bristle, theta, omega, tau_motor = ca.vertsplit(state)
    stiffness, inertia = drives.gear_stiffness[joint], drives.rotor_inertia[joint]
    tau_motor = _motor_torque(machine, joint, tau_motor, omega, now, dt)
    if np.isinf(stiffness):
        rubbed, bristle = friction_step(machine, joint, bristle, FrictionState(now.q, now.v, tau_motor, now.warmth), dt)
        return DriveStep(tau_motor - rubbed, ca.vertcat(bristle, now.q, now.v, tau_motor))
    damping = 2.0 * GEAR_DAMPING_RATIO * np.sqrt(stiffness * inertia)
    tau_gear = stiffness * (theta - now.q) + damping * (omega - now.v)
    rubbed, bristle = friction_step(machine, joint, bristle, FrictionState(theta, omega, tau_gear, now.warmth), dt)
    omega = omega + dt / inertia * (tau_motor - rubbed - tau_gear)
    return DriveStep(tau_gear, ca.vertcat(bristle, theta + dt * omega, omega, tau_motor))


def foreign_drive_step(
    machine: Machine, laws: ForeignDrives, joint: int, states: tuple[ca.SX, ca.SX], now: DriveInput, dt: float
) -> DriveStep:
    """Advance the drive of a joint by `dt` [s] by the laws of a foreign world.

    The torque of a motor is its current's torque at the mean gain, as sensors see it, times a gain that they do not
    see. `states` are the state in the order of `DRIVE_STATES` and that in the order of `FOREIGN_STATES`.
    """
    drives, (state, foreign) = machine.drives, states
    bristle, theta, omega, tau_motor = ca.vertsplit(state)
    forces, heat, hysteresis = ca.vertsplit(foreign, [0, ELEMENTS, ELEMENTS + 1, ELEMENTS + 2])
    stiffness, inertia = drives.gear_stiffness[joint], drives.rotor_inertia[joint]
    tau_motor = _motor_torque(machine, joint, tau_motor, omega, now, dt)
    tau_shaft = laws.gain(joint, now.q, heat) * tau_motor
    warmer = heated(heat, tau_motor, float(drives.torque_max[joint]), dt)
    if np.isinf(stiffness):
        rubbed = foreign_friction(machine, laws, joint, forces, FrictionState(now.q, now.v, tau_shaft, now.warmth), dt)
        return DriveStep(
            tau_shaft - rubbed.tau,
            ca.vertcat(bristle, now.q, now.v, tau_motor),
            ca.vertcat(rubbed.next, warmer, hysteresis),
        )
    damping = 2.0 * GEAR_DAMPING_RATIO * np.sqrt(stiffness * inertia)
    lost = gear_hysteresis(hysteresis, omega - now.v, float(stiffness), float(laws.hysteresis[joint]), dt)
    tau_gear = stiffness * (theta - now.q) + damping * (omega - now.v) + lost.tau
    rubbed = foreign_friction(machine, laws, joint, forces, FrictionState(theta, omega, tau_gear, now.warmth), dt)
    omega = omega + dt / inertia * (tau_shaft - rubbed.tau - tau_gear)
    return DriveStep(
        tau_gear,
        ca.vertcat(bristle, theta + dt * omega, omega, tau_motor),
        ca.vertcat(rubbed.next, warmer, lost.next),
    )


def _motor_torque(machine: Machine, joint: int, before: ca.SX, omega: ca.SX, now: DriveInput, dt: float) -> ca.SX:
    """Return the torque of a motor one step later, from the torque `before` [N·m] and the motor's speed [rad/s]."""
    drives = machine.drives
    # The drive brakes by the encoder on the motor's own shaft and through the same current loop, so within the same
    # torque limit.
    brake = now.damping * (now.v if np.isinf(drives.gear_stiffness[joint]) else omega)
    asked = ca.fmin(ca.fmax(now.tau_asked - brake, -drives.torque_max[joint]), drives.torque_max[joint])
    # exp(-inf) is zero: a motor without lag reaches its new torque at once.
    return asked + (before - asked) * np.exp(-2.0 * np.pi * drives.bandwidth[joint] * dt)


def foreign_friction(
    machine: Machine, laws: ForeignDrives, joint: int, forces: ca.SX, now: FrictionState, dt: float
) -> ForeignStep:
    """Torque that friction takes from the motion by the law of a foreign world, and its next state (element,)."""
    friction = machine.friction
    coulomb = float(friction.coulomb[joint])
    viscous = _viscous_friction(machine, joint, now)
    if coulomb == 0.0:
        return ForeignStep(viscous, forces)
    further = coulomb * laws.further_ripple(joint, machine.drives.gear_ratio[joint] * now.theta)
    if machine.drives.gain[joint] == 0.0:
        further = 0.0  # a joint without motor has a bearing and no gear
    if laws.is_maxwell:
        sliding = sliding_friction(machine, joint, now, further)
        step = maxwell_slip(forces, now.omega, sliding, coulomb, BRISTLE_TRAVEL, dt)
        return ForeignStep(step.tau + viscous, step.next)
    level = laws.worn(joint, now.theta) * friction_level(machine, joint, now, further)
    step = dahl(forces[0], now.omega, level, coulomb / BRISTLE_TRAVEL, dt)
    return ForeignStep(step.tau + viscous, ca.vertcat(step.next, forces[1:]))


def friction_step(machine: Machine, joint: int, bristle: ca.SX, now: FrictionState, dt: float) -> tuple[ca.SX, ca.SX]:
    """Torque [N·m] that friction takes from the motion, with its sign, and the new bristle deflection [rad]."""
    friction = machine.friction
    viscous = _viscous_friction(machine, joint, now)
    if friction.coulomb[joint] == 0.0:
        return viscous, bristle
    stiffness, damping = bristle_law(machine, joint)
    limit = sliding_friction(machine, joint, now) / stiffness
    slip = _slip_share(bristle, limit, now.omega, friction.coulomb[joint] / stiffness)
    decay = slip * ca.fabs(now.omega) / limit * dt
    # Mean of the exponential over the step, (1 − exp(−x))/x, which is 1 − x/2 near zero.
    mean = ca.if_else(decay < 1e-6, 1.0 - 0.5 * decay, (1.0 - ca.exp(-decay)) / ca.fmax(decay, 1e-6))
    bristle_next = bristle * ca.exp(-decay) + now.omega * dt * mean
    return stiffness * bristle_next + damping * (bristle_next - bristle) / dt + viscous, bristle_next


def _viscous_friction(machine: Machine, joint: int, now: FrictionState) -> ca.SX:
    """Friction that grows with speed, with the sign of the speed [N·m]."""
    friction = machine.friction
    viscous = friction.viscous[joint] * (1.0 - friction.warm_up[joint] * now.warmth) * now.omega
    if friction.viscous_power is None or friction.viscous_power[joint] == 1.0:
        return viscous
    return viscous * ca.fmax(ca.fabs(now.omega), SLOWEST) ** (friction.viscous_power[joint] - 1.0)


def sliding_friction(machine: Machine, joint: int, now: FrictionState, further: ca.SX | float = 0.0) -> ca.SX:
    """Magnitude of friction without its viscous part, in steady sliding [N·m]; `further` [N·m] adds to its ripple."""
    friction, level = machine.friction, friction_level(machine, joint, now, further)
    rest = ca.exp(-((ca.fabs(now.omega) / friction.stribeck_velocity[joint]) ** STRIBECK_EXPONENT))
    return level * (1.0 + (friction.breakaway[joint] - 1.0) * rest)


def friction_level(machine: Machine, joint: int, now: FrictionState, further: ca.SX | float = 0.0) -> ca.SX:
    """Magnitude of friction in fast sliding, without its viscous part [N·m]; `further` [N·m] adds to its ripple."""
    friction, turns = machine.friction, machine.drives.gear_ratio[joint]
    coulomb = friction.coulomb[joint]
    ripple = friction.ripple[joint] * ca.sin(turns * now.theta + friction.ripple_phase[joint])
    level = coulomb * (1.0 - friction.warm_up[joint] * now.warmth)
    level = level * (1.0 + friction.asymmetry[joint] * ca.sign(now.omega))
    return ca.fmax(level + friction.load_share[joint] * ca.fabs(now.load) + ripple + further, FRICTION_FLOOR * coulomb)


def bristle_law(machine: Machine, joint: int) -> tuple[float, float]:
    """Stiffness [N·m/rad] and damping [N·m·s/rad] of the bristles.

    The damping is limited so that the law stays passive: viscous friction must exceed damping times (breakaway − 1).
    Source: Barabanov & Ortega (2000), IEEE TAC 45(4).
    """
    friction = machine.friction
    stiffness = friction.coulomb[joint] / BRISTLE_TRAVEL
    damping = 2.0 * BRISTLE_DAMPING_RATIO * np.sqrt(stiffness * machine.drives.rotor_inertia[joint])
    excess = friction.breakaway[joint] - 1.0
    viscous_least = friction.viscous[joint] * (1.0 - friction.warm_up[joint])
    return stiffness, min(damping, 0.9 * viscous_least / excess) if excess > 0.0 else damping


def _slip_share(bristle: ca.SX, limit: ca.SX, omega: ca.SX, coulomb_travel: float) -> ca.SX:
    """Share of slip: 0 while the bristle only bends, 1 while it slides, 0 on the way back."""
    start = ELASTIC_SHARE * ca.fmin(coulomb_travel, limit)
    position = ca.fmin(ca.fmax((ca.fabs(bristle) - start) / ca.fmax(limit - start, 1e-12), 0.0), 1.0)
    return ca.if_else(bristle * omega > 0.0, 0.5 - 0.5 * ca.cos(np.pi * position), 0.0)
