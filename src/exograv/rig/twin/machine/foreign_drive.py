"""Drives of a foreign world: other friction, further ripple, a gain that drifts, and gears with hysteresis.

The friction of a machine is one of two laws. Generalised Maxwell slip: elements in parallel, each a spring that sticks
until it reaches its share of the sliding friction, and then slides; its memory of reversals is not local. Dahl: the
friction approaches its level exponentially with the travel, and does not depend on speed; the level has a map of wear.

Source: Lampaert, Al-Bender & Swevers (2003), Proc. ECC; Dahl (1976), AIAA J 14(12); forms unverified.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.streams import stream

ELEMENTS = 4
"""Number of elements of the Maxwell slip. Assumed."""

TRAVELS = np.array([0.4, 0.8, 1.6, 3.2])
"""Travel at which each element begins to slide, over the bristles' travel at home. Assumed [-]."""

SLIP_TIME = 0.005
"""Time constant with which a sliding element reaches its share of the sliding friction. Assumed [s]."""

WEAR_MAX = 0.25
"""Largest deviation of the worn friction level over the range of a joint. Assumed [-]."""

RIPPLE_SHARE = (0.02, 0.06)
"""Range of the amplitude of each further harmonic, over Coulomb friction. Assumed [-]."""

RIPPLE_ORDERS = (2.0, 4.0)
"""Further harmonics of one turn of the motor: the wave generator of a harmonic drive meets the splines twice a turn."""

GAIN_BY_ANGLE = 0.02
"""Amplitude of the gain's ripple along the joint's angle, relative to the mean gain [-]."""

GAIN_BY_HEAT = 0.03
"""Share by which the gain falls in ten minutes of load [-]."""

LOAD_SPAN = 600.0
"""Time of load after which the gain has fallen by `GAIN_BY_HEAT` [s]."""

HEAT_TIME = 200.0
"""Time constant of the motor's temperature. Assumed [s]."""

LOADED = 0.25
"""Smallest share of its largest torque at which a motor counts as fully loaded. Assumed [-]."""

ARC_MINUTE = np.deg2rad(1.0 / 60.0)
HYSTERESIS_STEEPNESS = 2.0
"""Stiffness of the hysteretic part of a gear over its torsional stiffness. Assumed [-]."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class ForeignDrives:
    """Laws of the drives in a foreign world, one entry per joint."""

    is_maxwell: bool
    """True if friction is generalised Maxwell slip, False if it is Dahl's law with a map of wear."""

    wear: Float[np.ndarray, "joint 2"]
    """Amplitudes of the map of wear, over the friction level, once and twice per turn of the joint [-]."""

    wear_phase: Float[np.ndarray, "joint 2"]
    """Phases of the map of wear [rad]."""

    ripple: Float[np.ndarray, "joint 2"]
    """Amplitude of each further harmonic of the friction ripple, over Coulomb friction [-]."""

    ripple_phase: Float[np.ndarray, "joint 2"]
    """Phases of the further harmonics [rad]."""

    gain_turns: Joints
    """Periods of the gain's ripple per turn of the joint [-]."""

    gain_phase: Joints
    """Phase of the gain's ripple [rad]."""

    hysteresis: Joints
    """Width of the gears' hysteresis [rad]."""

    def further_ripple(self, joint: int, motor_angle: ca.SX) -> ca.SX:
        """Friction ripple over Coulomb friction at an angle of the motor [rad], beside the home world's harmonic."""
        parts = zip(RIPPLE_ORDERS, self.ripple[joint].tolist(), self.ripple_phase[joint].tolist(), strict=True)
        return ca.sum1(ca.vertcat(*(size * ca.sin(order * motor_angle + phase) for order, size, phase in parts)))

    def worn(self, joint: int, theta: ca.SX) -> ca.SX:
        """Friction level over the unworn one at an angle of the joint [rad]."""
        parts = zip((1.0, 2.0), self.wear[joint].tolist(), self.wear_phase[joint].tolist(), strict=True)
        return 1.0 + ca.sum1(ca.vertcat(*(size * ca.sin(order * theta + phase) for order, size, phase in parts)))

    def gain_at(self, q: Float[np.ndarray, "*posture joint"]) -> Float[np.ndarray, "*posture joint"]:
        """Gain of the cold motors over their mean gain, at joint positions [rad]."""
        return 1.0 + GAIN_BY_ANGLE * np.sin(self.gain_turns * q + self.gain_phase)

    def gain(self, joint: int, q: ca.SX, heat: ca.SX) -> ca.SX:
        """Gain of a motor over its mean gain when cold, at a joint position [rad] and with a `heat` [-]."""
        by_angle = 1.0 + GAIN_BY_ANGLE * ca.sin(float(self.gain_turns[joint]) * q + float(self.gain_phase[joint]))
        return by_angle * (1.0 - GAIN_BY_HEAT / (1.0 - np.exp(-LOAD_SPAN / HEAT_TIME)) * heat)


