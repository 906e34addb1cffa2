"""Judgement of a fit: its errors against the disclosed machine, and its held-out torque against the noise."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from scipy import signal

from exograv.recording import read_recording

from .draw import PERIOD_S, Hidden, truth_engine
from .engine import JOINTS, Joints

FORM = """{
 "friction": {                  friction torque of each joint at a constant speed, positive along a positive speed
  "speed_rad_s": [...],         ascending, from the largest negative speed to the largest positive one
  "torque_Nm": [[...], ...],    one row per speed, one column per joint
  "load_Nm": [...],             transmitted torque at which it is stated, per joint; zero if absent
  "t_s": ...},                  time on the rig's clock at which it is stated; half of the held-out start if absent
 "delay_ms": ...,               from a command's `t` to the first measurement that shows it, without the drive's lag
 "lag_ms": [...],               optional: lag of each drive at low frequency (1/w, or 2 zeta/w of second order)
 "rotor_inertia_kgm2": [...],   at the joint
 "axis_inertia_kgm2": [...],    optional: rotor plus all links about each joint's axis, all joints at zero, no weight
 "gain_Nm_per_A": [...],        cold
 "held_out_tau_Nm": "FILE.npy"  predicted `tau_measured` (tick, joint) of the held-out recording; beside this file
}"""
"""Form of the file of a fit."""

V_MOVES = 0.05
"""Speed above which a joint moves [rad/s]."""
V_LEAST = 0.02
"""Least speed at which friction is compared [rad/s]: a joint that sticks has no friction by its speed."""
SPEEDS = 40
LOW_HZ = 10.0
"""Upper end of the band in which the held-out torque is compared a second time [Hz]: noise hides less there."""
EDGE_S = 0.5
"""Time at both ends of the held-out recording that is left out: filters settle there [s]."""


@dataclass(frozen=True)
class Judgement:
    """Errors of a fit, one entry per joint where not stated otherwise; NaN where the fit is silent."""

    joints: tuple[str, ...]
    v_max: Joints
    """Largest compared speed, which 1 % of the held-out ticks exceed [rad/s]."""
    friction_error: Joints
    """RMS error of friction over the RMS friction torque, over the speeds of both directions [-]."""
    friction_rms: Joints
    """RMS friction torque [N·m]."""
    delay_error_ms: float
    lag_error_ms: Joints
    """Error of delay and lag together [ms]."""
    rotor_error: Joints
    """Relative error of the rotor's inertia [-]."""
    axis_error: Joints
    """Relative error of the inertia of rotor and links about the axis [-]."""
    gain_error: Joints
    """Relative error of the torque per current [-]."""
    held_out_error: Joints
    """RMS error of the held-out torque over its noise [-]: at least 1."""
    held_out_moving: Joints
    """The same over the ticks in which the joint moves [-]: friction at rest depends on the way to the posture."""
    held_out_low: Joints
    """The error below `LOW_HZ` over the noise there [-], all ticks."""
    noise: Joints
    """Standard deviation of the noise of the held-out torque [N·m]."""


def judge(hidden: Hidden, fit_path: Path, held_out: Path) -> Judgement:
    """Compare a fit in the form `FORM` with the machine."""
    fit: dict[str, Any] = json.loads(fit_path.read_text(encoding="utf-8"))
    recording = read_recording(held_out)
    ticks, values = recording.ticks, hidden.values
    v_max = np.percentile(_speed(ticks["q_measured"]), 99.0, axis=0)
    truth, error = _friction(hidden, fit["friction"], v_max, 0.5 * float(ticks["t"][0]))
    nominal = _nominal_gain(ticks)
    noise = nominal * hidden.sensing.current_noise
    whole = moving = low = np.full(JOINTS, np.nan)
    if "held_out_tau_Nm" in fit:
        predicted = np.load(fit_path.parent / fit["held_out_tau_Nm"])
        moves = _speed(ticks["q_measured"]) > V_MOVES
        whole, moving, low = held_out_errors(ticks["tau_measured"] - predicted, noise, moves)
    order = np.where(values["current_ratio"] > 0.0, 2.0 * values["current_ratio"], 1.0)
    lag_ms = 1e3 * (hidden.delay_s + order / values["current_rad_s"])
    M, _ = truth_engine(hidden).links(np.zeros(JOINTS), np.zeros(JOINTS))
    return Judgement(
        recording.joints,
        v_max,
        error / truth,
        truth,
        float(fit.get("delay_ms", np.nan)) - 1e3 * hidden.delay_s,
        float(fit.get("delay_ms", np.nan)) + _given(fit, "lag_ms") - lag_ms,
        _given(fit, "rotor_inertia_kgm2") / values["rotor"] - 1.0,
        _given(fit, "axis_inertia_kgm2") / (values["rotor"] + np.diag(M)) - 1.0,
        _given(fit, "gain_Nm_per_A") / values["gain"] - 1.0,
        whole,
        moving,
        low,
        noise,
    )


