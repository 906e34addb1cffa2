"""Lock of a real machine: an arm is carried only if the self-test has passed on this machine and computer, today."""

import platform
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import AwareDatetime

from exograv.errors import RigError
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Settings
from exograv.rig import Rig, may_be_worn
from exograv.safety.native import library

from .calibration_file import identity_of, refuse_other_machine
from .calibration_schema import Identity
from .sealed_file import Sealed, read_sealed, sealed, write_sealed

FILE = "self_test.toml"
NOT_NEEDED = "not needed: twin"
TEST = "exograv rig self-test"
"""Command that tests a machine, if the options of this machine are not known."""
NO_PASS = "The machine is locked: no self-test has passed here."
HEAD = """\
# A self-test that has passed, written by `exograv rig self-test` (docs/explanation/safety.md). It unlocks this machine
# on this computer until midnight. Do not edit: a changed file is refused.
"""


class PassRecord(Settings):
    """Time, computer and calibration of a passed self-test."""

    at: AwareDatetime
    """Local time with its zone; the pass counts on this date."""

    host: str
    calibration_sha256: str
    arm_weighed: bool
    """True if the worn part of the self-test was run too."""


class PassWithdrawal(Settings):
    """Cause for which a passed self-test no longer counts; empty if it was not withdrawn."""

    cause: str = ""


class SelfTestPass(Sealed):
    """Content of the file `self_test.toml`."""

    VERSION: ClassVar[int] = 1
    schema_version: Literal[1]
    identity: Identity
    passing: PassRecord
    withdrawn: PassWithdrawal = PassWithdrawal()


@dataclass(frozen=True)
class MachineKey:
    """Machine to unlock, and the file of its passed self-test."""

    file: Path
    description: RigDescription
    machine: str
    """Serial number of the machine."""

    calibration_sha256: str
    """Hash of the calibration that the session uses."""

    host: str = platform.node()

    test: str = TEST
    """Command that tests this machine, for the advice in a message."""

    @property
    def again(self) -> str:
        """Advice for a locked machine."""
        return _again(self.test)


def write_pass(key: MachineKey, now: datetime, arm_weighed: bool = False) -> None:
    """Write that the self-test has passed; `now` knows its time zone.

    Raises:
        ConfigError: The file cannot be written.
    """
    passing = PassRecord(
        at=now.replace(microsecond=0),
        host=key.host,
        calibration_sha256=key.calibration_sha256,
        arm_weighed=arm_weighed,
    )
    identity = identity_of(key.description, key.machine)
    whole = SelfTestPass(schema_version=1, identity=identity, passing=passing)
    write_sealed(key.file, sealed(whole), HEAD, "--out")


def withdraw_pass(file: Path, cause: str) -> None:
    """Lock the machine until a self-test passes again, after a latched fault or a failed self-test.

    Raises:
        ConfigError: The file is damaged, or cannot be written.
    """
    if not file.exists():
        return
    whole = read_sealed(file, SelfTestPass, _again(TEST), _again(TEST))
    changed = whole.model_copy(update={"withdrawn": PassWithdrawal(cause=cause)})
    write_sealed(file, sealed(changed), HEAD, "--out")


def unlock(rig: Rig, key: MachineKey | None, now: datetime | None = None) -> str:
    """Check that an arm may be carried, and return a note for the figures.

    Args:
        rig: Rig that carries the arm.
        key: Key of a real machine; None for a twin.
        now: Local time; None for the present moment.

    Raises:
        ConfigError: The file is damaged, or of another machine.
        RigError: No valid self-test has passed, and the machine stays locked.
    """
    if not may_be_worn(rig):
        return NOT_NEEDED
    if library.LIBRARY is None:
        raise RigError(f"The machine is locked: {library.NOT_COMPILED}")
    if key is None:
        raise RigError(f"{NO_PASS} {_again(TEST)}")
    return f"passed at {valid_pass(key, now or datetime.now().astimezone()).passing.at.isoformat()}"


def valid_pass(key: MachineKey, now: datetime) -> SelfTestPass:
    """Return the pass that unlocks this machine at the local time `now`.

    Raises:
        ConfigError: The file is damaged, or of another machine.
        RigError: No valid self-test has passed.
    """
    if not key.file.is_file():
        raise RigError(f"{NO_PASS} {key.again}")
    whole = read_sealed(key.file, SelfTestPass, key.again, key.again)
    refuse_other_machine(key.file, whole.identity, identity_of(key.description, key.machine), key.again)
    _refuse_old(whole, key, now)
    return whole


def _refuse_old(whole: SelfTestPass, key: MachineKey, now: datetime) -> None:
    passing, why = whole.passing, ""
    if whole.withdrawn.cause:
        why = f"since its self-test a fault has stopped it ({whole.withdrawn.cause})"
    elif passing.host != key.host:
        why = f"its self-test passed on the computer '{passing.host}', and this is '{key.host}'"
    elif passing.calibration_sha256 != key.calibration_sha256:
        why = "it was calibrated again after its self-test"
    elif passing.at.astimezone(now.tzinfo).date() != now.date():
        why = f"its self-test passed on {passing.at:%Y-%m-%d}, and today is {now:%Y-%m-%d}"
    elif passing.at > now:
        why = f"its self-test is from the future ({passing.at:%H:%M}, now it is {now:%H:%M})"
    if why:
        raise RigError(f"The machine is locked: {why}. {key.again}")


def _again(test: str) -> str:
    return f"Run `{test}`, with nobody in the machine."
