"""An identification on drives writes the file of the arm, and a fault in any run on drives locks the machine."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from unittest.mock import Mock

import pytest

from exograv.errors import ConfigError
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.live.guard_job import GuardReport, StopLatch
from exograv.live.on_drives.fault_lock import lock_after_fault
from exograv.live.on_drives.identification import IdentifiedOnDrives, identify_on_drives
from exograv.live.options import PersonForm
from exograv.options import WornOptions
from exograv.procedures.identification.options import ParticipantOptions
from exograv.safety.stops import StopReason
from exograv.storage.sealed_file import read_sealed
from exograv.storage.self_test_pass import MachineKey, SelfTestPass, write_pass

SEED = 1002
SERIAL = "serial 7"

Identify = Callable[..., IdentifiedOnDrives]


def test_a_motion_that_is_too_short_for_drives_is_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"--seconds is 5; allowed on drives: 10 to 600 s\."):
        identify_on_drives(
            WornOptions(drives=Path("drives.toml")), 5.0, ParticipantOptions(), PersonForm(), tmp_path,
            lambda *_: None, lambda _: None,
        )  # fmt: skip


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
