"""Just et al.'s methods on a hidden arm: right if the arm only has weight, wrong if its joints have elasticity."""

from functools import cache

import numpy as np
import pytest

from exograv.laboratory.preparation import Preparation
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.model.description import load_rig
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import build_method, table_guess
from exograv.procedures.identification.method_names import MethodName
from exograv.procedures.identification.resting_poses import rest_first
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer

TARGET_NM = np.array([0.2, 0.2, 0.2, 0.1])
ALIGNED = ("slow_bias", "bursts", "donning_offset", "glenohumeral_shift", "length_error")
LIMP = ("passive_stiffness", "end_stops")
SEED = 3

pytestmark = pytest.mark.slow


@cache
def left_over(name: MethodName, *without: str) -> np.ndarray:
    """Residual torque of the method [N·m] for a wearer of level 2 `without` some disturbances.

    The machine is as in its data sheets; the sensors at its cuffs are of level 2.
    """
    wearer = Disturbances.at_level(2).without(*without)
    description = load_rig("recupera_like")
    machine = draw_machine(description, Disturbances.at_level(0).with_row("cuff_sensors", 2), SEED)
    laboratory = VirtualLaboratory(description, machine, draw_wearer(wearer, SEED))
    assembly = laboratory.assembly()
    known = nominal_machine(description, assembly.exo.phi)
    twin, table = Twin(description, machine, laboratory.wearer, SEED), table_guess(assembly, known)
    pilot = Preparation(laboratory, SEED).pilot_of(twin, known.actuators)
    controller, method = ArmController(assembly, known, table, twin.period_s), build_method(name, assembly, known)
    controller.mode.drive = 1.0
    rest_first(pilot, controller, method)
    return Examination(laboratory, assembly, known).score(method.estimate().x).total


def test_a_limp_arm_in_aligned_cuffs_is_found_by_two_rests():
    assert (left_over("full", *ALIGNED, *LIMP) <= TARGET_NM).all()


def test_what_an_arms_own_joints_pull_is_taken_for_weight():
    assert left_over("full", *ALIGNED).max() > 2.0 * left_over("full", *ALIGNED, *LIMP).max()
