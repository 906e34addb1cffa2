"""Each procedure over drives starts from the stored arm of a person, by the rules of a session."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from exograv import cli
from exograv.cli.shell.command import command_class, options_of
from exograv.errors import ConfigError
from exograv.identification.core.interface import Estimate, Outcome
from exograv.identification.core.prior import prior
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.arm_worker import LearnedArm
from exograv.live.live_processes import LiveResult
from exograv.live.on_drives.arm_files import arm_of_session, keep_flown, stored_arm
from exograv.live.on_drives.float_command import float_on_drives
from exograv.live.on_drives.guided import ROOM_RAD, bring_inside, run_repeat_on_drives, run_teach_on_drives
from exograv.live.on_drives.mirror import run_mirror_on_drives
from exograv.live.on_drives.support_level import run_support_level_on_drives
from exograv.live.on_drives.verification import run_verification_on_drives
from exograv.live.on_drives.weighing import run_weighing_on_drives
from exograv.live.options import LiveOptions, ReturningPerson
from exograv.loop.moved_machine import MovedMachine
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.options import MachineOptions
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import (
    KeptParticipant,
    NotKept,
    ParticipantRun,
    motion_needed_s,
    stored_person,
)
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.procedures.rehabilitation.guided.options import GuidedOptions, MirrorOptions, RepeatOptions
from exograv.procedures.rehabilitation.guided.path_shaping import allowed_range
from exograv.procedures.rehabilitation.support_level.options import SupportOptions
from exograv.procedures.verification.options import VerifyOptions
from exograv.procedures.weighing.options import WeighOptions
from exograv.storage.participant_file import read_participant, write_participant
from exograv.storage.participant_schema import Identified, StoredParticipant, StoredPerson

SEED, SERIAL = 1002, "serial 7"
DRIVES = Path("drives.toml")
LABORATORY = draw_laboratory("recupera_like", None, 0, SEED)
PREPARED = ideal_knowledge(LABORATORY, 0.0)

BY_CODE = {
    "arm verify", "arm weigh", "run assist", "run console", "run live", "run mirror", "run repeat", "run support-level",
    "run teach", "run train",
}  # fmt: skip


def quiet(*_: object) -> None:
    """Show nothing."""


def stored(code: str = "P-07", outcome: Outcome = Outcome.CONVERGED) -> StoredParticipant:
    """Return the content of a file of the arm of the table."""
    assembly = PREPARED.assembly
    identified = Identified(
        at_utc=datetime(2026, 1, 1, tzinfo=UTC), donnings=1, method="recursive", prior_sha256="", motion="designed",
        motion_s=60.0, calibration_sha256="", outcome=outcome.value, predicted_left_over_Nm=[],
        held_out_error_Nm=[], held_out_s=0.0,
    )  # fmt: skip
    person = StoredPerson.of(code, LABORATORY.body)
    return stored_person(person, assembly, SERIAL, identified, prior(assembly, PREPARED.machine))


def test_every_command_over_drives_that_needs_an_arm_takes_a_stored_one_by_its_code():
    takers = {
        path
        for path, action in cli.ACTIONS.items()
        if {"participant", "participants", "drives"} <= {one.field for one in options_of(command_class(action))}
    }
    assert takers - {"next"} == BY_CODE


PERSON = ReturningPerson(participant="P-07")
COMMANDS: dict[str, Callable[[Path], Any]] = {
    "run live": lambda folder: float_on_drives(LiveOptions(drives=DRIVES), PERSON, folder, quiet, quiet),
    "arm weigh": lambda folder: run_weighing_on_drives(WeighOptions(drives=DRIVES), PERSON, folder, quiet, quiet),
    "arm verify": lambda folder: run_verification_on_drives(VerifyOptions(drives=DRIVES), PERSON, folder, quiet, quiet),
    "run teach": lambda folder: run_teach_on_drives(
        GuidedOptions(drives=DRIVES), folder / "path.toml", "", PERSON, folder, quiet, quiet
    ),
    "run repeat": lambda folder: run_repeat_on_drives(
        RepeatOptions(drives=DRIVES), folder / "path.toml", None, PERSON, folder, quiet, quiet
    ),
    "run mirror": lambda folder: run_mirror_on_drives(MirrorOptions(drives=DRIVES), PERSON, folder, quiet, quiet),
    "run support-level": lambda folder: run_support_level_on_drives(
        SupportOptions(drives=DRIVES), PERSON, folder, quiet, quiet
    ),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_a_person_without_a_stored_arm_is_refused_with_the_command_that_stores_it(command: str, tmp_path: Path):
    with pytest.raises(ConfigError, match=r"There is no stored arm of P-07: .*P-07\.toml is missing\.") as refused:
        COMMANDS[command](tmp_path)
    assert "`exograv arm identify" in str(refused.value)
    assert "P-07.toml --code P-07 --body-height M --body-mass KG --sex female`" in str(refused.value)


def test_simulated_drives_bring_their_own_form(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"P-07\.toml --code P-07`"):
        stored_arm(PERSON, MachineOptions(simulate=True), tmp_path)


def test_a_file_of_another_code_is_refused(tmp_path: Path):
    write_participant(tmp_path / "participants" / "P-07.toml", stored("P-08"))
    with pytest.raises(ConfigError, match=r"P-07\.toml holds the arm of 'P-08', not of 'P-07'\."):
        stored_arm(PERSON, MachineOptions(simulate=True), tmp_path)


def test_a_person_without_a_code_has_no_file_and_a_first_session_writes_one(tmp_path: Path):
    assert stored_arm(ReturningPerson(), MachineOptions(simulate=True), tmp_path) == ParticipantOptions()
    file = tmp_path / "participants" / "P-07.toml"
    assert arm_of_session("P-07", None, tmp_path) == ParticipantOptions(keep=file, code="P-07")
    write_participant(file, stored())
    again = ParticipantOptions(keep=file, code="P-07", participant=file)
    assert arm_of_session("P-07", None, tmp_path) == again
    assert stored_arm(PERSON, MachineOptions(simulate=True), tmp_path) == again


def test_only_a_stored_arm_that_agreed_with_its_check_needs_a_short_motion():
    assert motion_needed_s(None, 45.0) == 45.0
    assert motion_needed_s(stored(), 45.0) == FROM_FILE_S
    assert motion_needed_s(stored(outcome=Outcome.DISAGREES), 45.0) == 45.0


def flown(outcome: Outcome) -> LiveResult:
    estimate = Estimate(FROM_FILE_S, PREPARED.x, np.eye(len(PREPARED.x)), 0.0, 1.0)
    learned = Mock(spec=LearnedArm, estimate=estimate, outcome=outcome)
    return Mock(spec=LiveResult, learned=learned, predicted=np.full(4, 0.1))


def run_of(files: ParticipantOptions) -> ParticipantRun:
    return ParticipantRun(files, PREPARED.assembly, SERIAL, LABORATORY.body, stored().identified.at_utc)


def test_the_arm_of_a_flight_is_kept_under_its_code_and_counts_its_donnings(tmp_path: Path):
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    kept = keep_flown(run_of(ParticipantOptions(keep=first, code="P-07")), PREPARED, flown(Outcome.CONVERGED))
    assert isinstance(kept, KeptParticipant)
    assert (kept.code, kept.donnings) == ("P-07", 1)
    write_participant(first, stored())
    keep_flown(run_of(ParticipantOptions(keep=second, participant=first)), PREPARED, flown(Outcome.CONVERGED))
    again = read_participant(second)
    assert (again.person.code, again.identified.donnings, again.machine.machine) == ("P-07", 2, SERIAL)


def test_an_arm_that_did_not_relax_leaves_its_file_as_it_was(tmp_path: Path):
    file = tmp_path / "arm.toml"
    write_participant(file, stored())
    before = file.read_bytes()
    kept = keep_flown(run_of(ParticipantOptions.of_file(file, "P-07")), PREPARED, flown(Outcome.NOT_RELAXED))
    assert isinstance(kept, NotKept)
    assert kept.why == f"Not kept. {Outcome.NOT_RELAXED.value}"
    assert file.read_bytes() == before


def test_without_a_request_no_file_is_written():
    assert keep_flown(run_of(ParticipantOptions()), PREPARED, flown(Outcome.CONVERGED)) is None


@pytest.mark.parametrize("is_outside", [False, True])
def test_an_arm_outside_the_range_of_a_path_is_brought_inside_before_it_is_led(is_outside: bool):
    description = load_rig("recupera_like")
    lower, upper = allowed_range(description, read_exoskeleton(description))
    q = 0.5 * (lower + upper)
    q[2] = lower[2] - 0.1 if is_outside else q[2]
    machine = Mock(spec=MovedMachine, q=q, period_s=0.004)
    bring_inside(machine, description)
    if not is_outside:
        assert machine.method_calls == []
        return
    assert [call[0] for call in machine.method_calls] == ["lead", "follow", "let_float"]
    way = machine.follow.call_args.args[0]
    at = np.array([way.at(k)[0] for k in range(len(way))])
    assert (np.diff(at[:, 2]) >= 0.0).all()
    assert ((at[-1] >= lower + ROOM_RAD - 1e-9) & (at[-1] <= upper - ROOM_RAD + 1e-9)).all()
