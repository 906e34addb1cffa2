"""Sheet of a bring-up: steps, results and operator, sealed by a hash against later changes."""

from datetime import datetime
from pathlib import Path
from typing import Any, ClassVar, Literal

from pydantic import AwareDatetime

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Settings
from exograv.rig.drives.settings import Drives

from .calibration_file import identity_of, refuse_other_machine
from .calibration_schema import Identity
from .sealed_file import Sealed, read_sealed, sealed, write_sealed
from .self_test_step import Step

FILE = "rig_test.toml"
HEAD = """\
# The bring-up of one machine, written by `exograv rig test` (docs/howto/rig_test.md). Do not edit: a changed
# file is refused. The signature on paper goes below the printed table.
"""


class SheetLine(Settings):
    """Step of the bring-up with its result."""

    name: str
    passed: bool
    value: str
    limit: str


class BringUpRecord(Settings):
    """Time, operator and drives of the bring-up."""

    at: AwareDatetime
    by: str
    drives_sha256: str
    passed: bool
    is_simulated: bool
    interrupted_at: str = ""
    """Step at which the operator interrupted the bring-up; empty if it came to its end. New in version 2."""


class BringUpSheet(Sealed):
    """Content of the file `rig_test.toml`."""

    VERSION: ClassVar[int] = 2
    OLDER: ClassVar[tuple[int, ...]] = (1,)
    schema_version: Literal[1, 2]
    identity: Identity
    done: BringUpRecord
    steps: list[SheetLine]

    def _sealed_values(self) -> dict[str, Any]:
        content = super()._sealed_values()
        if self.schema_version == 1:
            del content["done"]["interrupted_at"]
        return content


def write_sheet(
    path: Path,
    description: RigDescription,
    drives: Drives,
    steps: list[Step],
    by: str,
    at: datetime,
    simulated: bool,
    interrupted_at: str = "",
) -> BringUpSheet:
    """Write the sheet of a bring-up, passed, failed, or interrupted at a step.

    Raises:
        ConfigError: The file cannot be written.
    """
    tried = [step for step in steps if step.passed is not None]
    lines = [
        SheetLine(
            name=one.name, passed=bool(one.passed), value=_text(one.measured), limit=f"{_text(one.limit)} {one.unit}"
        )
        for one in tried
    ]
    passed = not interrupted_at and len(tried) == len(steps) and all(step.passed or step.locks_only for step in steps)
    done = BringUpRecord(
        at=at.replace(microsecond=0),
        by=by,
        drives_sha256=drives.sha256,
        passed=passed,
        is_simulated=simulated,
        interrupted_at=interrupted_at,
    )
    whole = sealed(
        BringUpSheet(
            schema_version=2, identity=identity_of(description, drives.settings.serial), done=done, steps=lines
        )
    )
    write_sealed(path, whole, HEAD, "--out")
    return whole


def passed_sheet(path: Path, description: RigDescription, drives: Drives, bring_up: str) -> BringUpSheet:
    """Return the sheet of a real machine whose bring-up with these drives has passed. `bring_up` is its command.

    Raises:
        ConfigError: The bring-up has not passed, or the sheet is damaged or of another machine.
    """
    again = f"Bring the machine up first: `{bring_up}`."
    if not path.is_file():
        raise ConfigError(f"{path} is missing: no bring-up of this machine has passed. {again}")
    whole = read_sealed(path, BringUpSheet, again, again)
    refuse_other_machine(path, whole.identity, identity_of(description, drives.settings.serial), again)
    why = ""
    if whole.done.is_simulated:
        why = "was made with simulated drives"
    elif whole.done.interrupted_at:
        why = f"was interrupted at the step “{whole.done.interrupted_at}”"
    elif not whole.done.passed:
        why = "has steps that failed"
    elif whole.done.drives_sha256 != drives.sha256:
        why = "belongs to another drives.toml, or the file was changed since"
    if why:
        raise ConfigError(f"{path} {why}. {again}")
    return whole


def _text(value: float | str | None) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
