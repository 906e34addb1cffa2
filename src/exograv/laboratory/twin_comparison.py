"""`exograv twin compare`: a recording of the empty machine, replayed on its fitted twin."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import empty_gains
from exograv.errors import RecordingError
from exograv.identification.machine_twin.machine_fit import recording_residual, sample_noise
from exograv.identification.machine_twin.measured_motion import MeasuredMotion
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.machine_twin.options import TwinCompareOptions
from exograv.procedures.machine_twin.read_motions import read_motions
from exograv.rig.twin import Disturbances, Machine, Twin
from exograv.rig.twin.twin import PERIOD
from exograv.signals import Command
from exograv.storage.twin_file import StoredTwin, read_twin

from .fitted_machine import fitted_machine

OPEN_S, CLOSED_S = 0.5, 1.5
"""Length of a window without feedback, and of the feedback between two windows that brings the twin back [s]."""

COMMAND_LIFE_S = 0.005
"""Time for which a command is valid [s]."""

USUAL_LEVEL = 2
"""Level of the disturbances from which everything comes that the twin does not tell."""

Progress = Callable[[str, float], None]
Ticks = Float[np.ndarray, "tick joint"]


@dataclass(frozen=True)
class JointDeparture:
    """Departure of the twin from the recording, at one joint."""

    joint: str
    torque_Nm: float
    """RMS torque below 7 Hz that the twin's parameters leave unexplained in clear motion, without the noise that rows
    more than 1 ms apart add."""
    fitted_Nm: float
    """The same on the held-out part of the recordings to which the twin was fitted."""
    feedback_Nm: float
    """RMS torque of the feedback that keeps the twin on the recorded path."""
    closed_loop_deg: float
    """RMS distance from the recorded path with this feedback."""
    open_loop_deg: float
    """RMS departure from the recorded path in half a second without feedback."""
    over_noise: float
    """Torque per tick that the twin's parameters leave unexplained in clear motion, over the noise of the fit."""


@dataclass(frozen=True)
class TwinComparison:
    """Result of `exograv twin compare`."""

    rig: str
    side: str
    twin: str
    """Hash of the twin."""
    recording: Path
    replayed_s: float
    joints: list[JointDeparture]
    allowed: float
    ok: bool
    """True if no joint's torque departs by more than is allowed."""
    departed: list[str]
    """Joints whose torque departs by more than is allowed."""
    wall_s: float


def compare_twin(options: TwinCompareOptions, progress: Progress = lambda _text, _share: None) -> TwinComparison:
    """Replay a recording on the fitted twin of its machine.

    Raises:
        ConfigError: The machine has no fitted twin.
        RecordingError: The recording cannot be read, or holds no commands.
        IdentificationError: The recording moves the machine too little.
    """
    start = time.perf_counter()
    description = load_rig(options.machine, options.side)
    whole = read_twin(description)
    (recording,) = read_motions(description, [options.recording], options.weight_of_file(), is_torque=False)
    if any(one.wrench is not None for one in recording.motions):
        raise RecordingError(
            f"{options.recording} has a force sensor: the twin cannot be pulled as the machine was. Compare a "
            "recording without forces from outside."
        )
    motion_period_s = max(one.period_s for one in recording.motions)
    motion = _beginning(max(recording.motions, key=lambda one: len(one.t)), options.seconds)
    if not np.isfinite(motion.current_asked).all():
        raise RecordingError(
            f"{options.recording} holds no commanded torques: they cannot be replayed. Record tau_commanded, too."
        )
    lengths = whole.provenance.lengths_m
    tree, theta = adjusted(read_exoskeleton(description), description, lengths), np.array(whole.posterior.mean)
    residual = recording_residual(description, tree, theta, recording.motions)
    kp, kd = empty_gains(description, tree)
    machine = fitted_machine(description, whole, Disturbances.at_level(USUAL_LEVEL), 0, is_mean=True)
    replay = _Replay(description, machine, whole, motion, (kp, kd))
    feedback, closed = replay.run(lambda _t: True, lambda share: progress("Replay with feedback", 0.5 * share))
    _, opened = replay.run(_is_closed, lambda share: progress("Replay without feedback", 0.5 + 0.5 * share))
    departures = _in_windows(motion, opened)
    rows = [
        JointDeparture(row.joint, *(float(value) for value in values))
        for row, *values in zip(
            whole.joints,
            _without_added_noise(residual.slow_Nm, motion_period_s, np.array([row.noise_Nm for row in whole.joints])),
            [row.held_out_slow_rms_Nm for row in whole.joints],
            _rms(feedback),
            np.rad2deg(_rms(closed)),
            np.rad2deg(departures),
            residual.per_tick_Nm / np.array([row.noise_Nm for row in whole.joints]),
            strict=True,
        )
    ]
    departed = [row.joint for row in rows if row.torque_Nm > options.allowed * row.fitted_Nm]
    return TwinComparison(
        rig=description.name,
        side=description.side,
        twin=whole.content_sha256,
        recording=options.recording,
        replayed_s=round(float(motion.t[-1] - motion.t[0]), 3),
        joints=rows,
        allowed=options.allowed,
        ok=not departed,
        departed=departed,
        wall_s=round(time.perf_counter() - start, 2),
    )


