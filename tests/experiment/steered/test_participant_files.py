"""An arm from rests is written into its own person's file only, and counts one donning."""

from pathlib import Path

import pytest

from exograv.errors import ConfigError
from exograv.experiment.steered.participants import ParticipantFiles
from exograv.identification.core.interface import Outcome
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.wearer_form import WearerForm
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.participant_session import KeptParticipant
from exograv.storage.participant_file import read_participant
from exograv.storage.session_checkpoint import CheckedArm, KeptArm

DESCRIPTION = load_rig("recupera_like")
MACHINE = nominal_machine(DESCRIPTION, read_exoskeleton(DESCRIPTION).phi)


def files(folder: Path | None, height_m: float = 1.7) -> ParticipantFiles:
    body = Body(height_m, 70.0, "female", {})
    return ParticipantFiles(assemble(DESCRIPTION, body), WearerForm(body, {}), 0.001, "serial", folder)


def learned(people: ParticipantFiles, motion_s: float, stated_Nm: float) -> CheckedArm:
    mean, covariance = prior(people.assembly, MACHINE)
    arm = KeptArm.of(mean * (1.0 + 1e-3 * motion_s), covariance)
    return CheckedArm(
        **arm.model_dump(), motion_s=motion_s, outcome=Outcome.CONVERGED.value,
        predicted_left_over_Nm=[stated_Nm] * 4, held_out_error_Nm=[0.2] * 4, held_out_s=9.0,
    )  # fmt: skip


def test_the_rests_of_one_donning_write_one_file_with_a_code(tmp_path: Path):
    people = files(tmp_path / "people")
    first = people.keep_rests(MACHINE, None, learned(people, 10.0, 0.2), False)
    assert isinstance(first, KeptParticipant)
    people.keep_rests(MACHINE, first.code, learned(people, 20.0, 0.1), True)
    whole = read_participant(tmp_path / "people" / f"{first.code}.toml")
    assert people.codes == (first.code,)
    assert (whole.identified.donnings, whole.identified.motion, whole.identified.motion_s) == (1, "rests", 20.0)
    people.keep_rests(MACHINE, first.code, learned(people, 30.0, 0.3), False)
    assert read_participant(first.file).identified.donnings == 2


def test_the_file_of_another_person_is_refused_and_stays(tmp_path: Path):
    other, people = files(tmp_path, height_m=1.9), files(tmp_path)
    kept = other.keep_rests(MACHINE, "P-07", learned(other, 10.0, 0.2), False)
    assert isinstance(kept, KeptParticipant)
    before = kept.file.read_bytes()
    with pytest.raises(ConfigError, match="another person"):
        people.keep_rests(MACHINE, "P-07", learned(people, 20.0, 0.1), False)
    assert kept.file.read_bytes() == before


def test_without_a_folder_no_file_is_written():
    people = files(None)
    assert people.keep_rests(MACHINE, "P-07", learned(people, 10.0, 0.2), False) is None