@dataclass(frozen=True)
class ForeignStep:
    """Torque of a law and its state one step later."""

    tau: ca.SX
    """Torque [N·m] of the law, with the sign of the motion that it opposes."""

    next: ca.SX
    """Next state."""


def draw_foreign_drives(seed: int, joints: int) -> ForeignDrives:
    """Draw the laws of one machine's drives. The draws do not depend on the level."""
    friction, ripple, gain, gear = (
        stream(seed, "machine", f"world drives {part}") for part in ("friction", "ripple", "gain", "gear")
    )
    is_maxwell = bool(friction.integers(2))
    return ForeignDrives(
        is_maxwell=is_maxwell,
        wear=friction.uniform(0.0, 0.5 * WEAR_MAX, (joints, 2)),
        wear_phase=friction.uniform(-np.pi, np.pi, (joints, 2)),
        ripple=ripple.uniform(*RIPPLE_SHARE, (joints, 2)),
        ripple_phase=ripple.uniform(-np.pi, np.pi, (joints, 2)),
        gain_turns=gain.integers(1, 4, joints).astype(float),
        gain_phase=gain.uniform(-np.pi, np.pi, joints),
        hysteresis=ARC_MINUTE * gear.uniform(0.3, 1.0, joints),
    )


def maxwell_slip(forces: ca.SX, omega: ca.SX, sliding: ca.SX, coulomb: float, travel: float, dt: float) -> ForeignStep:
    """Generalised Maxwell slip over one step.

    Args:
        forces: Torques of the elements (element,) [N·m], the state.
        omega: Speed [rad/s].
        sliding: Magnitude of friction in steady sliding at this speed [N·m].
        coulomb: Coulomb friction, which sets the stiffness of the elements [N·m].
        travel: Travel of the bristles at home [rad].
        dt: Step [s].
    """
    share = 1.0 / ELEMENTS
    stiffness = ca.DM(share * coulomb / (TRAVELS * travel))
    trial = forces + stiffness * omega * dt
    end = share * sliding * ca.sign(omega)
    slides = ca.logic_and(trial * omega > 0.0, ca.fabs(trial) > share * sliding)
    # A sliding element that is below its share reaches it at once; one above, after a faster motion, relaxes to it.
    relaxed = end + (forces - end) * np.exp(-dt / SLIP_TIME)
    above = ca.fabs(forces) > share * sliding
    new = ca.if_else(slides, ca.if_else(ca.logic_and(above, forces * omega > 0.0), relaxed, end), trial)
    return ForeignStep(ca.sum1(new), new)


def dahl(force: ca.SX, omega: ca.SX, level: ca.SX, stiffness: float, dt: float) -> ForeignStep:
    """Dahl's law over one step, from the torque [N·m] that is its state: dF/dx = stiffness · (1 − F/level · sign v)."""
    end = level * ca.sign(omega)
    new = end + (force - end) * ca.exp(-stiffness * ca.fabs(omega) * dt / level)
    return ForeignStep(new, new)


def gear_hysteresis(torque: ca.SX, turn_rate: ca.SX, stiffness: float, width: float, dt: float) -> ForeignStep:
    """Hysteretic torque of a gear beside its spring: an elastic element that slides.

    Args:
        torque: Present hysteretic torque [N·m], the state.
        turn_rate: Speed of the gear's wind-up [rad/s].
        stiffness: Torsional stiffness of the gear [N·m/rad].
        width: Width of the hysteresis, in wind-up at equal torque [rad].
        dt: Step [s].
    """
    largest = 0.5 * width * stiffness
    new = ca.fmin(ca.fmax(torque + HYSTERESIS_STEEPNESS * stiffness * turn_rate * dt, -largest), largest)
    return ForeignStep(new, new)


def heated(heat: ca.SX, tau: ca.SX, torque_max: float, dt: float) -> ca.SX:
    """Heat of a motor [-] one step later: 0 cold, 1 after a long full load."""
    if torque_max == 0.0:
        return heat
    load = ca.fmin((tau / (LOADED * torque_max)) ** 2, 1.0)
    return heat + (load - heat) * (1.0 - np.exp(-dt / HEAT_TIME))
