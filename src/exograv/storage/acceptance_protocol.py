"""Protocol of an acceptance: parts with their steps, sealed by a hash against later changes."""

from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import AwareDatetime

from exograv.errors import ConfigError
from exograv.files import write_whole
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Settings

from .calibration_file import identity_of, refuse_other_machine
from .calibration_schema import Identity
from .sealed_file import Sealed, read_sealed, sealed, write_sealed
from .self_test_step import Step

FILE, PAGE = "acceptance.toml", "acceptance.md"
HEAD = """\
# The acceptance of one machine, written by `exograv rig accept` (docs/howto/accept.md). Do not edit: a
# changed file is refused. The signature on paper goes below the table of acceptance.md.
"""

MARKS: Mapping[bool, str] = {True: "passed", False: "FAILED"}
SIMULATED = "SIMULATED: machine and dummy exist in a simulation only."


class ProtocolStep(Settings):
    """Measured figure with its limit."""

    name: str
    passed: bool
    measured: str
    limit: str
    what_to_do: str


class ProtocolPart(Settings):
    """Part of the acceptance that has come to its end."""

    name: str
    at: AwareDatetime
    took_s: float
    recordings: str
    """Folder of the recordings."""
    steps: list[ProtocolStep]

    @property
    def passed(self) -> bool:
        """True if every step has passed."""
        return all(step.passed for step in self.steps)


class AcceptanceKey(Settings):
    """Files and machine that must be the same when an acceptance is resumed."""

    drives_sha256: str
    calibration_sha256: str
    dummy: str
    dummy_sha256: str
    code_sha256: str
    """Hash of the code of exograv."""
    is_simulated: bool


class AcceptanceRecord(Settings):
    """Operator, versions and state of an acceptance."""

    by: str
    begun: AwareDatetime
    written: AwareDatetime
    state: Literal["passed", "failed", "aborted"]
    aborted_at: str
    """Part that was interrupted; empty if none was."""
    versions: dict[str, str]


class AcceptanceProtocol(Sealed):
    """Content of the file `acceptance.toml`."""

    VERSION: ClassVar[int] = 1
    schema_version: Literal[1] = 1
    identity: Identity
    key: AcceptanceKey
    done: AcceptanceRecord
    parts: list[ProtocolPart]


def protocol_part(name: str, at: datetime, took_s: float, recordings: str, steps: list[Step]) -> ProtocolPart:
    """Return a finished part of the protocol."""
    lines = [
        ProtocolStep(
            name=one.name,
            passed=bool(one.passed),
            measured=_text(one.measured),
            limit=f"{_text(one.limit)} {one.unit}".strip(),
            what_to_do=one.what_to_do,
        )
        for one in steps
    ]
    return ProtocolPart(
        name=name, at=at.replace(microsecond=0), took_s=round(took_s, 1), recordings=recordings, steps=lines
    )


def write_protocol(folder: Path, whole: AcceptanceProtocol) -> AcceptanceProtocol:
    """Seal the protocol, and write it with its readable page.

    Raises:
        ConfigError: The protocol cannot be written.
        RecordingError: The page cannot be written.
    """
    whole = sealed(whole)
    write_sealed(folder / FILE, whole, HEAD, "--out")
    write_whole(folder / PAGE, protocol_page(whole))
    return whole


def read_protocol_of(path: Path, description: RigDescription, serial: str, again: str) -> AcceptanceProtocol:
    """Read the protocol of a machine. `again` is advice if it cannot be used.

    Raises:
        ConfigError: The protocol is missing, damaged, or of another machine.
    """
    if not path.is_file():
        raise ConfigError(f"{path} is missing: this machine was not accepted with a dummy arm. {again}")
    whole = read_sealed(path, AcceptanceProtocol, again, again)
    refuse_other_machine(path, whole.identity, identity_of(description, serial), again)
    return whole


def protocol_page(whole: AcceptanceProtocol) -> str:
    """Return the protocol as a page of Markdown, with a line for a signature."""
    identity, key, done = whole.identity, whole.key, whole.done
    lines = [f"# Acceptance of {identity.rig} ({identity.side}), serial {identity.machine}", ""]
    lines += [f"**{SIMULATED}**", ""] if key.is_simulated else []
    state = f"aborted in the part “{done.aborted_at}”" if done.aborted_at else done.state
    lines += [
        f"- Result: **{state}**",
        f"- Begun {done.begun:%Y-%m-%d %H:%M}, written {done.written:%Y-%m-%d %H:%M}, by {done.by or '–'}",
        f"- Dummy: {key.dummy}, file {key.dummy_sha256[:12]}…",
        f"- Machine {identity.rig_sha256[:12]}…, drives.toml {key.drives_sha256[:12] or 'simulated'}…, calibration "
        f"{key.calibration_sha256[:12]}…",
        f"- {', '.join(f'{name} {value[:20]}' for name, value in done.versions.items())}",
        f"- Seal {whole.content_sha256}",
    ]
    for part in whole.parts:
        lines += ["", f"## {part.name}: {MARKS[part.passed]}", "", f"{part.at:%Y-%m-%d %H:%M}, {part.took_s:.0f} s. "
                  f"{part.recordings}".strip(), "", "| step | measured | limit | |", "|---|---|---|---|"]  # fmt: skip
        lines += [f"| {one.name} | {one.measured} | {one.limit} | {MARKS[one.passed]} |" for one in part.steps]
        lines += ["", *(f"- {one.name}: {one.what_to_do}" for one in part.steps if one.what_to_do)]
    return "\n".join([*lines, "", "Date, name, signature: ______________________", ""])


def _text(value: float | str | None) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
