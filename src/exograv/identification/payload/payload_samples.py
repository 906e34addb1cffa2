"""Samples from a log of another robot, and refusal of logs that do not fit the robot's description."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError
from exograv.identification.core.interface import Joints, Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.model.tree import Tree
from exograv.recording import MotionLog

BEYOND_LIMIT_RAD = 0.1  # tolerance for a joint slightly outside the description's limit; wrong units exceed it
FASTER_THAN_LIMIT = 3.0  # times the description's speed
SPEED_ERROR_MAX = 0.5  # velocity column against the derivative of the positions, share of its RMS
TRAVEL_MIN_RAD = 0.1  # range of the joint that moves most

Table = Float[np.ndarray, "sample joint"]


def samples_of_log(log: MotionLog, gain: Joints) -> list[Sample]:
    """Positions, velocities, accelerations and torques of a log, all through the same filter, at a constant period.

    The acceleration is the filtered derivative of the log's own velocities. The positions are rounded and their times
    jitter; their second derivative would contain more noise than motion.

    Args:
        log: Log of the motion.
        gain: Joint torque per current [N·m/A]; ones if the log contains torques [-].
    """
    dt = float(np.median(np.diff(log.t)))
    t = np.arange(log.t[0], log.t[-1], dt)
    q, v, tau = (_at(t, log.t, table) for table in (log.q, log.v, gain * log.effort))
    n = len(gain)
    of_position, of_velocity = SampleFilter(n, dt), SampleFilter(n, dt)
    samples = []
    for q_now, v_now, tau_now in zip(q, v, tau, strict=True):
        sample, slope = of_position.update(q_now, tau_now), of_velocity.update(v_now, tau_now)
        if of_position.settled:
            samples.append(Sample(sample.t, sample.q.copy(), slope.q.copy(), slope.v.copy(), sample.tau.copy()))
    return samples


def refuse_other_robots(log: MotionLog, tree: Tree, path: Path) -> None:
    """Refuse a log that does not fit this robot: degrees, other columns, other joints, no motion.

    Raises:
        RecordingError: A joint leaves its limits, velocities and positions disagree, or no joint moves.
    """
    _refuse_positions(log, tree, path)
    _refuse_velocities(log, tree, path)
    travel = np.ptp(log.q, axis=0)
    if travel.max() < TRAVEL_MIN_RAD:
        raise RecordingError(
            f"{path}: no joint moves by more than {travel.max():.3f} rad in rows {log.rows[0]}–{log.rows[1]}; "
            f"{TRAVEL_MIN_RAD} rad are needed. Choose the rows of the motion."
        )


def _refuse_positions(log: MotionLog, tree: Tree, path: Path) -> None:
    for joint, q in zip(tree.joints, log.q.T, strict=True):
        beyond = max(float(q.max()) - joint.upper, joint.lower - float(q.min()))
        if beyond > BEYOND_LIMIT_RAD:
            raise RecordingError(
                f"{path}: joint '{joint.name}' goes from {q.min():.2f} to {q.max():.2f} rad; {tree.name} allows "
                f"{joint.lower:.2f} to {joint.upper:.2f}. Are the positions in degrees, or of another robot?"
            )


def _refuse_velocities(log: MotionLog, tree: Tree, path: Path) -> None:
    slope = np.gradient(log.q, log.t, axis=0)
    for joint, v, v_of_q in zip(tree.joints, log.v.T, slope.T, strict=True):
        fast = float(np.percentile(np.abs(v_of_q), 95))
        if fast > FASTER_THAN_LIMIT * joint.velocity:
            raise RecordingError(
                f"{path}: the positions of joint '{joint.name}' change by {fast:.1f} rad/s; {tree.name} allows "
                f"{joint.velocity:.2f}. Are the positions in degrees?"
            )
        size = float(np.sqrt(np.mean(v_of_q**2)))
        error = float(np.sqrt(np.mean((v - v_of_q) ** 2)))
        if error > SPEED_ERROR_MAX * size and size > 0.05:
            raise RecordingError(
                f"{path}: the velocities of joint '{joint.name}' are not the derivative of its "
                f"positions: they differ by {error:.2f} rad/s RMS at {size:.2f} rad/s RMS. The columns must be time, "
                "all positions, all velocities [rad/s], all currents or torques; choose others with --columns."
            )


def _at(t: Float[np.ndarray, " even"], t_log: Float[np.ndarray, " sample"], table: Table) -> np.ndarray:
    return np.column_stack([np.interp(t, t_log, column) for column in table.T])
