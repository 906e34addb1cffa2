"""Types of the messages between the processes of the live loop in a tick, and of their record."""

from dataclasses import dataclass

import numpy as np

from exograv.runtime.recorder.recorder_process import Inlet
from exograv.safety.limits import PersonLimits

RESET, STOP_PRESSED, ASTRAY, TOLD_PERSON, TOLD_LEVEL, DRIFTED, CONSENTED = 1, 2, 4, 8, 16, 32, 64
"""Bits of `acts` in a recorded tick, in the order in which the acts come between two ticks."""

EVENT_SHIFT = 8
"""First bit of the event that was sent to control: from here `acts` holds its index in `steering.ASKABLE` plus 1."""

UNANSWERED = (
    "v",
    "q_reference",
    "tau_feedforward",
    "tau_desired",
    "closure_slope",
    "drive",
    "gravity_level",
    "arm_share",
)
"""Fields of a recorded tick that the guard does not know if control did not answer in time."""


@dataclass(frozen=True)
class MessageNames:
    """Names of the shared memory between the guard and its parent."""

    messages: str
    replies: str
    pulse: str


@dataclass(frozen=True)
class Channels:
    """Names of the shared memory between guard, control and recorder."""

    joints: int
    states: str
    answers: str
    inlet: Inlet
    parent: MessageNames | None = None
    """Messages between the guard and its parent; None if there are none."""


@dataclass(frozen=True)
class FeltLevel:
    """Message to the guard: share of the arm's weight that the person shall feel, reached by a ramp."""

    gravity_level: float
    ramp_s: float = 0.0
    """Shortest duration of the ramp [s]."""
    number: int | None = None
    """Number for the reply to the page that sent the request; None if the request came from elsewhere."""


@dataclass(frozen=True)
class Consent:
    """Message to the guard: the wearer agrees that the arm is pushed down, for `guard.CONSENT_S` from now on."""

    number: int | None = None
    """Number for the reply to the page that sent the consent; None if it came from elsewhere."""


@dataclass(frozen=True)
class PersonUpdate:
    """Message to the guard: limits of the person identified in the machine, who is now moved along a path."""

    person: PersonLimits


def state_dtype(joints: int) -> np.dtype:
    """Return the type of the guard's state for control in a tick.

    `persons` counts the messages to the guard about the person in the machine. `gravity_level` is the level in force,
    to which the guard holds control. `asked` counts the requests of an operator, and `event` is the last of them: its
    index in `steering.ASKABLE`.
    """
    per_joint = (joints,)
    return np.dtype(
        [
            ("sequence", "<i8"),
            ("now", "<f8"),
            ("safe_state", "<i8"),
            ("persons", "<i8"),
            ("asked", "<i8"),
            ("event", "<i8"),
            ("gravity_level", "<f8"),
            ("q", "<f8", per_joint),
            ("current", "<f8", per_joint),
        ],
        align=True,
    )


def answer_dtype(joints: int) -> np.dtype:
    """Return the type of control's answer.

    `findings` counts the findings of a worker that control has taken. `q_reference` is NaN without a reference motion.
    `drift` is the last finding of the drift monitor: 0 none, 1 for the operator, 2 for a descent; with its joint, its
    residual torque [N·m] and the index of its likely cause.
    """
    per_joint = (joints,)
    return np.dtype(
        [
            ("sequence", "<i8"),
            ("valid_until", "<f8"),
            ("mode", "<i8"),
            ("findings", "<i8"),
            ("slope", "<f8"),
            ("drive", "<f8"),
            ("gravity_level", "<f8"),
            ("arm_share", "<f8"),
            ("seen", "<u8"),
            ("drift", "<i8"),
            ("drift_joint", "<i8"),
            ("drift_cause", "<i8"),
            ("drift_Nm", "<f8"),
            ("v", "<f8", per_joint),
            ("q_reference", "<f8", per_joint),
            ("tau", "<f8", per_joint),
            ("tau_feedforward", "<f8", per_joint),
        ],
        align=True,
    )


def sample_dtype(joints: int) -> np.dtype:
    """Return the type of control's sample for a worker in a tick: measured and desired motion, and a mark on the last.

    `posture` is the index of the posture that a verification passes at this time, -1 without one.
    """
    per_joint = (joints,)
    return np.dtype(
        [
            ("now", "<f8"),
            ("is_last", "<i8"),
            ("posture", "<i8"),
            ("q", "<f8", per_joint),
            ("tau", "<f8", per_joint),
            ("q_asked", "<f8", per_joint),
        ],
        align=True,
    )


def finding_dtype(parameters: int) -> np.dtype:
    """Return the type of a worker's finding from the sample of the time `now`."""
    return np.dtype([("now", "<f8"), ("x", "<f8", (parameters,))], align=True)


def answered_to(seen: int, passed: int) -> int:
    """Bit k is set if the measurement k before the newest was answered; `passed` is the number of new measurements."""
    return 1 if passed > 63 else (seen << passed | 1) & 0xFFFFFFFFFFFFFFFF
