"""A form in pounds is rejected within half a minute, and a weight is found, carried, and put down again."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.dynamics.actuator import ActuatorGain
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.identification.core.prior import prior
from exograv.loop.moved_machine import PilotedArm
from exograv.procedures.weighing.arm_check import ArmJudge
from exograv.procedures.weighing.first_motion import first_motion
from exograv.procedures.weighing.known_weight import weigh

HALF_A_MINUTE_S = 30.0
BODY_SHARE = 1.0 / 2.2046
QUIET = np.array([0.1, 0.1, 0.1, 0.1])
"""Residual that a calibration would not explain [N·m]. The perfect stage 0 of these tests has no value for it."""


def as_calibrated(worn):
    gain = ActuatorGain(worn.pilot.actuators.gain, worn.pilot.actuators.gain_sd)
    return replace(worn.machine, actuators=gain, residual_sd=QUIET, correlation_s=QUIET)


@pytest.mark.slow
def test_the_right_form_is_believed_and_one_in_pounds_is_not(put_on):
    worn = put_on(level=2)
    model = ArmModel(worn.controller.assembly, as_calibrated(worn))
    mass = worn.twin.truth.wearer.body.mass
    before = worn.twin.t
    samples = first_motion(worn.pilot, worn.controller, model)
    check = ArmJudge(model).judge([samples], mass)
    assert worn.twin.t - before < HALF_A_MINUTE_S
    assert not check.refused
    # The same arm with a form of 2.2 times the mass: the table then predicts 2.2 times the arm.
    arm = worn.controller.assembly.arm
    heavy = replace(arm, phi=arm.phi / BODY_SHARE, phi_covariance=arm.phi_covariance / BODY_SHARE**2)
    model.assembly = replace(model.assembly, arm=heavy)
    check = ArmJudge(model).judge([first_motion(worn.pilot, worn.controller, model)], mass / BODY_SHARE)
    assert check.refused
    assert "pounds" in check.why


@pytest.mark.slow
def test_a_hidden_weight_is_found_and_carried_beside_the_arm(put_on):
    worn = put_on(level=1)
    machine = as_calibrated(worn)
    model = ArmModel(worn.controller.assembly, machine)
    mean, covariance = prior(worn.controller.assembly, machine)
    x = worn.controller.x.copy()
    arm = Estimate(0.0, mean, covariance, 0.0, 1.0)
    found = weigh(
        PilotedArm(worn.pilot, worn.controller), model, arm, lambda is_there: worn.twin.hang("hand", 0.8 * is_there)
    )
    assert found.ci95[0] < 0.8 < found.ci95[1]
    assert worn.controller.weights == {"hand": found.mass}
    np.testing.assert_array_equal(worn.controller.x, x)
    worn.controller.carry("hand", 0.0, worn.pilot.q)
    assert worn.controller.weights == {}
