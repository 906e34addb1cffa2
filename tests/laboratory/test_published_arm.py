"""The controller only accepts a physically possible arm, from any method."""

import numpy as np
import pytest

from exograv.loop.arm_controller import ArmController
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess

Q = np.deg2rad([30.0, 40.0, 0.0, 60.0])


@pytest.fixture(scope="module")
def controller() -> ArmController:
    assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
    machine = nominal_machine(assembly.description, assembly.exo.phi)
    return ArmController(assembly, machine, table_guess(assembly, machine), 1e-3)


@pytest.mark.parametrize(("entry", "value"), [(10, -0.1), (4, -0.5), (0, np.nan)])
def test_an_arm_that_cannot_be_is_not_taken(controller: ArmController, entry: int, value: float):
    x = controller.x.copy()
    x[entry] = value
    before = controller.x.copy()
    assert not controller.publish(x, Q)
    np.testing.assert_array_equal(controller.x, before)


def test_a_heavier_arm_is_taken(controller: ArmController):
    x = controller.x.copy()
    x[:20] *= 1.2
    assert controller.publish(x, Q)
