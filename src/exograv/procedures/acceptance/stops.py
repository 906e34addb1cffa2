"""Stops on purpose: what each one must cause, and figures of a stop from its recording."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.parameters import ParameterLayout
from exograv.model.assembly import Assembly
from exograv.model.kinematics import frame_pose
from exograv.model.loops import LoopSolver, arm_poses
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason
from exograv.storage.self_test_step import Step, within

StopName = Literal["operator", "hardware", "control", "cable", "push"]

HAND_MAX_M_S = 1.0  # docs/explanation/safety.md, after every stop
REACTION_MS: Mapping[StopName, float] = MappingProxyType({"operator": 50.0, "control": 10.0, "cable": 10.0})
"""Largest time from the cause to the first command of the safe state (docs/explanation/safety.md: F30, F15, F04)."""

MISSED_TICKS = 6
"""Ticks that a slow bus may take instead: three missed ones are bridged, the fourth stops."""

OFF_MAX_MS = 50.0  # docs/explanation/safety.md, F30: no motor torque after a press of the hardware stop
OFF_SHARE, OFF_NM = 0.1, 0.7
"""Torque below which a motor is off, as in a bring-up: share of the torque before, and torque [N·m], the larger."""

TRIP_RAD_S = 5.0
"""Largest joint speed (docs/explanation/safety.md, envelope)."""

TRIP_OVERSHOOT = 0.1  # share: the velocity at the stop is filtered, and one tick old
LETS_GO_S = 0.3
"""Time that a person who pushes a joint needs to let go after the stop [s]. The limit of the hand's speed is for an arm
that nobody pushes (docs/explanation/safety.md)."""

STILL_RAD_S = 0.05
"""Speed below which a joint stands still (docs/explanation/safety.md, brakes)."""

POWERED_MAX_S = 4.0
"""Longest time from the stop to motors without torque (docs/explanation/safety.md: powered descent) [s]."""

STANDS_WITHIN_S = 20.0
"""Time from the stop after which the machine must stand still [s]. A braked arm comes to rest slowly: 20 N·m·s/rad
against 9 N·m/rad of weight have a time constant of 2 s. The hand's speed has a limit of its own."""

LOOK_S = 0.01  # step of the hand's path
WINDOW_S = 0.03  # over which a speed is averaged: the resolution of an encoder is no speed
BEFORE_S = 0.1

Rows = Float[np.ndarray, "tick joint"]


@dataclass(frozen=True)
class PurposeStop:
    """Stop that the acceptance causes."""

    name: StopName
    title: str
    causes: tuple[StopReason, ...]
    """Reasons that the guard may give."""
    asks: str
    """Instruction to the operator of a real machine; empty if the program acts by itself."""


STOPS: tuple[PurposeStop, ...] = (
    PurposeStop("operator", "operator's stop", (StopReason.STOP_PRESSED,), "Press Ctrl-C now."),
    PurposeStop(
        "hardware",
        "hardware stop",
        (StopReason.DRIVE_FAULT, StopReason.TORQUE_WRONG, StopReason.MACHINE_SILENT),
        "Press the hardware stop now.",
    ),
    PurposeStop("control", "control process hangs", (StopReason.CONTROL_SILENT,), ""),
    PurposeStop(
        "cable",
        "bus cable of a drive is pulled",
        (StopReason.MACHINE_SILENT, StopReason.DRIVE_FAULT, StopReason.ENCODER_DEAD, StopReason.TORQUE_WRONG),
        "Pull the bus cable of one drive now.",
    ),
    PurposeStop(
        "push",
        "joint is pushed too fast",
        (StopReason.TOO_FAST, StopReason.PAST_A_STOP, StopReason.TORQUE_WRONG),
        "Push the dummy's forearm away from its path now, faster and faster, until the machine stops. Then let go.",
    ),
)


@dataclass(frozen=True)
class StopFigures:
    """Figures of a stop, from its recording. A figure that was not seen is infinite."""

    reaction_ms: float
    """Time from the cause to the first command of the safe state, or to motors without torque."""
    hand_m_s: float
    """Largest hand speed from the stop on; after a push, from `LETS_GO_S` on."""
    joint_rad_s: float
    """Largest joint speed before the stop."""
    powered_s: float
    """Time from the stop until the flight ends and the drives are switched off."""
    still_s: float
    """Time from the stop until all joints stand still."""
    on_at_end: tuple[str, ...]
    """Joints whose drives are on at the end."""


