"""Self-test steps with the empty machine in motion: signs, motors and encoders by its own weight, and standstill."""

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.calibration_drift import CalibrationChange, weigh_again
from exograv.identification.calibration.empty_checks import SURE_SD
from exograv.motion import go_to, hold, joined
from exograv.procedures.calibration.breakaway_test import BreakawayTester
from exograv.storage.self_test_step import Step, within, worst

from .bench import SelfTestRun
from .controllers import CarryController
from .poses import telling_poses

PASS_RAD, PASS_SPEED = np.deg2rad(10.0), 0.8
"""Half the length of a pass through a posture [rad], and its greatest speed [rad/s]. Friction is measured in both
directions."""

HOLD_S, DRIFT_MAX_DEG = 3.0, 2.0  # docs/explanation/safety.md, start-up self-test
CHUNK_S = 0.1
SCALE_MAX = 0.15  # docs/explanation/safety.md, F09
OFFSET_MAX_DEG = 3.0
"""Allowed encoder offset against the calibration, by the machine's weight [°]; a calibration has the same limit (F08).
"""

BIAS_MAX_NM = 2.0  # docs/explanation/safety.md, F10
SCALE_SD_MAX = 0.075  # a less certain scale cannot be distinguished from an error of 15 %

Joints = Float[np.ndarray, " joint"]


def nudge(bench: SelfTestRun) -> list[Step]:
    """Push every joint both ways, without feedback: only the pushed joint may move, along the push.

    0.5 N·m alone moves no harmonic drive. The push starts at a part of the calibrated friction, and grows until the
    joint moves.
    """
    friction = bench.calibration.machine.friction
    BreakawayTester(bench.run, np.asarray(friction.coulomb)).nudge(pushes=1)
    return [Step("sign of each joint", True, f"{len(bench.joints)} of {len(bench.joints)} right", "all")]


def hold_poses(bench: SelfTestRun) -> list[Step]:
    """Move through three postures slowly both ways, and release the machine in each of them."""
    drifts = []
    for k, pose in enumerate(telling_poses(bench.description, bench.tree)):
        text = f"Posture {k + 1} of 3"
        bench.go(pose, text)
        _pass_through(bench, pose, text)
        drifts.append(_drift(bench, text))
        if np.abs(drifts[-1]).max() > np.deg2rad(DRIFT_MAX_DEG):
            break
    drift, name = max(((*worst(np.rad2deg(row), bench.joints),) for row in drifts), key=lambda found: abs(found[0]))
    sinks = (
        f"Joint '{name}' moved by {drift:+.1f}° while the machine carried itself. Its motor does not give the torque "
        "of its current, its encoder is off, or a load hangs on the machine. Remove the load, or calibrate again."
    )
    steps = [within("drift while it carries itself", drift, DRIFT_MAX_DEG, f"° in {HOLD_S:g} s", sinks)]
    return steps if not steps[0].passed else [*steps, *weight(bench)]


def weight(bench: SelfTestRun) -> list[Step]:
    """Compare gains, encoder offsets and torque zeros with the calibration, by the links' weight in motion."""
    found = weigh_again(bench.description, bench.tree, bench.run.sweeps(), bench.calibration)
    return [_scale(bench, found), _offset(bench, found), _bias(bench, found)]


def _pass_through(bench: SelfTestRun, pose: Joints, text: str) -> None:
    dt = bench.tap.period_s
    up, down = pose + PASS_RAD, pose - PASS_RAD
    speed, way = PASS_SPEED, 1.5 * PASS_SPEED
    there = [go_to(pose, up, way, dt), go_to(up, down, speed, dt), go_to(down, up, speed, dt), go_to(up, pose, way, dt)]
    bench.run.follow(joined(there), text)


def _drift(bench: SelfTestRun, text: str) -> Joints:
    """Release the feedback. Return the drift of each joint [rad] after three seconds, or when one drifts too far."""
    carry, dt = CarryController(bench.run.controller, len(bench.joints)), bench.tap.period_s
    start, way = bench.pilot.q.copy(), np.zeros(len(bench.joints))
    for _ in range(round(HOLD_S / CHUNK_S)):
        bench.pilot.run(carry, hold(bench.pilot.q.copy(), CHUNK_S, dt), text, bench.run.listen)
        way = bench.pilot.q - start
        if np.abs(way).max() > np.deg2rad(DRIFT_MAX_DEG):
            break
    return way


def _scale(bench: SelfTestRun, found: CalibrationChange) -> Step:
    told = found.scale_sd <= SCALE_SD_MAX
    error, name = worst(np.where(told, found.scale - 1.0, 0.0), bench.joints)
    what_to_do = (
        f"The motor of joint '{name}' gives {1.0 + error:.2f} times the torque of its calibration for the same "
        "current. Check for a hot or damaged motor, a slipping gear, another drive setting, or a weight on the "
        "machine; then calibrate again."
    )
    step = within("error of the torque's scale", error, SCALE_MAX, "share", what_to_do)
    if told.all() or not step.passed:
        return step
    unknown = ", ".join(joint for joint, is_told in zip(bench.joints, told, strict=True) if not is_told)
    cannot = f"Warning: {unknown} carry too little of the machine's weight to measure their scale to {SCALE_MAX:.0%}."
    return Step(step.name, True, step.measured, step.limit, step.unit, cannot)


def _offset(bench: SelfTestRun, found: CalibrationChange) -> Step:
    """Return the step of the joint with the largest offset relative to its limit.

    The limit is larger for a joint that carries too little weight for an accurate offset.
    """
    allowed = np.maximum(np.deg2rad(OFFSET_MAX_DEG), SURE_SD * found.offset_sd)
    _, name = worst(found.offset / allowed, bench.joints)
    joint = bench.joints.index(name)
    angle, limit = float(np.rad2deg(found.offset[joint])), round(float(np.rad2deg(allowed[joint])), 2)
    what_to_do = (
        f"By the machine's weight the encoder of joint '{name}' reads {angle:+.1f}° more than when it was calibrated. "
        "Set its zero at the jig or the stop, check that the base has not moved, then calibrate again."
    )
    step = within("encoder offset by weight", angle, limit, "°", what_to_do)
    vague = np.rad2deg(allowed) > OFFSET_MAX_DEG
    if not vague.any() or not step.passed:
        return step
    unsure = ", ".join(joint for joint, is_vague in zip(bench.joints, vague, strict=True) if is_vague)
    cannot = f"Warning: {unsure} carry too little of the machine's weight to show an offset of {OFFSET_MAX_DEG:g}°."
    return Step(step.name, True, step.measured, step.limit, step.unit, cannot)


def _bias(bench: SelfTestRun, found: CalibrationChange) -> Step:
    value, name = worst(found.bias, bench.joints)
    what_to_do = (
        f"The motor of joint '{name}' gives {-value:+.2f} N·m in addition to its report. Set the zero of its current "
        "sensor, with the motor switched off."
    )
    return within("torque zero by weight", value, BIAS_MAX_NM, "N·m", what_to_do)
