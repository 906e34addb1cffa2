"""The cuffs of a machine are found from the recorded identification of an arm, and its twin then has them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.laboratory.demo import run_demo
from exograv.laboratory.options import DemoOptions
from exograv.laboratory.virtual_laboratory import draw_laboratory, with_twin
from exograv.model.description import load_rig
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.machine_twin.fit_command import fit_and_write
from exograv.procedures.machine_twin.options import TwinFitOptions
from exograv.procedures.machine_twin.read_motions import ReadRecording
from exograv.procedures.machine_twin.recorded_columns import WornMotion
from exograv.procedures.machine_twin.worn_cuffs import WORN_LEAST_S, worn_cuffs
from exograv.rig.twin import Disturbances
from exograv.storage.twin_file import FittedCuffs, read_twin

RIG, SEED, GOOD = load_rig("recupera_like"), 1004, Disturbances.at_level(2)
SIGMAS = 3.0
"""Largest of two normalised errors: one in two hundred runs exceeds it."""

PRIOR_SHARE = 0.8
"""Largest standard deviation of a logarithm over that of the prior, for cuffs that a recording tells [-]."""


def arm_in(seconds: float, wearer: dict[str, object]) -> ReadRecording:
    """Return a recording of an arm that does not move, which tells nothing about its cuffs."""
    ticks, joints = round(1e3 * seconds), len(RIG.joints)
    q = np.tile(np.deg2rad(RIG.settings.donning.posture_deg), (ticks, 1))
    worn = WornMotion(wearer, 1e-3, q, np.zeros((ticks, joints)), ((0, ticks),))
    return ReadRecording(Path("worn.mcap"), (), "0", True, seconds, worn)


@dataclass(frozen=True)
class Found:
    """Cuffs of a simulated wearer, and the twin that was fitted."""

    stiffness: np.ndarray
    folder: Path
    cuffs: FittedCuffs


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Found:
    folder = tmp_path_factory.mktemp("cuffs")
    run_demo(DemoOptions(seed=SEED), folder, lambda _text, _share: None)
    recordings = (folder / "demo_calibration.mcap", folder / "demo.mcap")
    result = fit_and_write(TwinFitOptions(RIG.name, recordings), folder / "out")
    (cuffs,) = read_twin(load_rig(str(result.folder))).cuffs
    return Found(draw_laboratory(RIG.name, None, 2, SEED).wearer.cuffs.stiffness, result.folder, cuffs)


@pytest.mark.slow
def test_the_true_stiffness_is_within_the_interval_and_better_known_than_before(found: Found):
    cuff = RIG.settings.cuffs[0]
    across, _, along, others, _, limb = found.stiffness
    translation = np.log([across / (1e3 * cuff.across_N_per_mm), along / (1e3 * cuff.along_N_per_mm)])
    rotation = np.log(np.deg2rad([others, limb]) / [cuff.about_others_Nm_per_deg, cuff.about_limb_Nm_per_deg])
    # The estimator has one factor for both directions, so the truth is a range.
    for truth, value, sd in (
        (translation, found.cuffs.log_stiffness, found.cuffs.log_stiffness_sd),
        (rotation, found.cuffs.log_rotational_stiffness, found.cuffs.log_rotational_stiffness_sd),
    ):
        assert truth.min() - SIGMAS * sd < value < truth.max() + SIGMAS * sd
        assert sd < PRIOR_SHARE * 0.4


@pytest.mark.slow
def test_the_wearer_in_the_fitted_twin_has_cuffs_near_those_of_the_recording(found: Found):
    laboratory = draw_laboratory(str(found.folder), None, 2, 7)
    drawn = with_twin(laboratory, "fitted", GOOD, 7).wearer.cuffs.stiffness
    assert (np.abs(np.log(drawn / found.stiffness)) < 1.0).all()
    assert (drawn != laboratory.wearer.cuffs.stiffness).all()


def test_a_short_identification_tells_no_cuffs():
    machine = nominal_machine(RIG, draw_laboratory(RIG.name, None, 2, SEED).assembly().exo.phi)
    assert worn_cuffs(RIG, machine, [arm_in(0.9 * WORN_LEAST_S, {"height_m": 1.7})]) is None
    assert worn_cuffs(RIG, machine, []) is None


def test_an_identification_without_body_data_is_refused_with_what_is_missing():
    machine = nominal_machine(RIG, draw_laboratory(RIG.name, None, 2, SEED).assembly().exo.phi)
    with pytest.raises(RecordingError, match=r"worn.mcap.*states no mass_kg of the person"):
        worn_cuffs(RIG, machine, [arm_in(1.1 * WORN_LEAST_S, {"height_m": 1.7})])