@dataclass(frozen=True)
class Standing:
    """Machine after a flight, by its drives, until it stands still."""

    t: Float[np.ndarray, " tick"]
    """Time since the watch began [s]."""
    q: Rows
    on: tuple[str, ...]
    """Joints whose drives are on."""


def stop_figures(
    name: StopName,
    ticks: np.ndarray,
    standing: Standing,
    assembly: Assembly,
    brake: Float[np.ndarray, " joint"],
    acted_s: float | None,
) -> StopFigures | None:
    """Return the figures of a stop; None if the recording has no stop.

    Args:
        name: Kind of the stop.
        ticks: Ticks of the recording, fields as in the table of `/tick`.
        standing: Machine after the flight.
        assembly: Machine and arm.
        brake: Damping of each drive without torque [N·m·s/rad].
        acted_s: Time at which the program caused the stop, on CLOCK_MONOTONIC [s]; None if a person did.
    """
    stopped = np.flatnonzero(ticks["safe_state"] >= SafeState.DESCENT + 1)
    if not len(stopped):
        return None
    k, t, q = int(stopped[0]), ticks["now"], ticks["q_measured"]
    seen = t >= t[k] - BEFORE_S
    reacted_s = _off_s(ticks, k, brake) if name == "hardware" else float(t[k]) - _cause_s(name, ticks, k, acted_s)
    hands, since = HandPath(assembly), float(t[k]) + (LETS_GO_S if name == "push" else 0.0)
    return StopFigures(
        reaction_ms=1e3 * reacted_s,
        hand_m_s=max(hands.speed(t[seen], q[seen], since), hands.speed(standing.t, standing.q)),
        joint_rad_s=float(joint_speeds(t, q)[t < t[k]].max(initial=0.0)),
        powered_s=float(t[-1] - t[k]),
        still_s=_still_s(t[k:] - t[k], q[k:], standing),
        on_at_end=standing.on,
    )


def stop_steps(
    stop: PurposeStop, figures: StopFigures | None, cause: str, period_s: float, is_by_person: bool
) -> list[Step]:
    """Return the steps of a stop with their limits.

    Args:
        stop: Stop on purpose.
        figures: Figures of its recording.
        cause: Reason that the guard gave first; empty if it did not stop.
        period_s: Period of the loop [s].
        is_by_person: True if a person caused the stop, so that its time is not known.
    """
    allowed = [reason.value for reason in stop.causes]
    named = Step(
        f"{stop.title}: cause by the guard", cause in allowed, cause or "no stop", " or ".join(allowed), "",
        "" if cause in allowed else "The machine stopped for another reason, or not at all. Read the recording before "
        "you repeat.",
    )  # fmt: skip
    if figures is None:
        return [named]
    steps, late = [named], "The machine reacts too late. No person may be in it."
    if stop.name == "hardware":
        steps.append(within(f"{stop.title}: motors off after", figures.reaction_ms, OFF_MAX_MS, "ms", late))
    elif stop.name == "push":
        limit = TRIP_RAD_S * (1.0 + TRIP_OVERSHOOT)
        steps.append(within(f"{stop.title}: joint speed before", figures.joint_rad_s, limit, "rad/s", late))
    elif not (is_by_person and stop.name == "operator"):  # nobody knows when a person pressed a key
        limit = max(REACTION_MS[stop.name], 1e3 * MISSED_TICKS * period_s)
        steps.append(within(f"{stop.title}: safe state after", figures.reaction_ms, limit, "ms", late))
    falls = "The dummy came down too fast. Check damping and brakes of the drives. No person may be in the machine."
    moves = "The dummy still moves. Check the brakes of the drives, and which motor gives torque."
    return [
        *steps,
        within(f"{stop.title}: hand at most", figures.hand_m_s, HAND_MAX_M_S, "m/s", falls),
        within(f"{stop.title}: powered for", figures.powered_s, POWERED_MAX_S, "s", late),
        within(f"{stop.title}: stands still after", figures.still_s, STANDS_WITHIN_S, "s", moves),
        Step(
            f"{stop.title}: drives at the end", not figures.on_at_end, ", ".join(figures.on_at_end) or "off", "off", "",
            "" if not figures.on_at_end else "A drive is on after the stop. No person may be in the machine.",
        ),
    ]  # fmt: skip