def _given(fit: dict[str, Any], name: str) -> Joints:
    return np.array(fit.get(name, [np.nan] * JOINTS), dtype=float)


def _speed(q: Float[np.ndarray, "tick joint"]) -> Float[np.ndarray, "tick joint"]:
    """Absolute speed from differences over 20 ms [rad/s]; zero in the first and last 10 ms."""
    speed = np.zeros(q.shape)
    speed[10:-10] = np.abs(q[20:] - q[:-20]) / (20.0 * PERIOD_S)
    return speed


def _nominal_gain(ticks: np.ndarray) -> Joints:
    """Gain with which the loop turned currents into torques [N·m/A]."""
    return np.sum(ticks["tau_measured"] * ticks["current"], axis=0) / np.sum(ticks["current"] ** 2, axis=0)


def _friction(hidden: Hidden, given: dict[str, Any], v_max: Joints, t: float) -> tuple[Joints, Joints]:
    """RMS of the true friction torque and of its error [N·m]."""
    engine = truth_engine(hidden)
    engine.change("ripple", np.zeros(JOINTS))  # a waviness along the way is no function of the speed
    t, load = float(given.get("t_s", t)), np.array(given.get("load_Nm", [0.0] * JOINTS), dtype=float)
    speed, torque = np.array(given["speed_rad_s"], dtype=float), np.array(given["torque_Nm"], dtype=float)
    if speed[0] > -v_max.max() or speed[-1] < v_max.max():
        raise ValueError(f"The fit states friction from {speed[0]} to {speed[-1]} rad/s; ±{v_max.max():.3f} is needed.")
    truth, error = np.empty(JOINTS), np.empty(JOINTS)
    for joint, fastest in enumerate(v_max):
        rising = np.linspace(V_LEAST, fastest, SPEEDS)
        grid = np.concatenate([-rising[::-1], rising])
        true = np.array([engine.steady_friction(joint, v, float(load[joint]), t) for v in grid.tolist()])
        truth[joint] = np.sqrt(np.mean(true**2))
        error[joint] = np.sqrt(np.mean((np.interp(grid, speed, torque[:, joint]) - true) ** 2))
    return truth, error


def held_out_errors(
    residual: Float[np.ndarray, "tick joint"], noise: Joints, moves: Bool[np.ndarray, "tick joint"]
) -> tuple[Joints, Joints, Joints]:
    """RMS of a residual [N·m] over that of white noise: of all ticks, of the moving ones, and below `LOW_HZ` [-]."""
    edge = round(EDGE_S / PERIOD_S)
    sections = signal.butter(2, LOW_HZ, fs=1.0 / PERIOD_S, output="sos")
    pulse = np.zeros(2 * edge + 1)
    pulse[edge] = 1.0
    passed = float(np.sqrt(np.sum(signal.sosfiltfilt(sections, pulse) ** 2)))
    low = signal.sosfiltfilt(sections, residual, axis=0)[edge:-edge]
    residual, moves = residual[edge:-edge], moves[edge:-edge]
    moving = np.sqrt(np.sum(moves * residual**2, axis=0) / np.sum(moves, axis=0))
    whole, slow = (np.sqrt(np.mean(each**2, axis=0)) for each in (residual, low))
    return whole / noise, moving / noise, slow / (passed * noise)


def judgement_text(found: Judgement) -> str:
    """Table of a judgement, one line per joint, with the goals of issue 34 in its head."""
    head = (
        f"{'joint':20}{'friction':>10}{'of RMS':>9}{'up to':>9}{'rotor':>8}{'axis':>8}{'gain':>8}{'delay+lag':>11}"
        f"{'held out':>10}{'moving':>8}{'<10 Hz':>8}{'noise':>8}\n"
        f"{'':20}{'[%]':>10}{'[N·m]':>9}{'[rad/s]':>9}{'[%]':>8}{'[%]':>8}{'[%]':>8}{'[ms]':>11}"
        f"{'[x noise]':>10}{'':>16}{'[N·m]':>8}\n"
        f"{'goal':20}{'5':>10}{'':>18}{'5':>8}{'':>27}{'1.2':>10}\n"
    )
    rows = [
        f"{name:20}{100 * found.friction_error[j]:10.2f}{found.friction_rms[j]:9.2f}{found.v_max[j]:9.2f}"
        f"{100 * found.rotor_error[j]:8.1f}{100 * found.axis_error[j]:8.1f}{100 * found.gain_error[j]:8.2f}"
        f"{found.lag_error_ms[j]:11.3f}{found.held_out_error[j]:10.3f}{found.held_out_moving[j]:8.3f}"
        f"{found.held_out_low[j]:8.2f}{found.noise[j]:8.3f}"
        for j, name in enumerate(found.joints)
    ]
    return head + "\n".join(rows) + f"\ndelay {found.delay_error_ms:+.3f} ms (goal 0.3)"
