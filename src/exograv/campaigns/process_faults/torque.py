"""Torque at the drives after a strike: within the machine's limits, and not growing in a descent."""

import numpy as np

from .drives import DrivesLog
from .evidence import FlightEvidence, MachineFigures

ROUNDING_NM = 2e-3
"""Rounding of a torque: currents have 32 bits on the bus, and gains are calibrated [N·m]."""

JITTER_S = 2e-4
"""Jitter of the arrival of a command at the drives [s]; the drives read their bus between two steps."""

SPEED_OVER_S = 0.02
"""Time over which the speed of a joint is measured by its encoder [s]."""

GROWTH_NM = 0.5
"""Torque above the fading torque that a descent may have: friction and noise of the measured speed [N·m]."""

SETTLES_S = 0.05
"""Time after the beginning of a descent in which the rate limit still brings the torque to it [s]."""


def torque_faults(evidence: FlightEvidence, machine: MachineFigures, descent_t: float | None) -> list[str]:
    """Return what is wrong with the commanded torque; `descent_t` is the begin of a descent [s], if there was one."""
    drives = evidence.drives
    tau = drives.command_current * machine.gain
    faults = []
    if not np.isfinite(tau).all():
        faults.append("a command was not finite")
    worst = float((np.abs(tau) - machine.torque_max_Nm).max(initial=-np.inf))
    if worst > ROUNDING_NM:
        faults.append(f"a command was {worst:.3f} N·m above the drives' torque")
    faults += _rate_faults(drives, tau, machine)
    return faults if descent_t is None else [*faults, *growth_faults(evidence, machine, descent_t)]


def growth_faults(evidence: FlightEvidence, machine: MachineFigures, descent_t: float) -> list[str]:
    """Return a sentence if a torque in a descent exceeds the fading torque of its begin, and the damping."""
    drives = evidence.drives
    begun = np.flatnonzero(drives.command_t >= descent_t)
    if not len(begun) or not len(drives.step_t):
        return []
    tau = np.abs(drives.command_current[begun] * machine.gain)
    t = drives.command_t[begun]
    share = np.clip(1.0 - (t - descent_t) / machine.descent_s, 0.0, 1.0)[:, None]
    speed = _speed(drives.step_t, drives.step_q, t, machine.period_s)
    allowed = tau[0] * share + machine.damping_Nms_per_rad * speed + GROWTH_NM
    growth = (tau - allowed)[t > descent_t + SETTLES_S]
    if growth.size and growth.max() > 0.0:
        tick, joint = np.unravel_index(growth.argmax(), growth.shape)
        after = float(t[t > descent_t + SETTLES_S][tick] - descent_t)
        return [
            f"the torque of joint {joint} grows in the descent: {growth.max():.2f} N·m too much after {after:.2f} s"
        ]
    return []


def _rate_faults(drives: DrivesLog, tau: np.ndarray, machine: MachineFigures) -> list[str]:
    """Compare consecutive commands from the first torque on. Before it, commands without torque enable the drives."""
    first = int((tau != 0.0).any(axis=1).argmax()) if len(tau) else 0
    step = np.abs(np.diff(tau[first:], axis=0)).max(axis=1, initial=0.0)
    # A tick whose command was lost on the way has limited its torque, too.
    passed_s = np.maximum(np.diff(drives.command_t[first:]), machine.period_s) + JITTER_S
    over = step - machine.torque_rate_max_Nm_per_s * passed_s - ROUNDING_NM
    if over.max(initial=-np.inf) <= 0.0:
        return []
    return [f"a step of {step[over.argmax()]:.3f} N·m between two commands, faster than the rate limit"]


def _speed(step_t: np.ndarray, q: np.ndarray, t: np.ndarray, period_s: float) -> np.ndarray:
    """Greatest speed of each joint by its encoder shortly before each time (time, joint) [rad/s]."""
    over = max(round(SPEED_OVER_S / period_s), 1)
    speed = np.zeros_like(q)
    speed[over:] = np.abs(q[over:] - q[:-over]) / (over * period_s)
    at = np.clip(np.searchsorted(step_t, t), 0, len(step_t) - 1)
    around = [np.clip(at + shift, 0, len(step_t) - 1) for shift in (-over, 0, over)]
    return np.max([speed[one] for one in around], axis=0)
