"""Rows of a virtual session keep the torque that control desired apart from the one that was commanded."""

import numpy as np

from exograv.campaigns.virtual_study.rows import TickRows
from exograv.loop.output_feedback import NoTorque
from exograv.signals import JointState, TorqueSource


def test_desired_and_commanded_torque_are_both_kept():
    rows, zero = TickRows(2), np.zeros(2)
    state = JointState(1.0, 7, zero, zero, zero, TorqueSource.CURRENT)
    rows.add(state, zero, zero, NoTorque(2), (np.array([20.0, -3.0]), np.array([15.0, -3.0])))
    rows.add(state, zero, zero, NoTorque(2), None)
    kept = rows._blocks[-1][:2]
    assert kept["tau_desired"].tolist() == [[20.0, -3.0], [0.0, 0.0]]
    assert kept["tau_commanded"].tolist() == [[15.0, -3.0], [0.0, 0.0]]
