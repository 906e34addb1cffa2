"""The model follows a motion, and marks samples whose loops it cannot close."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import SINGULAR_SD, ArmModel
from exograv.identification.core.interface import Sample
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine

Q = np.array([0.8, 0.3, -0.2, 1.3])
STILL = np.zeros(4)
SAMPLE = Sample(0.0, Q, STILL, STILL, STILL)


@pytest.fixture(scope="module")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))


@pytest.fixture(scope="module")
def model(assembly) -> ArmModel:
    return ArmModel(assembly, nominal_machine(assembly.description, assembly.exo.phi))


@pytest.fixture(scope="module")
def expected(model) -> np.ndarray:
    """Parameters before any motion."""
    return prior(model.assembly, model.machine)[0]


@pytest.fixture(scope="module")
def of_lead(assembly, expected) -> np.ndarray:
    """Parameters of an arm of half a tonne."""
    x = expected.copy()
    x[ParameterLayout.of(assembly).phi] *= 150.0
    return x


def test_an_arm_that_would_fall_out_of_its_cuffs_tells_nothing(model, of_lead):
    tau, derivative = model.linearise(SAMPLE, of_lead)
    assert not tau.any()
    assert not derivative.any()
    assert (model.direction_uncertainty(STILL) >= SINGULAR_SD).all()


def test_after_such_an_arm_the_next_one_is_seen_as_by_a_fresh_model(model, expected, of_lead):
    fresh = model.again().linearise(SAMPLE, expected)
    model.linearise(SAMPLE, of_lead)
    again = model.linearise(SAMPLE, expected)
    np.testing.assert_allclose(again[0], fresh[0], atol=1e-9)
    np.testing.assert_allclose(again[1], fresh[1], atol=1e-9)
    assert (model.direction_uncertainty(STILL) < SINGULAR_SD).all()
