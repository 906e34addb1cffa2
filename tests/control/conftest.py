"""Fixtures: a wearer in a calibrated machine whose model has every term."""

import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.machine import CalibratedMachine
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble


@pytest.fixture(scope="session")
def assembly() -> Assembly:
    return assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))


@pytest.fixture(scope="session")
def machine(assembly) -> CalibratedMachine:
    none, one = np.zeros(4), np.ones(4)
    friction = Friction(2.0 * one, one, 1.3 * one, 0.06 * one, 0.1 * one, 0.05 * one, 0.02)
    friction_sd = Friction(0.02 * one, 0.03 * one, 0.03 * one, 0.002 * one, 0.02 * one, 0.005 * one, 0.02)
    gain = ActuatorGain(assembly.description.nominal_gain, none)
    return CalibratedMachine(gain, friction, friction_sd, assembly.exo.phi, GRAVITY, 0.2 * one, none, none)


@pytest.fixture(scope="session")
def wearer(assembly) -> np.ndarray:
    """Parameters of an arm with springs, misaligned with the machine's axes."""
    x = parameters.table_parameters(assembly.arm, np.full(4, 0.2), np.full(4, 2.0), np.full(4, 1.0))
    layout = parameters.ParameterLayout.of(assembly)
    x[layout.stiffness], x[layout.spring_offset], x[layout.damping] = 1.5, 0.8, 0.4
    x[layout.fit] = [0.02, -0.015, 0.01, 0.02, 0.006, 0.2, -0.3, 0.12, 0.08, 0.005, -0.004, *FURTHER_PATH]
    return x
