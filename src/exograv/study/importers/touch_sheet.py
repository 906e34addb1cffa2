"""A CSV of touches, of one person or of many: cut by session, each cut with the lines as they were."""

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
    "From touches alone: when windows opened and closed is that of their touches, that they ran to their end and the "
    "protocol to its own is not known."
)


@dataclass
class SheetPart:
    """One session's lines."""

    said: StatedSession
    content: bytes
    """Header and lines of this session that can be used, byte for byte; others might hold a name."""

    touches: list[dict[str, Any]] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)
    seen: set[tuple[str, int]] = field(default_factory=set)
    """Page and sequence of the touches."""

    def imported(self) -> Imported:
        """As every importer hands over."""
        windows = windows_of_touches(self.touches)
        session = session_of_touches("csv", windows, self.touches)
        session["remark"] = NOT_KNOWN
        return Imported(session, windows, self.touches, self.said, refusals=self.refusals)


def cut_sheet(
    content: bytes, told: StatedSession, gravity_level: float | None, code_of: Callable[[str], str | None]
) -> tuple[list[SheetPart], list[str]]:
    """Sessions in the order of their first lines, and the lines that belong to none.

    Args:
        content: Of the file.
        told: What holds for all lines; a column beside it has to say the same.
        gravity_level: For lines that say none.
        code_of: Code of the study for what stands in `participant`; None where it is nobody's.

    Raises:
        RecordingError: Columns are missing or unknown, or not one line can be used.
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
                raise UnusableError("page and sequence are those of another line")
        except UnusableError as error:
            part.refusals.append(f"line {number}: {error}")
            continue
        part.seen.add((row["page"], row["sequence"]))
        part.touches.append(row)
        part.content += line if line.endswith(b"\n") else line + b"\n"
    found = [part for part in parts.values() if part.touches]
    if not found:
        reasons = [*nowhere, *(reason for part in parts.values() for reason in part.refusals)]
        raise RecordingError(f"No line of it can be used. {'; '.join(reasons[:3]) or 'There is only a header'}.")
    lost = [reason for part in parts.values() if not part.touches for reason in part.refusals]
    return found, nowhere + lost


def _refuse_columns(sheet: CsvSheet, told: StatedSession, gravity_level: float | None) -> None:
    unknown = [name for name in sheet.columns if name not in COLUMNS]
    if unknown:
        places = [str(sheet.columns.index(name) + 1) for name in unknown]
        raise RecordingError(
            f"Column {', '.join(places)} is none that a study knows, and files are kept as they are: it might name a "
            f"person. Take it out. Known are {', '.join(COLUMNS)}."
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
        raise UnusableError("its participant is no code of this study")
    if told.participant is not None and participant != told.participant:
        raise UnusableError("its participant is not the one of --participant")
    protocol = cells["protocol"].strip() if "protocol" in cells else told.protocol
    if protocol is None or not PROTOCOL.fullmatch(protocol):
        raise UnusableError("its protocol is no name of letters, digits, - and _")
    if told.protocol is not None and protocol != told.protocol:
        raise UnusableError("its protocol is not the one of --protocol")
    session = told.session if "session" not in cells else _session(number(cells["session"]))
    if told.session is not None and session != told.session:
        raise UnusableError("its session is not the one of --session")
    return StatedSession(participant, protocol, session)


def _session(value: float | None) -> int:
    if value is None or value != int(value) or not 1 <= value <= 99:
        raise UnusableError("its session is no whole number from 1 to 99")
    return int(value)
