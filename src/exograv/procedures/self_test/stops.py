"""Self-test steps of the stops: Stop is pressed during motion, and commands end during motion."""

import numpy as np
from jaxtyping import Float

from exograv.loop.tick_sample import TickSample
from exograv.motion import Trajectory, go_to, hold, joined, sweep
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.safety.stops import StopReason
from exograv.storage.self_test_step import Step, within, worst

from .bench import SelfTestRun
from .recording_rig import RecordedTicks

STOP_WITHIN_MS = 50.0  # docs/explanation/safety.md, F30
GONE_WITHIN_S = 4.0  # docs/explanation/safety.md: longest stop with the motors on
HOME_SPEED, PRESS_AT = 1.0, 0.7
"""Speed on the way to the hanging posture [rad/s], and share of the way at which Stop is pressed. From there the
machine soon hangs still."""

REST_S, REST_MAX_NM = 0.3, 0.7
"""Last part of a descent [s], and torque that may remain then, without the torque of the brake [N·m]."""

FEED_SPEED, FEED_WAY = 0.7, 0.5  # rad/s and rad: fast enough to see a drive brake
SILENCE_S = 0.15  # after this time Stop is pressed, too
TRIP_MAX_MS = 30.0  # docs/explanation/safety.md, F13
BRAKES_SHARE = 0.3
"""Least share of its set damping with which a drive must brake."""

SEEN_RAD = 0.004  # smallest motion at which braking can be distinguished from noise
WHILE_S = 0.02
HALF = 0.5
MEAN_TICKS = 8

Joints = Float[np.ndarray, " joint"]


def press_stop(bench: SelfTestRun) -> list[Step]:
    """Press Stop on the way to the hanging posture.

    The descent must begin, and no torque may remain at its end.
    """
    dt, ticks, start = bench.tap.period_s, 0, bench.tap.ticks
    path = go_to(bench.pilot.q.copy(), starting_posture(bench.tree), HOME_SPEED, dt)
    path = joined([path, hold(path.q[-1], 2e-3 * STOP_WITHIN_MS, dt)])
    press_after = round(PRESS_AT * len(path))
    pressed = seen = -1

    def listener(moment: TickSample) -> None:
        nonlocal ticks, pressed, seen
        ticks += 1
        if ticks == press_after:
            pressed = bench.tap.ticks
            bench.press(bench.pilot.guard)
        if pressed >= 0 and seen < 0 and bench.pilot.envelope.stop is not None:
            seen = bench.tap.ticks

    reason = bench.come_down(bench.run.controller, path, "Stop is pressed", listener)
    again = "Stop does not stop the machine. Check the button, its line and the drives. No person may be in it."
    if reason is not StopReason.STOP_PRESSED:
        return [Step("Stop is heard", False, "not heard", STOP_WITHIN_MS, "ms", again)]
    heard_ms = 1e3 * bench.tap.period_s * (seen - pressed + 1)
    left = _left(bench, bench.tap.passed(bench.tap.ticks - round(REST_S / bench.tap.period_s)))
    gone_s = bench.tap.period_s * (_gone(bench, bench.tap.passed(start)) - press_after)
    return [
        within("Stop is heard", heard_ms, STOP_WITHIN_MS, "ms", again),
        within("torque left after Stop", left, REST_MAX_NM, "N·m", again),
        within("torque is gone after Stop", gone_s, GONE_WITHIN_S, "s", again),
    ]


def _left(bench: SelfTestRun, passed: RecordedTicks) -> float:
    """Largest torque that a motor still gives, without the torque of the brake [N·m]."""
    v = np.gradient(passed.q, bench.tap.period_s, axis=0)
    return worst((bench.tau(passed) + bench.damping * v).mean(axis=0), bench.joints)[0]


def _gone(bench: SelfTestRun, passed: RecordedTicks) -> int:
    """Return the first tick after which all means over 0.1 s are below the allowed torque."""
    ticks = round(0.1 / bench.tap.period_s)
    v = np.gradient(passed.q, bench.tap.period_s, axis=0)
    means = _means(bench.tau(passed) + bench.damping * _means(v, ticks), ticks)
    return int(np.flatnonzero(np.abs(means).max(axis=1) > REST_MAX_NM).max(initial=0))


def stop_feeding(bench: SelfTestRun) -> list[Step]:
    """Stop all commands in the middle of a motion: every drive must release its torque by itself, and brake."""
    path = _crossing(bench)
    ticks, silent = 0, -1
    middle = len(path) // 4
    press = middle + round(SILENCE_S / bench.tap.period_s)

    def listener(moment: TickSample) -> None:
        nonlocal ticks, silent
        bench.run.listen(moment)
        ticks += 1
        if ticks == middle:
            bench.tap.is_silent, silent = True, bench.tap.ticks
        if ticks == press:
            bench.pilot.guard.press_stop()

    bench.come_down(bench.run.controller, path, "No commands are sent", listener)
    passed = bench.tap.passed(silent - round(0.05 / bench.tap.period_s))
    return _watchdog(bench, passed, silent - (bench.tap.ticks - len(passed.t)))