def joint_speeds(t: Float[np.ndarray, " tick"], q: Rows) -> Float[np.ndarray, " tick"]:
    """Return the speed of the fastest joint at each tick, averaged over the last `WINDOW_S` [rad/s]."""
    if len(t) < 2:
        return np.zeros(len(t))
    back = np.searchsorted(t, t - WINDOW_S)
    passed = np.maximum(t - t[back], 1e-9)
    return np.where(back < np.arange(len(t)), np.abs(q - q[back]).max(axis=1) / passed, 0.0)


class HandPath:
    """Path of the hands by the machine's joints and the closed loops, without the sag of the straps."""

    def __init__(self, assembly: Assembly):
        self._solver, self._hands = LoopSolver(assembly), kernel.compile(_hands(assembly))

    def speed(self, t: Float[np.ndarray, " tick"], q: Rows, since: float = -np.inf) -> float:
        """Return the largest speed of the fastest hand since a time [m/s]."""
        times = np.arange(t[0], t[-1], LOOK_S) if len(t) else np.zeros(0)
        step = round(WINDOW_S / LOOK_S)
        if len(times) <= step:
            return 0.0
        rows = np.array([np.interp(times, t, column) for column in q.T]).T
        places = np.array([self._hands.of(z)[0] for z in self._solver.solve_many(rows)]).reshape(len(times), -1, 3)
        speeds = np.linalg.norm(places[step:] - places[:-step], axis=2).max(axis=1) / (step * LOOK_S)
        return float(speeds[times[step:] >= since].max(initial=0.0))


def _hands(assembly: Assembly) -> ca.Function:
    layout = ParameterLayout.of(assembly)
    z, fit = ca.SX.sym("z", layout.freedoms), ca.SX.zeros(layout.fit.stop - layout.fit.start)
    poses = arm_poses(assembly, z, fit)
    places = [frame_pose(assembly.arm.tree, poses, limb.prefix + "hand").p for limb in assembly.arm.limbs]
    return ca.Function("hands", [z], [ca.vertcat(*places)], ["z"], ["hands"])


def _still_s(t: Float[np.ndarray, " tick"], q: Rows, standing: Standing) -> float:
    """Time from the stop until all joints stand still [s], in the flight or after it; infinite if they do not."""
    for before_s, times, rows in ((float(t[-1]), standing.t, standing.q), (0.0, t, q)):
        moving = np.flatnonzero(joint_speeds(times, rows) > STILL_RAD_S)
        if len(moving):
            stands = moving[-1] < len(times) - 1
            return before_s + float(times[moving[-1]]) if stands else np.inf
    return 0.0


def _cause_s(name: StopName, ticks: np.ndarray, stopped: int, acted_s: float | None) -> float:
    """Time of the cause on the rig's clock [s]: of the program's act, or of the last word of a silent drive."""
    t = ticks["now"]
    if name == "cable":
        q = ticks["q_measured"][: stopped + 1]
        changed = [np.flatnonzero(np.diff(column)) for column in q.T]
        return float(min(t[places[-1] + 1] if len(places) else t[0] for places in changed))
    if acted_s is None:
        return float(t[stopped])
    return float(np.interp(acted_s, ticks["monotonic"], t))


def _off_s(ticks: np.ndarray, stopped: int, brake: Float[np.ndarray, " joint"]) -> float:
    """Time from the first word of the stop line until no motor gives torque [s]; infinite if one always does.

    The torque of a drive's brake is not counted.
    """
    t = ticks["now"]
    said = np.flatnonzero(ticks["faulty"])
    first = min(int(said[0]), stopped) if len(said) else stopped
    tau = ticks["tau_measured"].astype(float)
    before = np.abs(tau[max(first - 50, 0) : first + 1]).max(axis=0)
    left = np.abs(tau + brake * np.gradient(ticks["q_measured"], t, axis=0))[first:]
    small = (left < np.maximum(OFF_SHARE * before, OFF_NM)).all(axis=1)
    return float(t[first:][small.argmax()] - t[first]) if small.any() else np.inf
