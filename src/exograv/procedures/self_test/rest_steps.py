"""Self-test steps before any motion: encoders and motors of the hanging machine, and the guard's reaction."""

import numpy as np

from exograv.errors import RigError
from exograv.motion import hold
from exograv.procedures.calibration.breakaway_test import BreakawayPush, held_torque
from exograv.safety.stops import StopReason
from exograv.storage.self_test_step import Step, within, worst

from .bench import SelfTestRun
from .controllers import RunawayController
from .recording_rig import RecordedTicks

LISTEN_S, SETTLE_S = 1.0, 0.3
NOISE_MAX_DEG = 0.1
"""Allowed noise of an encoder at rest [°]: two steps of the worst twin's encoder."""

APART_MAX_DEG = 2.0
"""Allowed difference between a joint's encoder and its motor's, after the calibrated offset [°]
(docs/explanation/safety.md, F08).
"""

BIAS_WARN_NM, BIAS_MAX_NM = 1.0, 2.0  # docs/explanation/safety.md, F10
AGE_MAX_MS = 3.0  # docs/explanation/safety.md, F05
REPEATED_MAX = 0.001  # share of ticks without a new measurement
WILD_TICKS, WILD_NM = 20, 1000.0
ROUNDING = 1e-4  # relative to a step


def listen(bench: SelfTestRun) -> list[Step]:
    """Measure at rest for a second: noise and agreement of the encoders, age of measurements, zero of the torques.

    Raises:
        RigError: The guard stopped the run for another reason than a wrong torque.
    """
    push, start = BreakawayPush(held_torque(bench.description, bench.tree)), bench.tap.ticks
    try:
        bench.fly(push, SETTLE_S, "Listening")
        passed = bench.fly(push, LISTEN_S, "Listening")
    except RigError:
        # The guard detects a wrong torque within milliseconds, but does not know that the cause is a joint's zero.
        step = _zero(bench, bench.tap.passed(start))
        if step.passed or bench.pilot.envelope.stop is not StopReason.TORQUE_WRONG:
            raise
        return [step]
    return [*_encoders(bench, passed), *_fresh(passed), _zero(bench, passed)]


def _encoders(bench: SelfTestRun, passed: RecordedTicks) -> list[Step]:
    noise, noisy = worst(np.rad2deg(passed.q.std(axis=0)), bench.joints)
    steps = [
        within(
            "encoder noise",
            noise,
            NOISE_MAX_DEG,
            "°",
            f"The encoder of joint '{noisy}' is noisy, or the joint moves, while the machine hangs. Check its cable "
            "and its magnet, and let the machine hang still.",
        )
    ]
    if passed.q_motor is None:
        return [*steps, Step("encoders agree", True, "no second encoders", APART_MAX_DEG, "°")]
    apart = (passed.q - passed.q_motor).mean(axis=0) - bench.calibration.offset
    angle, name = worst(np.rad2deg(apart), bench.joints)
    what_to_do = (
        f"The encoder of joint '{name}' and its motor's are {angle:.1f}° farther apart than in the calibration. One of "
        "them has slipped, lost its zero, or counts the other way. Set its zero at the jig, then calibrate again."
    )
    return [*steps, within("encoders agree", angle, APART_MAX_DEG, "°", what_to_do)]


def _fresh(passed: RecordedTicks) -> list[Step]:
    fresh = "The driver passes on old measurements. Check bus and driver; no other process may write to them."
    repeated = float((np.diff(passed.sequence) <= 0).mean())
    backwards = float(-np.diff(passed.t).min(initial=0.0))
    clock = "The rig's clock goes back: it must be the computer's CLOCK_MONOTONIC."
    return [
        within("age of measurements", 1e3 * float(passed.age.max()), AGE_MAX_MS, "ms", fresh),
        within("measurements that came twice", repeated, REPEATED_MAX, "share", fresh),
        within("rig's clock goes back", 1e3 * backwards, 0.0, "ms", clock),
    ]


def _zero(bench: SelfTestRun, passed: RecordedTicks) -> Step:
    told = passed.tau_commanded.mean(axis=0)
    bias = bench.gain * passed.current.mean(axis=0) - told
    value, name = worst(bias, bench.joints)
    what_to_do = (
        f"The motor of joint '{name}' reports {value:+.2f} N·m in addition to its command. Set the zero of its current "
        "sensor, with the motor switched off."
    )
    step = within("torque zero", value, BIAS_MAX_NM, "N·m", what_to_do)
    if step.passed:
        bench.zero[:] = bias
        if abs(value) > BIAS_WARN_NM:
            return Step(step.name, True, step.measured, step.limit, step.unit, f"Warning. {what_to_do}")
    return step


def wake_guard(bench: SelfTestRun) -> list[Step]:
    """Check that the guard limits a command that is far too large, and stops at a non-finite one."""
    start, envelope = bench.tap.ticks, bench.pilot.envelope
    wild = RunawayController(held_torque(bench.description, bench.tree), WILD_TICKS, WILD_NM)
    path = hold(bench.pilot.q.copy(), (WILD_TICKS + 10) * bench.tap.period_s, bench.tap.period_s)
    reason = bench.come_down(wild, path, "Testing the guard", bench.run.listen)
    told = bench.tap.passed(start).tau_commanded
    step_max = envelope.limits.torque_rate_max_Nm_per_s * bench.tap.period_s * (1.0 + ROUNDING)
    largest = float(np.abs(np.diff(told, axis=0)).max())
    again = "The guard does not work. No person may be in this machine. Install exograv again and repeat."
    is_finite = bool(np.isfinite(told).all())
    is_awake = is_finite and reason is StopReason.NOT_FINITE
    return [
        within("guard cuts a wrong command to", largest, round(step_max, 6), "N·m a tick", again),
        Step(
            "guard stops a torque that is no number", is_awake, _said(reason), "stopped", "", "" if is_awake else again
        ),
    ]


def _said(reason: StopReason | None) -> str:
    return "not stopped" if reason is None else "stopped" if reason is StopReason.NOT_FINITE else reason.value
