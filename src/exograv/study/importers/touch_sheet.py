"""CSV of touches of one or several people, cut into sessions. Each session keeps its lines unchanged."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from exograv.errors import RecordingError

from .csv_cells import CsvSheet, read_sheet
from .imported_session import Imported, StatedSession
from .touch_rows import (
    COLUMNS,
    DEVIATION,
    NEEDED,
    TARGET,
    WHO,
    UnusableError,
    session_of_touches,
    touch_row,
    windows_of_touches,
)

PROTOCOL = re.compile(r"[A-Za-z0-9_-]{1,40}")

NOT_KNOWN = (
    "Imported from touches alone: each window lasts from its first touch to its last. Completeness of windows and "
    "protocol is not known."
)


@dataclass
class SheetPart:
    """Lines of one session."""

    said: StatedSession
    content: bytes
    """Header and usable lines of this session, byte for byte. The other lines might hold a name."""

    touches: list[dict[str, Any]] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    seen: set[tuple[str, int]] = field(default_factory=set)
    """Page and sequence number of the touches that were read, to find repeated ones."""

    def imported(self) -> Imported:
        """Return the session in the form of all importers."""
        windows = windows_of_touches(self.touches)
        session = session_of_touches("csv", windows, self.touches)
        session["remark"] = NOT_KNOWN
        return Imported(session, windows, self.touches, self.said, refusals=self.refusals)


def cut_sheet(
    content: bytes, told: StatedSession, gravity_level: float | None, code_of: Callable[[str], str | None]
) -> tuple[list[SheetPart], list[str]]:
    """Return the sessions in the order of their first lines, and the lines that belong to no session.

    Args:
        content: Bytes of the file.
        told: Statements that hold for all lines; a column with the same meaning has to agree.
        gravity_level: Felt share of the arm's weight, for lines without one.
        code_of: Code of the study for a cell of `participant`; None if the study has no such participant.

    Raises:
        RecordingError: Columns are missing or unknown, or no line can be used.
    """
    sheet = read_sheet(content, COLUMNS)
    _refuse_columns(sheet, told, gravity_level)
    parts, nowhere = dict[StatedSession, SheetPart](), list[str]()
    for number, line, cells in sheet.rows():
        try:
            if isinstance(cells, str):
                raise UnusableError(cells)
            said = _said(cells, told, code_of, sheet.number)
        except UnusableError as error:
            nowhere.append(f"line {number}: {error}")
            continue
        part = parts.setdefault(said, SheetPart(said, sheet.header))
        try:
            row = touch_row(cells, sheet.number, len(part.touches))
            if row["gravity_level"] is None:
                row["gravity_level"] = gravity_level
            if row["gravity_level"] is None:
                raise UnusableError("gravity_level is missing")
            if (row["page"], row["sequence"]) in part.seen:
                raise UnusableError("page and sequence are the same as in another line")
        except UnusableError as error:
            part.refusals.append(f"line {number}: {error}")
            continue
        part.seen.add((row["page"], row["sequence"]))
        part.touches.append(row)
        part.content += line if line.endswith(b"\n") else line + b"\n"
    found = [part for part in parts.values() if part.touches]
    if not found:
        reasons = [*nowhere, *(reason for part in parts.values() for reason in part.refusals)]
        raise RecordingError(f"No line can be used. {'; '.join(reasons[:3]) or 'The file has only a header'}.")
    lost = [reason for part in parts.values() if not part.touches for reason in part.refusals]
    return found, nowhere + lost


def _refuse_columns(sheet: CsvSheet, told: StatedSession, gravity_level: float | None) -> None:
    unknown = [name for name in sheet.columns if name not in COLUMNS]
    if unknown:
        places = [str(sheet.columns.index(name) + 1) for name in unknown]
        raise RecordingError(
            f"Column {', '.join(places)} is not a known column. Files are kept unchanged, so the column might reveal a "
            f"person. Remove it. Known columns: {', '.join(COLUMNS)}."
        )
    missing = [name for name in NEEDED if name not in sheet.columns]
    missing += [f"{name} (or --{name})" for name in WHO if name not in sheet.columns and getattr(told, name) is None]
    if not any(set(pair) <= set(sheet.columns) for pair in (TARGET, DEVIATION)):
        missing.append(f"{' and '.join(TARGET)}, or {' and '.join(DEVIATION)}")
    if "gravity_level" not in sheet.columns and gravity_level is None:
        missing.append("gravity_level (or --gravity-level)")
    if missing:
        raise RecordingError(f"Columns are missing: {'; '.join(missing)}. See docs/howto/study.md.")


def _said(
    cells: dict[str, str],
    told: StatedSession,
    code_of: Callable[[str], str | None],
    number: Callable[[str], float | None],
) -> StatedSession:
    participant = code_of(cells["participant"].strip()) if "participant" in cells else told.participant
    if participant is None:
        raise UnusableError("its participant is not a code of this study")
    if told.participant is not None and participant != told.participant:
        raise UnusableError("its participant differs from --participant")
    protocol = cells["protocol"].strip() if "protocol" in cells else told.protocol
    if protocol is None or not PROTOCOL.fullmatch(protocol):
        raise UnusableError("its protocol is not a name of letters, digits, - and _")
    if told.protocol is not None and protocol != told.protocol:
        raise UnusableError("its protocol differs from --protocol")
    session = told.session if "session" not in cells else _session(number(cells["session"]))
    if told.session is not None and session != told.session:
        raise UnusableError("its session differs from --session")
    return StatedSession(participant, protocol, session)


def _session(value: float | None) -> int:
    if value is None or value != int(value) or not 1 <= value <= 99:
        raise UnusableError("its session is not a whole number from 1 to 99")
    return int(value)
