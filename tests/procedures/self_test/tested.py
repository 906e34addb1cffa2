"""Verdict of the self-test on machines with a hidden fault; a script, so that shape checks do not slow the ticks.

The calibration consists of the true values of the day before, because a measured one takes a minute. Measured ones are
in benchmarks/self_test.py.
"""

import json
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from exograv.dynamics.loop_torque import GRAVITY
from exograv.identification.calibration.empty_machine import Calibration
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.twin_calibration import EmptyTwin
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.description import load_rig
from exograv.procedures.self_test.machine_test import test_machine as tested
from exograv.rig.twin import Disturbances, draw_machine
from self_test_faults import HIDDEN

SEED, LEVEL = 1012, 1
QUICK = {
    "encoder reversed": 0,
    "encoder off by 5°": 3,
    "motor's encoder off by 5°": 1,
    "current sensor off by 2.5 N·m": 2,
    "measurements come late": 0,
}
"""Faults that are found before anything moves, with their joint."""

SLOW = {
    "motor gives half its torque": 0,
    "motor gives twice its torque": 1,
    "motor turns the other way": 2,
    "both encoders reversed": 2,
    "both encoders off by 10°": 3,
    "current loop off by 2.5 N·m": 0,
    "watchdog does not trip": 0,
    "watchdog does not brake": 3,
    "Stop does nothing": 0,
    "Stop does not reach the drives": 0,
    "encoder is dead": 1,
    "encoders swapped": 0,
    "motors swapped": 1,
    "joints swapped": 0,
    "nothing": 0,
}

OTHER_RIGS = ("nesm_like", "agree_like", "recupera_like_7", "recupera_like_qdd")
"""Machines without a fault."""


def verdict(fault: str, joint: int, rig: str = "recupera_like") -> dict[str, Any]:
    """Return the steps that failed, and what happened to the machine in the meantime."""
    description = load_rig(rig)
    machine = draw_machine(description, Disturbances.at_level(LEVEL), SEED)
    calibration, lengths = calibrated(rig)
    if fault != "nothing":
        machine = HIDDEN[fault].machine(machine, joint)
    subject = EmptyTwin(description, machine, SEED, lengths).under_test(calibration)
    if fault != "nothing":
        driver = HIDDEN[fault].driver(subject.rig, joint, description.nominal_gain)
        subject = replace(subject, rig=driver, press=driver.press)
    steps, busy_s = tested(subject, lambda _text, _share: None)
    return {
        "failed": [step.name for step in steps if step.passed is False],
        "not_tried": [step.name for step in steps if step.passed is None],
        "what_to_do": " ".join(step.what_to_do for step in steps),
        "busy_s": busy_s,
        "joint": description.joints[joint],
    }


def calibrated(rig: str) -> tuple[Calibration, dict[str, float]]:
    """Return a calibration with the true values, as from a perfect stage 0."""
    laboratory = draw_laboratory(rig, None, LEVEL, SEED)
    machine = ideal_knowledge(laboratory, 0.0).machine
    joints = len(machine.phi)
    certain = machine.actuators.gain * 1e-3
    return Calibration(
        replace(machine, actuators=replace(machine.actuators, gain_sd=certain)),
        machine.gravity[:2] / float(np.linalg.norm(GRAVITY)),
        np.zeros(2),
        laboratory.machine.sensors.encoder_offset,
        np.zeros(joints),
        np.zeros((joints, 10)),
    ), dict(laboratory.wearer.lengths_given)


if __name__ == "__main__":
    cases = QUICK if sys.argv[1] == "quick" else SLOW
    said = {fault: verdict(fault, joint) for fault, joint in cases.items()}
    if cases is SLOW:
        said |= {rig: verdict("nothing", 0, rig) for rig in OTHER_RIGS}
    print(json.dumps(said))
