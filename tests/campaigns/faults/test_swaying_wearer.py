"""The wearer of a fault flight pushes the arm, and does not push its shoulder angles apart at their pole."""

import numpy as np
import pytest

from exograv.campaigns.faults.fault_plant import poles_of, weaken_near_poles
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.rig.twin import Truth


@pytest.mark.parametrize(
    ("abduction_deg", "share"), [(0.0, 1.0), (59.0, 1.0), (-30.0, 1.0), (89.9, 0.0), (90.0, 0.0), (75.0, 0.268)]
)
def test_muscles_act_in_full_away_from_the_pole_and_not_on_flexion_and_rotation_at_it(
    abduction_deg: float, share: float
):
    laboratory, still = draw_laboratory("recupera_like", None, 2, 1000), np.zeros(4)
    q_arm = np.array([0.3, np.deg2rad(abduction_deg), 0.2, 1.0])
    truth = Truth(laboratory.machine, laboratory.wearer, still, still, q_arm, still, still, still)
    tau = np.ones(4)
    weaken_near_poles(tau, q_arm, poles_of(truth))
    assert tau == pytest.approx([share, 1.0, share, 1.0], abs=1e-3)
