"""What the processes of the live loop tell each other in a tick, and what of it is recorded."""

from dataclasses import dataclass

import numpy as np

from exograv.runtime.recorder.recorder_process import Inlet
from exograv.safety.person import PersonLimits

RESET, STOP_PRESSED, ASTRAY, TOLD_PERSON, TOLD_LEVEL = 1, 2, 4, 8, 16
"""Bits of `acts` in a recorded tick, in the order in which they come between two ticks."""

EVENT_SHIFT = 8
"""From this bit on `acts` holds the event that control was told in this tick: its place in `steering.ASKABLE` and 1."""

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
"""Of a recorded tick: unknown to the guard where control did not answer in time."""


@dataclass(frozen=True)
class Channels:
    """Names of the memory between guard, control and recorder."""

    joints: int
    states: str
    answers: str
    inlet: Inlet
    bell: str | None = None
    """What the guard's parent rings; absent where nobody does."""


@dataclass(frozen=True)
class FeltLevel:
    """A word to the guard: what the person is to feel of the arm's weight from now on, by a ramp."""

    gravity_level: float
    ramp_s: float = 0.0
    """In which, at least [s]."""
    number: int | None = None
    """By which somebody who steers is answered; absent for a word that came by another way."""


@dataclass(frozen=True)
class PersonUpdate:
    """A word to the guard: who has been found to be in the machine, and is moved on."""

    person: PersonLimits


def state_dtype(joints: int) -> np.dtype:
    """What the guard tells control in a tick.

    `persons` counts how often the guard was told who is in the machine; `gravity_level` is the one in force, to which
    the guard holds control. `asked` counts what an operator asked for, of which `event` is the last: its place in
    `steering.ASKABLE`.
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
    """What control answers.

    `findings` counts those of a worker that it knows; `q_reference` is NaN where nothing drives.
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
            ("v", "<f8", per_joint),
            ("q_reference", "<f8", per_joint),
            ("tau", "<f8", per_joint),
            ("tau_feedforward", "<f8", per_joint),
        ],
        align=True,
    )


def sample_dtype(joints: int) -> np.dtype:
    """What control tells a worker in a tick: the motion as measured and as asked for, and whether it is the last.

    `posture` is that past which a verification leads just then, -1 where there is none.
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
    """What a worker has found by the sample of the time `now`."""
    return np.dtype([("now", "<f8"), ("x", "<f8", (parameters,))], align=True)


def answered_to(seen: int, passed: int) -> int:
    """Bit k: whether the measurement k before the newest was answered to; `passed` is how many are new."""
    return 1 if passed > 63 else (seen << passed | 1) & 0xFFFFFFFFFFFFFFFF
