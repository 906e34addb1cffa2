"""Fixtures: a nominal person in a nominal machine."""

from collections.abc import Callable

import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.identification.excitation.basis import Basis
from exograv.identification.excitation.information import LeftOverCriterion, Statistics
from exograv.identification.excitation.limits import MotionLimits
from exograv.identification.excitation.problem import MotionProblem
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine


@pytest.fixture(scope="session")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.70, 70.0, "female"))


@pytest.fixture(scope="session")
def machine(assembly: Assembly) -> CalibratedMachine:
    return nominal_machine(assembly.description, assembly.exo.phi)


@pytest.fixture(scope="session")
def model(assembly: Assembly, machine: CalibratedMachine) -> ArmModel:
    return ArmModel(assembly, machine)


@pytest.fixture(scope="session")
def prediction(assembly: Assembly, machine: CalibratedMachine, model: ArmModel) -> LeftOverPrediction:
    return LeftOverPrediction(model, prior(assembly, machine)[0])


@pytest.fixture(scope="session")
def make_problem(
    assembly: Assembly, machine: CalibratedMachine, model: ArmModel, prediction: LeftOverPrediction
) -> Callable[..., MotionProblem]:
    """Problem of the least left over after one and three periods of a basis."""
    mean, covariance = prior(assembly, machine)
    places = assembly.description.places
    criterion = LeftOverCriterion(prediction, covariance, places)

    def make(basis: Basis, **others) -> MotionProblem:
        limits, statistics = MotionLimits.of(assembly), Statistics.of(machine, places)
        given = {"passes": (1.0, 3.0), "samples": 24, **others}
        return MotionProblem(basis, limits, model, mean, statistics, criterion, **given)

    return make
