"""Laws that return friction without a torque sensor, for one joint: candidates of friction_compensation.py."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from exograv.control.returned_friction import CERTAINTY, SHARE, TRAVEL, WARMED, least_friction, returned_friction
from exograv.dynamics.friction import Friction, friction_torque

V_OFF, V_FULL = 0.05, 0.10  # rad/s, of the laws by speed
LEAD_S = 0.015  # of the velocity: about the lag of observer, delay and motor
DITHER_Hz = 50.0  # as AGREE's
FINEST_TRAVEL = 3e-4  # rad; what the twin's bristles take


@dataclass(frozen=True)
class Known:
    """One joint by its calibration; every array has one entry."""

    friction: Friction
    friction_sd: Friction
    rotor_inertia: float
    """[kg·m²]"""

    link_inertia: float
    """Of the machine's link [kg·m²]."""

    arm_inertia: float
    """[kg·m²]"""


@dataclass(frozen=True)
class Seen:
    """What a law sees in one period."""

    q: ca.SX
    """By the observer [rad]."""

    way: ca.SX
    """Since the period before [rad]."""

    v: ca.SX
    """By the observer [rad/s]."""

    load: ca.SX
    """Through the gear [N·m]."""

    dt: float
    """[s]"""


Law = Callable[[Known, Seen, ca.SX], tuple[ca.SX, ca.SX]]
"""Torque [N·m] and next state, from what is known, what is seen, and the state."""


@dataclass(frozen=True)
class Candidate:
    """A law with so many numbers of state."""

    law: Law
    states: int = 1


