"""Bring-up steps without motor torque: encoder signs, the stop line and the drives' watchdogs."""

import contextlib

import numpy as np

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives
from exograv.storage.self_test_step import Step, within

from .bench_machine import BenchMachine, all_say, currents, positions
from .hands import Hands

TURNED = np.deg2rad(5.0)
"""Rotation that shows that a joint was turned by hand [rad]."""

BACK = np.deg2rad(1.0)
"""Distance from the hanging position at which the joint counts as turned back [rad]."""

STOP_WITHIN_MS = 50.0  # docs/explanation/safety.md, F30
WATCHDOG_WITHIN_MS = 30.0  # docs/explanation/safety.md, F13
QUIET_SHARE = 0.05  # allowed share of the rated current at zero command
CREEP = np.deg2rad(1.0)
ZERO_S, RELEASED_S = 0.5, 0.3
SINKS_MAX_S, SINKS_MAX = 10.0, np.deg2rad(20.0)
"""Longest time [s] and largest angle [rad] by which a machine may sink to where it hangs, when its drives let go. A
drive that is off brakes, so that a joint with little friction hangs only after minutes."""


def wiring(drives: Drives, torque_max: np.ndarray, gain: np.ndarray) -> list[Step]:
    """Compare current limits of `drives.toml` with torque limits of `rig.toml`, before any motor is switched on.

    Args:
        drives: Drives of the machine.
        torque_max: Torque limit of each motor (joint,) [N·m].
        gain: Torque per current by the data sheet (joint,) [N·m/A].
    """
    most = np.array([drive.current_max_A for drive in drives.each]) * gain / torque_max
    joint = int(np.abs(np.log(most)).argmax())
    passed = bool(0.5 <= most[joint] <= 1.5)
    what = (
        f"The drive of '{drives.joints[joint]}' may give {most[joint]:.2g} times the torque that rig.toml allows its "
        "motor. Correct current_max_A in drives.toml, or torque_max_Nm, torque constant or gear ratio in rig.toml."
    )
    brakes = drives.without_brake
    return [
        Step("greatest current against greatest torque", passed, round(float(most[joint]), 3), "0.5 to 1.5",
             "", "" if passed else what),
        Step("every drive brakes by itself", not brakes, ", ".join(brakes) or "all", "all", "",
             "" if not brakes else f"Without a brake at {', '.join(brakes)} no person may be in this machine: a fault "
             "would drop the arm (docs/explanation/safety.md, SS4).", locks_only=True),
    ]  # fmt: skip


def turns(line: BenchMachine, hands: Hands, joint: int) -> list[Step]:
    """Ask for one joint to be turned by hand, with its motor off. Only its encoder may move, and must count up."""
    name = line.rig.joints[joint]
    start = line.rig.read().q.copy()
    hands.turn(name, 1)
    found, moved = line.watch(
        hands.patience_s, lambda seen: bool(np.abs(seen.state.q - start).max() > TURNED), commands=False
    )
    if moved:
        # A machine that is not turned back would sink at its first push.
        hands.turn(name, -1)
        line.watch(hands.patience_s, lambda seen: bool(np.abs(seen.state.q - start).max() < BACK), commands=False)
    hands.turn(name, 0)
    line.watch(0.3, commands=False)
    way = np.rad2deg(found[-1].state.q - start)
    title = f"{name}: encoder, turned by hand"
    if not moved:
        what = (
            "No encoder has moved. Turn the joint. Check that the drive does not brake too hard, and that the encoder "
            "is connected."
        )
        return [Step(title, False, round(float(way[joint]), 2), np.rad2deg(TURNED), "°", what)]
    other = int(np.abs(np.delete(way, joint)).argmax()) if len(way) > 1 else -1
    largest = float(np.delete(way, joint)[other]) if other >= 0 else 0.0
    if abs(largest) > abs(way[joint]):
        swapped = np.delete(np.array(line.rig.joints), joint)[other]
        what = f"A turn of '{name}' is reported at '{swapped}'. Their nodes in drives.toml are swapped: correct them."
        return [Step(title, False, round(float(way[joint]), 2), np.rad2deg(TURNED), "°", what)]
    what = (
        f"The encoder counts down where it must count up. Change the sign of '{name}' in drives.toml, and its offset."
    )
    passed = bool(way[joint] > 0.0)
    return [Step(title, passed, round(float(way[joint]), 2), np.rad2deg(TURNED), "°", "" if passed else what)]


