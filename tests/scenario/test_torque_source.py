"""The arm can be identified from the commanded torque as well as from the measured one."""

import numpy as np
import pytest

from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.method_names import TorqueSourceName
from exograv.rig.twin import parameter_truth


@pytest.mark.parametrize("source", [pytest.param("current", marks=pytest.mark.slow), "commanded"])
def test_the_hidden_arm_is_found_from_either_torque(put_on, source: TorqueSourceName):
    worn = put_on(level=0)
    notes = []

    def note(t, estimate, predicted, outcome):
        notes.append((t, estimate.t))

    identifier = Identifier(worn.pilot, worn.controller, worn.machine, "recursive", source, note)
    found = identify_arm(worn.pilot, worn.controller, identifier, 10.0)
    truth = parameter_truth(worn.twin.truth.wearer)
    moments = [truth["upper_arm.mz"], truth["forearm.mz"]]
    np.testing.assert_allclose(found.last.x[[3, 13]], moments, rtol=0.15)
    before = np.abs(worn.table[[3, 13]] - moments).sum()
    assert np.abs(found.last.x[[3, 13]] - moments).sum() < before
    assert len(notes) >= 9
