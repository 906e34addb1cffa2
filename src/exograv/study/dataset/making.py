"""Tables made from the sources, and made again when a source was added, removed or changed."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pandas as pd

from exograv.errors import ExogravError, RecordingError
from exograv.study.folder.columns import KEY, TABLES
from exograv.study.folder.journal import alone
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.importers.imported_session import Imported, SessionKey, StatedSession, sentences
from exograv.study.importers.recording import import_recording
from exograv.study.importers.touch_sheet import cut_sheet
from exograv.study.participants.participant_record import SEALED
from exograv.study.participants.register import read_register

from .sources import Source, placed_sources, rows_of, sha256_of
from .tables import Tables, frame, read_tables, write_tables

NAMES = [column.name for column in KEY]


def current_tables(folder: StudyFolder) -> Tables:
    """Return the tables for the present sources. Files that are up to date are not written again.

    Raises:
        ConfigError: Another command is changing the study.
        RecordingError: A source cannot be read any more, or the disk is full.
    """
    with alone(folder):
        return refresh(folder)


def refresh(
    folder: StudyFolder, fresh: Mapping[SessionKey, Imported] | None = None, everything: bool = False
) -> Tables:
    """Bring the tables up to date. The caller holds the lock of the study.

    Args:
        folder: Folder of the study.
        fresh: Sessions that have just been read.
        everything: Read all sources again.

    Raises:
        RecordingError: A source cannot be read any more, or the disk is full.
    """
    sources, before = placed_sources(folder), None if everything else _before(folder)
    known = set[tuple[Any, ...]]() if before is None else _marks(before.sessions)
    new = [source for source in sources if _mark(source, folder) not in known]
    people = frame(TABLES["participants"], _people(folder))
    kept = {_mark(source, folder) for source in sources} & known
    if before is not None and not new and kept == known and people.equals(before.participants):
        return before
    rows: dict[str, list[dict[str, Any]]] = {"touches": [], "windows": [], "sessions": []}
    for source in new:
        found = (fresh or {}).get(source.note.key) or _again(source)
        for name, more in rows_of(source, found, folder).items():
            rows[name] += more
    keys = {mark[:3] for mark in kept}
    joined = {
        name: _joined(None if before is None else getattr(before, name), keys, frame(TABLES[name], more))
        for name, more in rows.items()
    }
    tables = Tables(**joined, participants=people)
    write_tables(folder, tables)
    return tables


def _again(source: Source) -> Imported:
    """Read a source again, and add a remark if its hash has changed since it was added."""
    found = imported_again(source)
    if sha256_of(source.path) == source.note.sha256:
        return found
    remark = sentences(found.session.get("remark"), "The file has changed since it was added: its hash differs.")
    return replace(found, session={**found.session, "remark": remark})


def imported_again(source: Source) -> Imported:
    """Return the rows of a source that is in its place.

    Raises:
        RecordingError: The source cannot be read any more.
    """
    note, path = source.note, source.path
    try:
        if note.kind == "recording":
            return import_recording(path)
        if note.kind == "xdf":
            from exograv.study.importers.xdf import import_xdf  # importing pyxdf takes half a second

            return import_xdf(path, note.mapping)
        said = StatedSession(note.participant, note.protocol, note.session)
        # The whole file belongs to this session, independent of the code in its lines.
        parts, _ = cut_sheet(path.read_bytes(), said, note.gravity_level, lambda _: note.participant)
        return parts[0].imported()
    except (OSError, ExogravError) as error:
        raise RecordingError(
            f"{path} was readable when it was added, but cannot be read now: {error} Restore the last copy of its "
            "folder."
        ) from error


def _before(folder: StudyFolder) -> Tables | None:
    try:
        return read_tables(folder)
    except RecordingError:
        return None


def _mark(source: Source, folder: StudyFolder) -> tuple[Any, ...]:
    """Return the values that decide if a session's rows are up to date with its source."""
    note = source.note
    return (*note.key, note.sha256, source.path.relative_to(folder.path).as_posix())


def _marks(sessions: pd.DataFrame) -> set[tuple[Any, ...]]:
    return set(sessions[[*NAMES, "sha256", "source"]].itertuples(index=False, name=None))


def _people(folder: StudyFolder) -> list[dict[str, Any]]:
    people = [row.model_dump() for row in read_register(folder)]
    return [
        {
            **{name: value for name, value in person.items() if name != "code"},
            "participant": person["code"],
            "group": None if person["group"] == SEALED else person["group"],
        }
        for person in people
    ]


def _joined(before: pd.DataFrame | None, keys: set[tuple[Any, ...]], more: pd.DataFrame) -> pd.DataFrame:
    """Join the rows of these sessions from before with the new rows, and sort by session."""
    if before is not None and len(before):
        of = before.set_index(NAMES).index
        kept = before.loc[of.isin(list(keys))] if keys else before.iloc[:0]
        more = pd.concat([kept, more], ignore_index=True) if len(more) else kept.copy()
    return more.sort_values(NAMES, kind="stable", ignore_index=True)