class _Replay:
    """Twin that gets the recorded commands."""

    def __init__(
        self,
        description: RigDescription,
        machine: Machine,
        whole: StoredTwin,
        motion: MeasuredMotion,
        gains: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]],
    ):
        self._description, self._machine, self._motion = description, machine, motion
        self._lengths, (self._kp, self._kd) = whole.provenance.lengths_m, gains

    def run(self, is_closed: Callable[[float], bool], note: Callable[[float], None]) -> tuple[Ticks, Ticks]:
        """Replay the recording; return the feedback's torque [N·m] and the distance from the recorded path [rad].

        `is_closed` says for a time since the start [s] whether the feedback acts.
        """
        motion, gain = self._motion, self._description.nominal_gain
        start = motion.q[0] - self._machine.sensors.encoder_offset
        twin = Twin(self._description, self._machine, None, 0, start, lengths=self._lengths)
        ticks, joints = motion.q.shape
        feedback, apart = np.zeros((ticks, joints)), np.zeros((ticks, joints))
        hung, rate = np.zeros(motion.hung.shape[1]), np.zeros(joints)
        v_share = twin.period_s / V_FILTER_S
        for tick in range(ticks):
            if (motion.hung[tick] != hung).any() and np.isfinite(motion.hung[tick]).all():
                hung = motion.hung[tick]
                self._hang(twin, hung)
            state = twin.read()
            apart[tick] = state.q - motion.q[tick]
            if tick:
                rate += v_share * ((apart[tick] - apart[tick - 1]) / twin.period_s - rate)
            if is_closed(twin.t):
                feedback[tick] = -self._kp * apart[tick] - self._kd * rate
            current = motion.current_asked[tick] + feedback[tick] / gain
            twin.write(Command(twin.t, tick, twin.t + COMMAND_LIFE_S, current * gain, current))
            if tick % NOTED_EVERY == 0:
                note(tick / ticks)
        return feedback, apart

    def _hang(self, twin: Twin, hung: Float[np.ndarray, " hanging"]) -> None:
        weights = self._description.calibration.weights_kg
        masses = hung.reshape(-1, len(weights)) @ np.asarray(weights)
        for mount, mass in zip(self._description.mounts, masses.tolist(), strict=True):
            twin.hang(mount, mass)


def _without_added_noise(
    slow_Nm: Float[np.ndarray, " joint"], period_s: float, noise_Nm: Float[np.ndarray, " joint"]
) -> Float[np.ndarray, " joint"]:
    """Residual below 7 Hz without the sensors' noise that a filter passes of fewer rows, beyond that at 1 ms [N·m]."""
    now, usual = (sample_noise(one, noise_Nm) for one in (max(period_s, PERIOD), PERIOD))
    return np.sqrt(np.maximum(slow_Nm**2 - (now**2 - usual**2), 0.0))


V_FILTER_S = 0.003
"""Time constant of the speed of the feedback [s]."""

NOTED_EVERY = 1000
"""Ticks between two notes of progress."""


def _beginning(motion: MeasuredMotion, seconds: float) -> MeasuredMotion:
    """Return the first seconds of a motion, on the twin's period."""
    grid = np.arange(motion.t[0], min(motion.t[-1], motion.t[0] + seconds), PERIOD)
    q, current, asked = (
        np.column_stack([np.interp(grid, motion.t, column) for column in values.T])
        for values in (motion.q, motion.current, motion.current_asked)
    )
    hung = motion.hung[np.searchsorted(motion.t, grid, side="right") - 1]
    return MeasuredMotion(motion.name, grid, q, current, asked, hung)


def _is_closed(t: float) -> bool:
    return t % (OPEN_S + CLOSED_S) < CLOSED_S


def _in_windows(motion: MeasuredMotion, apart: Ticks) -> Float[np.ndarray, " joint"]:
    """RMS change of the distance over the windows without feedback (joint,) [rad]."""
    period_s = motion.period_s
    every, first, last = (round(one / period_s) for one in (OPEN_S + CLOSED_S, CLOSED_S, OPEN_S + CLOSED_S))
    changes = [apart[k + last - 1] - apart[k + first] for k in range(0, len(apart) - last, every)]
    return _rms(np.array(changes))


def _rms(values: Ticks) -> Float[np.ndarray, " joint"]:
    return np.sqrt(np.mean(values**2, axis=0))