def nothing(_known: Known, _seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Friction stays as it is."""
    return ca.SX(0), state


def by_speed(share: float) -> Candidate:
    """A share of Coulomb and viscous friction along the speed; none below `V_OFF`, all from `V_FULL`."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        s = ca.fmin(ca.fmax((ca.fabs(seen.v) - V_OFF) / (V_FULL - V_OFF), 0), 1)
        whole = float(known.friction.coulomb[0]) * ca.sign(seen.v) + float(known.friction.viscous[0]) * seen.v
        return share * (3 * s**2 - 2 * s**3) * whole, state

    return Candidate(law)


def by_smooth_sign(lead_s: float = 0.0) -> Candidate:
    """Share of the whole calibrated law, with its smooth sign, of the observed velocity or of one that leads it."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        v_before, a = state[0], state[1]
        a += 0.1 * ((seen.v - v_before) / seen.dt - a)
        return SHARE * WARMED * friction_torque(known.friction, seen.v + lead_s * a, seen.load), ca.vertcat(seen.v, a)

    return Candidate(law, 2)


def by_bristles(travel: float) -> Candidate:
    """Share of the whole calibrated law with a Dahl bristle in place of its sign: stiff as friction itself is."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        decay = ca.exp(-ca.fabs(seen.way) / travel)
        bristle = state * decay + ca.sign(seen.way) * (1 - decay)
        friction = known.friction
        rest = ca.exp(-(ca.fabs(seen.v / float(friction.v_stribeck[0])) ** 1.3))
        coulomb = float(friction.coulomb[0]) * (1 + (float(friction.breakaway[0]) - 1) * rest)
        size = coulomb + float(friction.load_share[0]) * ca.fabs(seen.load)
        return SHARE * WARMED * (size * bristle + float(friction.viscous[0]) * seen.v), bristle

    return Candidate(law)


def by_spring(travel_factor: float = 1.0, leak_s: float = np.inf) -> Candidate:
    """The law of `control`, with another travel, or with a spring that forgets."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        friction = replace(known.friction, coulomb=ca.SX(known.friction.coulomb), viscous=ca.SX(known.friction.viscous))
        spring = state * np.exp(-seen.dt / leak_s)
        now = returned_friction(friction, known.friction_sd, seen.load, seen.way / travel_factor, seen.v, spring)
        return now.tau, now.spring

    return Candidate(law)


def by_spring_with_breakaway(ceiling: float = 0.95) -> Candidate:
    """The law of `control`, slipping near rest at its share of the breakaway torque; at most so much of the least."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        friction, sd = known.friction, known.friction_sd
        excess = max(float(friction.breakaway[0] - 1 - CERTAINTY * sd.breakaway[0]), 0.0)
        rest = ca.exp(-(ca.fabs(seen.v / float(friction.v_stribeck[0])) ** 1.3))
        share = ca.fmin(SHARE * (1 + excess * rest), ceiling)
        symbolic = replace(friction, coulomb=ca.SX(friction.coulomb))
        forward, backward = least_friction(symbolic, sd, seen.load)
        spring = state + float(friction.coulomb[0]) / TRAVEL * seen.way
        spring = ca.fmin(ca.fmax(spring, -share * backward), share * forward)
        viscous = WARMED * float(friction.viscous[0]) - CERTAINTY * float(sd.viscous[0])
        return spring + SHARE * viscous * seen.v, spring

    return Candidate(law)


def with_dither(base: Candidate, amplitude: float) -> Candidate:
    """Beside it a sine of so many times Coulomb friction."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        tau, rest = base.law(known, seen, state[1:])
        phase = state[0] + 2 * np.pi * DITHER_Hz * seen.dt
        return tau + amplitude * float(known.friction.coulomb[0]) * ca.sin(phase), ca.vertcat(phase, rest)

    return Candidate(law, 1 + base.states)


def with_inertia(base: Candidate, share: float, bandwidth_Hz: float = 10.0) -> Candidate:
    """Beside it a share of the machine's own inertia, by the acceleration behind a filter of first order."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        tau, rest = base.law(known, seen, state[2:])
        a = state[1] + (1 - np.exp(-2 * np.pi * bandwidth_Hz * seen.dt)) * ((seen.v - state[0]) / seen.dt - state[1])
        return tau + share * (known.rotor_inertia + known.link_inertia) * a, ca.vertcat(seen.v, a, rest)

    return Candidate(law, 2 + base.states)


def with_bounded_inertia(share: float, bandwidth_Hz: float = 10.0) -> Candidate:
    """The same, but spring and inertia together never give more than the spring alone may."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        friction = replace(known.friction, coulomb=ca.SX(known.friction.coulomb), viscous=ca.SX(known.friction.viscous))
        now = returned_friction(friction, known.friction_sd, seen.load, seen.way, seen.v, state[2])
        a = state[1] + (1 - np.exp(-2 * np.pi * bandwidth_Hz * seen.dt)) * ((seen.v - state[0]) / seen.dt - state[1])
        forward, backward = least_friction(friction, known.friction_sd, seen.load)
        both = now.spring + share * (known.rotor_inertia + known.link_inertia) * a
        both = ca.fmin(ca.fmax(both, -SHARE * backward), SHARE * forward)
        return now.tau - now.spring + both, ca.vertcat(seen.v, a, now.spring)

    return Candidate(law, 3)


def by_momentum(gain: float, bandwidth_Hz: float = 8.0) -> Candidate:
    """So many times the hand's torque as a momentum observer sees it, never more than the least friction allows."""

    def law(known: Known, seen: Seen, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        hand, integral, tau_before = state[0], state[1], state[2]
        inertia = known.rotor_inertia + known.link_inertia + known.arm_inertia
        integral += seen.dt * (tau_before - friction_torque(known.friction, seen.v, seen.load) + hand)
        hand = 2 * np.pi * bandwidth_Hz * (inertia * seen.v - integral)
        friction = replace(known.friction, coulomb=ca.SX(known.friction.coulomb))
        forward, backward = least_friction(friction, known.friction_sd, seen.load)
        tau = ca.fmin(ca.fmax(gain * hand, -SHARE * backward), SHARE * forward)
        return tau, ca.vertcat(hand, integral, tau)

    return Candidate(law, 3)


KEPT = "slipping spring (kept)"
CANDIDATES: Mapping[str, Candidate] = {
    "nothing": Candidate(nothing),
    "by speed 0.5": by_speed(0.5),
    "by speed 0.8": by_speed(SHARE),
    "smooth sign": by_smooth_sign(),
    "smooth sign + lead": by_smooth_sign(LEAD_S),
    "Dahl bristle": by_bristles(FINEST_TRAVEL),
    KEPT: by_spring(),
    "spring travel x 0.5": by_spring(0.5),
    "spring travel x 2": by_spring(2.0),
    "spring leak 0.5 s": by_spring(leak_s=0.5),
    "spring + breakaway": by_spring_with_breakaway(),
    "dither alone 1.5": with_dither(Candidate(nothing), 1.5),
    "kept + dither 0.4": with_dither(by_spring(), 0.4),
    "kept + inertia 0.5": with_inertia(by_spring(), 0.5),
    "bounded inertia 0.5": with_bounded_inertia(0.5),
    "momentum x 3": by_momentum(3.0),
}
