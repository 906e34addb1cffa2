"""The lock of a real machine: an arm is carried only where the self-test has passed on this machine, here, today."""

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

from .calibration_file import identity_of, refuse_other_machine
from .calibration_schema import Identity
from .sealed_file import Sealed, read_sealed, sealed, write_sealed

FILE = "self_test.toml"
NOT_NEEDED = "not needed: twin"
AGAIN = "Run `exograv self-test`, with nobody in the machine."
HEAD = """\
# A self-test that has passed, written by `exograv self-test` (docs/safety.md). It unlocks this machine on this computer
# until midnight. Do not edit: content_sha256 seals the values, and a changed file is refused.
"""


class PassRecord(Settings):
    """When and where it passed."""

    at: AwareDatetime
    """By the clock on the wall here: its date is the day on which it counts."""

    host: str
    calibration_sha256: str
    arm_weighed: bool
    """Whether the worn part was done too."""


class PassWithdrawal(Settings):
    """What has happened since; empty where nothing has."""

    cause: str = ""


class SelfTestPass(Sealed):
    """The whole file."""

    VERSION: ClassVar[int] = 1
    schema_version: Literal[1]
    identity: Identity
    passing: PassRecord
    withdrawn: PassWithdrawal = PassWithdrawal()


@dataclass(frozen=True)
class MachineKey:
    """Which machine somebody wants to unlock, and where its passed self-test should be."""

    file: Path
    description: RigDescription
    machine: str
    """Serial number."""

    calibration_sha256: str
    """Of the calibration that it will be flown with."""

    host: str = platform.node()


def write_pass(key: MachineKey, now: datetime, arm_weighed: bool = False) -> None:
    """Keep that the self-test has passed; `now` is aware of its zone.

    Raises:
        ConfigError: The place cannot be written.
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
    """A fault has latched, or a later self-test has failed: the machine is locked until one passes again.

    Raises:
        ConfigError: The file is damaged, or cannot be written.
    """
    if not file.exists():
        return
    whole = read_sealed(file, SelfTestPass, AGAIN, AGAIN)
    changed = whole.model_copy(update={"withdrawn": PassWithdrawal(cause=cause)})
    write_sealed(file, sealed(changed), HEAD, "--out")


def unlock(rig: Rig, key: MachineKey | None, now: datetime | None = None) -> str:
    """Ask before an arm is carried; what to note in the figures.

    Args:
        rig: That somebody is to be in.
        key: Of a real machine.
        now: On the wall here; this moment where absent.

    Raises:
        ConfigError: The file is damaged, or of another machine.
        RigError: The machine stays locked.
    """
    if not may_be_worn(rig):
        return NOT_NEEDED
    if key is None or not key.file.is_file():
        raise RigError(f"The machine is locked: no self-test has passed here. {AGAIN}")
    whole = read_sealed(key.file, SelfTestPass, AGAIN, AGAIN)
    refuse_other_machine(key.file, whole.identity, identity_of(key.description, key.machine), AGAIN)
    _refuse_old(whole, key, now or datetime.now().astimezone())
    return f"passed at {whole.passing.at.isoformat()}"


def _refuse_old(whole: SelfTestPass, key: MachineKey, now: datetime) -> None:
    passing, why = whole.passing, ""
    if whole.withdrawn.cause:
        why = f"since its self-test a fault has stopped it ({whole.withdrawn.cause})"
    elif passing.host != key.host:
        why = f"its self-test has passed on the computer '{passing.host}', and this is '{key.host}'"
    elif passing.calibration_sha256 != key.calibration_sha256:
        why = "it was calibrated again after its self-test"
    elif passing.at.astimezone(now.tzinfo).date() != now.date():
        why = f"its self-test passed on {passing.at:%Y-%m-%d}, and today is {now:%Y-%m-%d}"
    elif passing.at > now:
        why = f"its self-test is from the future ({passing.at:%H:%M}, now it is {now:%H:%M})"
    if why:
        raise RigError(f"The machine is locked: {why}. {AGAIN}")
