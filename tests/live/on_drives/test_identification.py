"""An identification on drives writes the file of the arm, and a fault in any run on drives locks the machine."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.identification.core.interface import Estimate, Outcome
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.arm_worker import LearnedArm
from exograv.live.guard_job import GuardReport, StopLatch
from exograv.live.live_figures import LiveFigures
from exograv.live.live_processes import LiveResult
from exograv.live.on_drives import identification
from exograv.live.on_drives.fault_lock import lock_after_fault
from exograv.live.on_drives.float_command import FlownOnDrives
from exograv.live.on_drives.identification import IdentifiedOnDrives, identify_on_drives
from exograv.live.options import PersonForm
from exograv.options import WornOptions
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.safety.stops import StopReason
from exograv.storage.participant_file import read_participant
from exograv.storage.sealed_file import read_sealed
from exograv.storage.self_test_pass import MachineKey, SelfTestPass, write_pass

SEED = 1002
SERIAL = "serial 7"

Identify = Callable[..., IdentifiedOnDrives]


@pytest.fixture
def identify(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Identify:
    """Return a function that identifies with a run that has already learned the arm."""
    laboratory = draw_laboratory("recupera_like", None, 0, SEED)
    prepared = ideal_knowledge(laboratory, 0.0)
    moved = list[float]()

    def run(files: ParticipantOptions, outcome: Outcome = Outcome.CONVERGED, seconds: float = 60.0) -> Any:
        def fly(live: Any, *_: object) -> Any:
            moved.append(live.identify_s)
            estimate = Estimate(live.identify_s, prepared.x, np.eye(len(prepared.x)), 0.0, 1.0)
            learned = Mock(spec=LearnedArm, estimate=estimate, outcome=outcome)
            flown = Mock(spec=LiveResult, learned=learned, predicted=np.full(4, 0.1))
            figures, told = Mock(spec=LiveFigures), {"prepared": prepared, "body": laboratory.body, "serial": SERIAL}
            return Mock(spec=FlownOnDrives, flown=flown, figures=figures, **told)

        monkeypatch.setattr(identification, "fly_on_drives", fly)
        worn = WornOptions(drives=Path("drives.toml"))
        return identify_on_drives(
            worn, seconds, files, PersonForm(), tmp_path, lambda *_: None, lambda _: None
        )  # fmt: skip

    run.moved = moved  # type: ignore[attr-defined]
    return run


def test_an_arm_is_kept_under_its_code_and_counts_its_donnings(identify: Identify, tmp_path: Path):
    first, second = tmp_path / "first.toml", tmp_path / "second.toml"
    kept = identify(ParticipantOptions(keep=first, code="P-07")).person
    assert isinstance(kept, KeptParticipant)
    assert (kept.code, kept.donnings) == ("P-07", 1)
    again = identify(ParticipantOptions(keep=second, participant=first))
    assert again.ok
    assert again.from_file
    stored = read_participant(second)
    assert (stored.person.code, stored.identified.donnings, stored.machine.machine) == ("P-07", 2, SERIAL)
    assert identify.moved == [60.0, FROM_FILE_S]  # type: ignore[attr-defined]


def test_an_arm_that_did_not_relax_is_not_kept_and_the_command_fails(identify: Identify, tmp_path: Path):
    found = identify(ParticipantOptions(keep=tmp_path / "arm.toml"), Outcome.NOT_RELAXED)
    assert isinstance(found.person, NotKept)
    assert found.person.why == f"Not kept. {Outcome.NOT_RELAXED.value}"
    assert not found.ok
    assert not (tmp_path / "arm.toml").exists()


def test_a_motion_that_is_too_short_for_drives_is_refused(identify: Identify):
    with pytest.raises(ConfigError, match=r"--seconds is 5; allowed on drives: 10 to 600 s\."):
        identify(ParticipantOptions(), seconds=5.0)


@pytest.mark.parametrize(
    ("causes", "failure", "locks"),
    [
        ([], "", ""),
        ([StopReason.STOP_PRESSED], "", ""),
        ([StopReason.DRIVE_FAULT], "", StopReason.DRIVE_FAULT.value),
        ([StopReason.STOP_PRESSED, StopReason.TOO_FAST], "", StopReason.TOO_FAST.value),
        ([], "The guard had an internal error.", "The guard had an internal error."),
    ],
)
def test_a_fault_withdraws_the_pass_and_stop_does_not(
    causes: list[StopReason], failure: str, locks: str, tmp_path: Path
):
    description = draw_laboratory("recupera_like", None, 0, SEED).description
    key = MachineKey(tmp_path / "self_test.toml", description, SERIAL, "a" * 64)
    write_pass(key, datetime.now(UTC))
    latches = tuple(StopLatch(one.value, 1, 0.001) for one in causes)
    report = Mock(spec=GuardReport, latches=latches, failure=failure)
    assert lock_after_fault(key, report) == locks
    assert read_sealed(key.file, SelfTestPass, "", "").withdrawn.cause == locks
