"""The recording of a calibration over simulated drives in another process gives the machine's twin."""

from pathlib import Path

import numpy as np
import pytest
from tests.foreign_machines import ELBOW, ONE_JOINT, answered, written

from exograv.api.rig_factory import run_calibration
from exograv.laboratory.calibration_command import truth_of_machine
from exograv.model.description import load_rig
from exograv.procedures.calibration.options import CalibrateOptions
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import NewRigOptions
from exograv.procedures.machine_twin.fit_command import fit_and_write
from exograv.procedures.machine_twin.options import TwinFitOptions
from exograv.procedures.machine_twin.read_motions import read_motions
from exograv.storage.twin_file import read_twin

SIGMAS = 4.0
"""Normalised error that no value of some ten exceeds in a thousand runs."""


@pytest.mark.slow
@pytest.mark.parametrize("simulate", [True, False], ids=["over drives", "on the twin"])
def test_the_twin_of_the_recording_has_the_machines_gain_and_friction(simulate: bool, tmp_path: Path):
    found = new_rig(NewRigOptions(written(tmp_path, ONE_JOINT), tmp_path / "mine", side="right"))
    answered(found.folder, ELBOW)
    rig, path = str(found.folder), tmp_path / "calibration.mcap"
    result = run_calibration(CalibrateOptions(rig, simulate=simulate, recording=path), tmp_path, lambda *_: None)
    description = load_rig(rig)
    (recording,) = read_motions(description, [path], {}, is_torque=False)
    assert recording.is_simulated
    assert recording.seconds > 0.9 * result.simulated_s
    weighed = np.concatenate([motion.hung for motion in recording.motions])
    assert {round(float(row.sum()), 3) for row in weighed[np.isfinite(weighed).all(axis=1)]} >= {0.0, 1.0}

    twin = read_twin(load_rig(str(fit_and_write(TwinFitOptions(rig, (path,)), tmp_path / "out").folder)))
    truth = truth_of_machine(description, 2, 0)(result.simulated_s)
    joint = twin.joints[0]
    assert abs(joint.gain_Nm_per_A - truth.gain[0]) < SIGMAS * joint.gain_sd_Nm_per_A
    assert abs(joint.coulomb_Nm - truth.friction["coulomb"][0]) < SIGMAS * joint.coulomb_sd_Nm
