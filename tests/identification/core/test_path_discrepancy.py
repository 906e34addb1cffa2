"""Considered errors of the shoulder's path are displacements of its centre, of the stated size."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.path_discrepancy import PATH_FEATURES, PathDiscrepancy
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.loops import FIT
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine

Q = np.array([0.8, 0.3, -0.2, 1.3])
SAMPLE = Sample(0.0, Q, np.zeros(4), np.zeros(4), np.zeros(4))
SD = 0.002


@pytest.fixture(scope="module")
def model() -> ArmModel:
    description = load_rig("recupera_like")
    assembly = assemble(description, Body(1.75, 75.0, "male"))
    return ArmModel(assembly, nominal_machine(description, assembly.exo.phi))


@pytest.fixture(scope="module")
def expected(model) -> np.ndarray:
    return prior(model.assembly, model.machine)[0]


@pytest.fixture(scope="module")
def offset(model) -> slice:
    begin = ParameterLayout.of(model.assembly).fit.start
    return slice(begin, begin + 3)


def errors(model: ArmModel, x: np.ndarray, offset: slice, q: np.ndarray = Q) -> np.ndarray:
    """Torque of all errors at a posture [N·m]."""
    path = PathDiscrepancy([offset], 4, SD)
    sample = Sample(0.0, q, np.zeros(4), np.zeros(4), np.zeros(4))
    return path.errors_of_joint(model.again().linearise(sample, x)[1], path.displacements(q))


@pytest.mark.parametrize("axis", range(3))
def test_an_error_along_an_axis_is_the_torque_of_a_shoulder_displaced_along_it(model, expected, offset, axis: int):
    displacements = PathDiscrepancy([offset], 4, SD).displacements(Q)
    every = errors(model, expected, offset).reshape(4, 3, PATH_FEATURES)[:, axis]
    for feature, moved_m in enumerate(displacements):
        there, back = expected.copy(), expected.copy()
        there[offset.start + axis] += moved_m
        back[offset.start + axis] -= moved_m
        change = 0.5 * (model.again().linearise(SAMPLE, there)[0] - model.again().linearise(SAMPLE, back)[0])
        np.testing.assert_allclose(every[:, feature], change, atol=1e-4)  # of 0.04 N·m; the third order remains


def test_over_many_postures_the_displacement_has_the_stated_size(offset):
    path = PathDiscrepancy([offset], 4, SD)
    postures = np.random.default_rng(0).uniform(-1.5, 1.5, (500, 4))
    size = np.sqrt(np.mean([np.sum(path.displacements(q) ** 2) for q in postures]))
    assert size == pytest.approx(SD, rel=0.1)


def test_stiffer_cuffs_turn_the_same_error_into_more_torque(model, expected, offset):
    stiff = expected.copy()
    stiff[ParameterLayout.of(model.assembly).fit.start + FIT.index("cuff_log_stiffness")] += np.log(3.0)
    by_soft, by_stiff = (np.linalg.norm(errors(model, x, offset)) for x in (expected, stiff))
    assert by_stiff > 1.5 * by_soft


def test_two_shoulders_share_the_errors_and_each_displaces_its_own_joints():
    derivative = np.zeros((4, 10))
    derivative[:2, 0:3], derivative[2:, 5:8] = 1.0, 2.0
    both = PathDiscrepancy([slice(0, 3), slice(5, 8)], 4, SD)
    one = PathDiscrepancy([slice(0, 3)], 4, SD)
    displacements = both.displacements(Q)
    np.testing.assert_array_equal(
        both.errors_of_joint(derivative, displacements)[:2], one.errors_of_joint(derivative, displacements)[:2]
    )
    np.testing.assert_array_equal(
        both.errors_of_joint(derivative, displacements)[2:], 2.0 * one.errors_of_joint(derivative, displacements)[:2]
    )
