"""The weak feedback that moves an arm does not ring with delay, slow drives and soft cuffs."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from exograv import motion
from exograv.procedures.identification.identify import identification_motion

RINGS_Hz = (7.0, 25.0)
"""Band of the ringing: it was at 13.5 Hz, far above the motion's 1 Hz."""

RINGING_MAX_RAD_S = 0.15
"""Largest RMS in this band. Friction, noise and a restless wearer make 0.05. An elbow with gains 40 and 1.5 exceeds

    it; with 2.5 it has 0.5.
"""

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("seed", [1000, 1001])
def test_a_quasi_direct_machine_moves_an_arm_at_level_4_without_ringing(put_on, seed: int):
    worn = put_on(4, seed, "recupera_like_qdd")
    pilot, speeds, dt = worn.pilot, list[np.ndarray](), worn.twin.period_s
    path = identification_motion(worn.controller.assembly, 8.0, dt)
    worn.controller.mode.drive = 1.0
    pilot.run(worn.controller, motion.go_to(pilot.q, path.q[0], 0.6, dt), "Moving to the start")
    pilot.run(worn.controller, path, "Moving", lambda moment: speeds.append(moment.v.copy()))
    ringing = sosfiltfilt(butter(3, RINGS_Hz, "band", fs=1.0 / dt, output="sos"), np.array(speeds), axis=0)
    assert ringing.std(axis=0).max() < RINGING_MAX_RAD_S