def stop_is_heard(line: BenchMachine, hands: Hands) -> list[Step]:
    """Have the hardware stop pressed while all motors are off.

    Every drive must report the stop, and refuse to be switched on.
    """
    hands.press_stop()
    found, heard = line.watch(hands.patience_s, all_say(DriveFault.STOP_LINE), commands=False)
    deaf = [
        joint
        for joint, status in zip(line.rig.joints, found[-1].status, strict=True)
        if DriveFault.STOP_LINE not in status.fault
    ]
    what = f"The drives of {', '.join(deaf)} do not report the stop. Check the stop line before you continue."
    steps = [Step("hardware stop is seen by every drive", heard, f"{len(line.rig.joints) - len(deaf)}",
                  f"{len(line.rig.joints)}", "drives", "" if heard else what)]  # fmt: skip
    if not heard:
        return steps
    try:
        line.rig.enable()
        refused = False
    except RigError:
        refused = True
    line.rig.disable()
    what = "A drive switches on while the stop is pressed: the stop line must cut the power (STO), not only report."
    steps.append(Step("pressed, no motor can be switched on", refused, "refused" if refused else "switched on",
                      "refused", "", "" if refused else what))  # fmt: skip
    stays_off, can_be = is_released(line, hands)
    what = "A drive switches on by itself when the stop is released. Set it to wait until it is enabled (ISO 13850)."
    steps.append(Step("released, no motor comes back by itself", stays_off, "off" if stays_off else "on", "off", "",
                      "" if stays_off else what))  # fmt: skip
    what = "The motors cannot be switched on after the stop is released. Check that the stop line is closed."
    steps.append(Step("released, they can be switched on", can_be, "on" if can_be else "refused", "on", "",
                      "" if can_be else what))  # fmt: skip
    return steps


def is_released(line: BenchMachine, hands: Hands) -> tuple[bool, bool]:
    """Ask for the release of the hardware stop, and watch the drives.

    Return True if all motors stay off then, and True if they can be switched on.
    """
    hands.release_stop()
    until, stays_off = line.rig.t + hands.patience_s, True
    while line.rig.t < until:
        found, _ = line.watch(RELEASED_S, commands=False)
        stays_off = stays_off and not any(drive.is_enabled for seen in found for drive in seen.status)
        with contextlib.suppress(RigError):
            line.rig.enable()
            line.rig.disable()
            return stays_off, True
    return stays_off, False


def zero_torque(line: BenchMachine) -> list[Step]:
    """Switch all motors on at zero torque: no current may flow, and no joint may move after it has sunk."""
    line.rig.enable()
    begun = line.rig.t
    found, _ = line.watch(ZERO_S)
    first = found[0].state.q.copy()
    while True:
        share = np.abs(currents(found).mean(axis=0)) / line.rated
        way = np.abs(positions(found) - positions(found)[0]).max(axis=0)
        sinks = way.max() > CREEP and share.max() <= QUIET_SHARE  # without current only its weight moves a joint
        sunk = np.abs(found[-1].state.q - first).max()
        if not sinks or sunk > SINKS_MAX or line.rig.t - begun > SINKS_MAX_S:
            break
        found, _ = line.watch(ZERO_S)
    flows, creeps = int(share.argmax()), int(way.argmax())
    names = line.rig.joints
    return [
        within(
            "current at no torque", float(share[flows]), QUIET_SHARE, "of the rated",
            f"In the motor of '{names[flows]}' current flows at zero command. Zero its current sensor.",
        ),
        within(
            "motion at no torque", float(np.rad2deg(way[creeps])), float(np.rad2deg(CREEP)), "°",
            f"'{names[creeps]}' moves by itself. Let the machine hang, empty, before it is switched on.",
        ),
    ]  # fmt: skip


def watchdog(line: BenchMachine, drives: Drives, title: str) -> list[Step]:
    """Stop all commands: every drive must be off in time, and stay off when commands come again."""
    begun = line.rig.t
    tripped, _ = line.watch(4.0 * drives.watchdog_s, all_say(DriveFault.WATCHDOG), commands=False)
    took_ms = 1e3 * (line.rig.t - begun)
    lazy = [
        joint
        for joint, status in zip(line.rig.joints, tripped[-1].status, strict=True)
        if DriveFault.WATCHDOG not in status.fault
    ]
    what = f"The drives of {', '.join(lazy) or 'all'} stay on without commands. Set their watchdogs to 20 ms."
    steps = [within(title, np.inf if lazy else took_ms, WATCHDOG_WITHIN_MS + 1e3 * line.rig.period_s, "ms", what)]
    found, _ = line.watch(0.05)
    back = any(status.is_enabled for status in found[-1].status)
    what = "A drive switches on by itself after its watchdog. Set it to wait until it is enabled." if back else ""
    steps.append(Step(f"{title}: stays off afterwards", not back, "on" if back else "off", "off", "", what))
    return steps
