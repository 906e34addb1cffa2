"""Motion of a recording for the page of `exograv data view`: positions, torques, arm and left over, thinned."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError
from exograv.model.scene.arm_lines import arms_of_line
from exograv.recording import Recording
from exograv.recording.fields import Message

FRAMES_HZ = 25.0
FRAMES_MAX = 6000
"""Largest number of frames: four minutes at full rate, a page of about 2 MB. A longer recording has a lower rate."""

FIELDS = ("t", "q_measured", "tau_measured", "tau_commanded", "arm_share", "gravity_level")
"""Fields of a tick that a frame shows."""

ARM_GAP_S = 0.3
"""Largest time from a frame to a recorded pose of the arm [s]; farther away, the arm moves with its cuffs."""

TRUE = "True residual torque at the held-out postures, measured by the twin's examiner (RMS)."
PREDICTED = (
    "Residual torque that the estimator itself expects (one standard deviation). An examiner did not measure it."
)


Rows = list[Any]
"""Numbers, nested as an array; None for a number that is not finite."""


@dataclass(frozen=True)
class ArmMotion:
    """Points of the recorded arm."""

    t: list[float]
    """Time of each pose [s]."""

    arms: list[Rows]
    """Points of each pose [m]."""

    gap_s: float
    """Largest time from a frame to a pose that it may use [s]."""


@dataclass(frozen=True)
class LeftOverMoment:
    """Left over at one time."""

    t: float
    Nm: list[float]
    about: str


@dataclass(frozen=True)
class PhaseMark:
    """Begin of a phase of the session, for the time axis."""

    t: float
    name: str


@dataclass(frozen=True)
class Motion:
    """Motion of a recording, one row per frame."""

    t: Rows
    """Time since the first tick [s]."""

    q: Rows
    """Joint positions [rad]."""

    tau_measured: Rows
    tau_commanded: Rows
    """Torque that was sent to the motors of the joints [N·m]."""

    felt: Rows
    """Share of the own weight that the arm feels [-]."""

    arm: ArmMotion
    left_over: list[LeftOverMoment]
    phases: list[PhaseMark]


def motion_of(recording: Recording) -> Motion:
    """Return the motion, with times from the first tick on.

    Raises:
        RecordingError: The recording has no usable tick.
    """
    start, end = _span(recording)
    count = min(max(int((end - start) * FRAMES_HZ) + 1, 2), FRAMES_MAX)
    ticks = _ticks_at(recording, np.linspace(start, end, count))
    felt = 1.0 - np.nan_to_num(ticks["arm_share"]) * (1.0 - np.nan_to_num(ticks["gravity_level"], nan=1.0))
    return Motion(
        t=_numbers(ticks["t"] - start, 3),
        q=_numbers(ticks["q_measured"], 4),
        tau_measured=_numbers(ticks["tau_measured"], 2),
        tau_commanded=_numbers(ticks["tau_commanded"], 2),
        felt=_numbers(felt, 3),
        arm=_arm(recording, start, end),
        left_over=_left_over(recording, start),
        phases=[PhaseMark(phase["t"] - start, phase["name"]) for phase in recording.messages("/phase")],
    )


def _span(recording: Recording) -> tuple[float, float]:
    """Return the times of the first and the last usable tick [s]."""
    first, last, count = 0.0, 0.0, 0
    for ticks in _usable(recording, ("t", "q_measured")):
        if len(ticks):
            first, last = first if count else float(ticks["t"][0]), float(ticks["t"][-1])
            count += len(ticks)
    if count < 2:
        raise RecordingError(
            f"{recording.path} holds no motion: it has fewer than two ticks with joint positions. Record a longer run."
        )
    return first, last


def _ticks_at(recording: Recording, times: Float[np.ndarray, " frame"]) -> np.ndarray:
    """Return the first usable tick at or after each of these rising times, each tick once."""
    found, done = list[np.ndarray](), 0
    for ticks in _usable(recording, FIELDS):
        rows = np.searchsorted(ticks["t"], times[done:])
        rows = rows[rows < len(ticks)]
        found.append(ticks[np.unique(rows)])
        done += len(rows)
    return np.concatenate(found)


def _usable(recording: Recording, fields: Sequence[str]) -> Iterator[np.ndarray]:
    """Yield the ticks with a time and joint positions, in pieces that fit into memory."""
    for ticks in recording.pieces(fields):
        yield ticks[np.isfinite(ticks["t"]) & np.isfinite(ticks["q_measured"]).all(axis=1)]


def _numbers(values: Float[np.ndarray, "..."], decimals: int) -> Rows:
    """Round numbers; a number that is not finite becomes None."""
    rounded = np.round(values.astype(float), decimals)
    known = rounded.astype(object)
    known[~np.isfinite(rounded)] = None
    return known.tolist()


def _arm(recording: Recording, start: float, end: float) -> ArmMotion:
    count = sum(1 for _ in _poses(recording, start, end))
    messages = list(islice(_poses(recording, start, end), None, None, max(1, -(-count // FRAMES_MAX))))
    arms = [_numbers(np.array(arms_of_line(message["arm"])), 4) for message in messages]
    return ArmMotion([round(message["t"] - start, 3) for message in messages], arms, ARM_GAP_S)


def _poses(recording: Recording, start: float, end: float) -> Iterator[Message]:
    return (m for m in recording.messages("/skeleton") if start <= m["t"] <= end and arms_of_line(m["arm"]))


def _left_over(recording: Recording, start: float) -> list[LeftOverMoment]:
    """Left over by time: the true one where an examiner measured it, otherwise the estimator's expectation."""
    true = [(m["t"], m["total"], TRUE) for m in recording.messages("/left_over")]
    predicted = [(m["t"], m.get("predicted_left_over_Nm"), PREDICTED) for m in recording.messages("/estimate")]
    n = len(recording.joints)
    rows = [
        (t, Nm, about)
        for t, Nm, about in true or predicted
        if Nm is not None and len(Nm) == n and all(value is not None for value in Nm)
    ]
    return [LeftOverMoment(t - start, Nm, about) for t, Nm, about in rows]