def _crossing(bench: SelfTestRun) -> Trajectory:
    """Trajectory of all joints at once, to the side with more room, and back."""
    dt, q = bench.tap.period_s, bench.pilot.q.copy()
    lower, upper = (np.array([getattr(joint, end) for joint in bench.tree.joints]) for end in ("lower", "upper"))
    goal = q + np.where(q < 0.5 * (lower + upper), FEED_WAY, -FEED_WAY)
    one_by_one = [sweep(q, joint, float(angle), FEED_SPEED, dt) for joint, angle in enumerate(goal)]
    return Trajectory(
        q + np.sum([path.q - q for path in one_by_one], axis=0),
        np.sum([path.v for path in one_by_one], axis=0),
        np.sum([path.a for path in one_by_one], axis=0),
        dt,
    )


def _watchdog(bench: SelfTestRun, passed: RecordedTicks, silent: int) -> list[Step]:
    """Judge the drives' watchdogs from the ticks since 50 ms before the silence; `silent` is its first tick."""
    dt = bench.tap.period_s
    tau, expires = bench.tau(passed), passed.t[silent] - dt + 0.005
    before = tau[: silent + 1].mean(axis=0)
    trip = int(np.searchsorted(passed.t, expires + 1e-3 * TRIP_MAX_MS))
    dead = (
        "It continues to give torque without commands. Set its watchdog (docs/explanation/safety.md), and check that "
        "its driver drops commands that have expired."
    )
    rest = slice(len(tau) - round(1.0 / dt), None)
    v = np.gradient(passed.q, dt, axis=0)
    kept = np.abs((tau + bench.drive_damping * v)[rest].mean(axis=0))
    left, name = worst(kept, bench.joints)
    gone_ms = 1e3 * max(_falls(passed.t, tau[:, j], before[j], silent) for j in range(len(before)))
    brakes, lazy = _braking(bench, passed, tau, trip)
    is_lazy = (
        f"The drive of joint '{lazy}' does not brake without commands: an arm would fall. Set its watchdog to "
        "brake after 20 ms (docs/explanation/safety.md)."
    )
    return [
        within("torque left without commands", left, REST_MAX_NM, "N·m", f"Drive of joint '{name}': {dead}"),
        within("torque is gone after the last command", gone_ms, TRIP_MAX_MS + MEAN_TICKS, "ms", dead),
        Step(
            "drives brake without commands",
            brakes >= BRAKES_SHARE,
            round(brakes, 3),
            BRAKES_SHARE,
            "of the damping set, at least",
            "" if brakes >= BRAKES_SHARE else is_lazy,
        ),
    ]


def _falls(t: Float[np.ndarray, " tick"], tau: Float[np.ndarray, " tick"], before: float, silent: int) -> float:
    """Time from the silence until half of the earlier torque is gone [s]."""
    means = _means(tau[:, None], MEAN_TICKS)[:, 0]
    below = np.flatnonzero(means[silent:] * np.sign(before) < HALF * abs(before))
    return float(t[silent + below[0]] - t[silent]) if below.size else np.inf


def _braking(
    bench: SelfTestRun, passed: RecordedTicks, tau: Float[np.ndarray, "tick joint"], trip: int
) -> tuple[float, str]:
    """Return the least share of its damping with which a drive brakes, and its joint, between the watchdog and Stop.

    In each short interval a brake with torque -damping · v takes a momentum of damping · way. The share is computed by
    intervals because a joint may first go on, then sink back.
    """
    dt = bench.tap.period_s
    ticks = max(round(WHILE_S / dt), 1)
    ends = trip + ticks * np.arange(round(SILENCE_S / dt / ticks) + 1)
    ways = np.diff(passed.q[ends], axis=0)
    momenta = -dt * np.add.reduceat(tau[: ends[-1]], ends[:-1], axis=0)
    seen = (ways**2).sum(axis=0)
    share = (momenta * ways).sum(axis=0) / np.where(seen > SEEN_RAD**2, seen, np.nan) / bench.drive_damping
    share = np.where(np.isfinite(share), share, np.inf)
    joint = int(share.argmin())
    return float(min(share[joint], 10.0)), bench.joints[joint]


def _means(rows: Float[np.ndarray, "tick joint"], ticks: int) -> Float[np.ndarray, "tick joint"]:
    """Return the moving average over the last `ticks` ticks."""
    sums = np.cumsum(np.vstack([np.zeros(rows.shape[1]), rows]), axis=0)
    first = np.maximum(np.arange(1, len(rows) + 1) - ticks, 0)
    return (sums[1:] - sums[first]) / (np.arange(1, len(rows) + 1) - first)[:, None]
