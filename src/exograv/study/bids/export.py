"""Export of a study's folder as a BIDS data set: completely or not at all, with the same bytes each time."""

import contextlib
import glob
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from exograv.errors import ConfigError, RecordingError
from exograv.files import PARTIAL
from exograv.study.biosignal_channels import Stated
from exograv.study.dataset.making import refresh
from exograv.study.dataset.sources import sha256_of
from exograv.study.dataset.tables import Tables
from exograv.study.folder.columns import KEY, SESSIONS, TABLES
from exograv.study.folder.journal import alone
from exograv.study.folder.settings import StudySettings, read_settings
from exograv.study.folder.study_folder import StudyFolder

from .behaviour import rows_of
from .checking import problems_of
from .manifest import files_of, read_manifest, write_manifest
from .names import SessionPlace, labels
from .pages import TIDY, PageContent
from .session import SessionTables, write_session


@dataclass(frozen=True)
class ExportResult:
    """Result of `exograv study export`."""

    dataset: Path
    participants: int
    sessions: int
    touches: int
    motion_rows: int
    files: int
    bytes: int
    not_exported: list[str]
    """Sentences on streams that were not exported, or not completely described."""


Progress = Callable[[str, float], None]
"""Function of a phase, as a text, and the share of it that is done."""


def export_bids(
    study: Path, out: Path, rate_Hz: float = 100.0, with_raw: bool = True, progress: Progress = lambda *_: None
) -> ExportResult:
    """Export a study in its present state, under the lock of the study.

    Args:
        study: Folder of the study.
        out: Folder of the data set; an earlier export there is replaced.
        rate_Hz: Wanted rows per second of the motion; every n-th tick gives a row, with the nearest whole n.
        with_raw: Include the raw files.
        progress: Takes the phase and the share of it that is done.

    Raises:
        ConfigError: The folder is no study, another command changes it, two codes have the same label, or `out` is not
            free.
        RecordingError: A source cannot be read or was changed after it was added, or `out` cannot be written.
    """
    folder = StudyFolder(Path(study))
    settings = read_settings(folder)
    with alone(folder):
        return write_dataset(folder, settings, refresh(folder), Path(out), (rate_Hz, with_raw), progress)


def write_dataset(
    folder: StudyFolder,
    settings: StudySettings,
    tables: Tables,
    out: Path,
    options: tuple[float, bool],
    progress: Progress = lambda *_: None,
) -> ExportResult:
    """Export a study with given tables. The caller holds the lock of the study.

    Args:
        folder: Folder of the study.
        settings: Settings of the study.
        tables: Tables of the study.
        out: Folder of the data set.
        options: `rate_Hz` and `with_raw` of `export_bids`.
        progress: `progress` of `export_bids`.

    Raises:
        ConfigError: As for `export_bids`.
        RecordingError: As for `export_bids`.
    """
    rate_Hz, with_raw = options
    if not rate_Hz > 0.0:
        raise ConfigError(f"--rate is {rate_Hz:g} Hz; it must be positive, such as 100.")
    if not len(tables.sessions):
        raise ConfigError(f"{folder.path} holds no session. Add recordings with `exograv study add`.")
    subjects, protocols = _labels(tables)
    with _in_place_of(out, folder) as root:
        rows, left = 0, list[str]()
        for number, session in enumerate(sessions_of(tables)):
            progress("Writing the sessions", number / len(tables.sessions))
            row = session.session
            place = SessionPlace(subjects[row["participant"]], f"{protocols[row['protocol']]}{row['session']:02d}")
            more, not_exported = _write_one(folder, root, place, session, (*options, settings.streams))
            rows, left = rows + more, [*left, *not_exported]
        progress("Writing the tables and check sums", 0.0)
        PageContent(settings, tables, subjects, with_raw, left).write(root)
        for name in TABLES:
            shutil.copyfile(folder.table(name), root / TIDY / f"{name}.parquet")
        known = {row["source"]: row["sha256"] for row in rows_of(tables.sessions, SESSIONS)}
        manifest = write_manifest(root, known)
        _refuse_wrong(root)
        size = sum((root / name).stat().st_size for name in manifest)
    people, sessions, touches = len(tables.participants), len(tables.sessions), len(tables.touches)
    return ExportResult(out, people, sessions, touches, rows, len(manifest) + 1, size, left)


def _write_one(
    folder: StudyFolder, root: Path, place: SessionPlace, session: SessionTables, options: tuple[float, bool, Stated]
) -> tuple[int, list[str]]:
    """Write one session; return its rows of motion, and sentences on streams that are not exported or described."""
    rate_Hz, with_raw, stated = options
    relative = session.session["source"]
    source = folder.source(relative)
    _refuse_changed(source, session.session["sha256"])
    if with_raw:
        _give_along(source, root / relative)
    result = write_session(root, place, source, session, rate_Hz, stated)
    where = f"`sub-{place.subject}/ses-{place.session}`"
    left = [
        f"{'Exported as physio only' if one.as_physio else 'Not exported'} of {where}: a stream of type "
        f"`{one.kind or 'unknown'}`, because {one.why}."
        for one in result.left
    ]
    said = [
        f"Not stated for {kind} of {where}: {', '.join(names)}. "
        "Add them to the stream's entry of `[streams]` in study.toml."
        for kind, names in result.not_stated.items()
    ]
    return result.motion_rows, [*left, *said]


def _refuse_wrong(root: Path) -> None:
    if problems := problems_of(root, with_hashes=False):
        raise RecordingError(
            f"The export has errors and was removed: {problems[0]} ({len(problems)} in all). This is a "
            "defect of exograv: please report it."
        )


def sessions_of(tables: Tables) -> Iterator[SessionTables]:
    """Yield each session with its own windows and touches, in the order of codes, protocols and numbers."""
    names = [column.name for column in KEY]
    for row in sorted(rows_of(tables.sessions, SESSIONS), key=lambda row: tuple(row[name] for name in names)):
        of = [_of(table, {name: row[name] for name in names}) for table in (tables.windows, tables.touches)]
        yield SessionTables(row, *of)


def _of(table: pd.DataFrame, key: dict[str, Any]) -> pd.DataFrame:
    """Select the rows of one session."""
    is_own = pd.Series(True, index=table.index)
    for name, value in key.items():
        is_own &= table[name] == value
    return table.loc[is_own]


def _labels(tables: Tables) -> tuple[dict[str, str], dict[str, str]]:
    codes = tables.participants["participant"].tolist()
    known = set(codes)
    if strange := sorted(set(tables.sessions["participant"]) - known):
        raise ConfigError(
            f"Sessions of {', '.join(strange)} have no participant in the study. Add the participant, or erase the "
            "sessions."
        )
    return labels(codes, "Participant"), labels(sorted(set(tables.sessions["protocol"])), "Protocol")


def _refuse_changed(source: Path, sha256: str) -> None:
    try:
        found = sha256_of(source)
    except OSError as error:
        raise RecordingError(f"The source {source} cannot be read: {error.strerror}. Restore the file.") from error
    if found != sha256:
        raise RecordingError(
            f"{source} was changed after it was added to the study: its hash differs. Restore the original."
        )


def _give_along(source: Path, to: Path) -> None:
    """Add the raw file as a hard link if the file system allows it, otherwise as a copy."""
    to.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(source.resolve(), to)
    except OSError:
        shutil.copyfile(source, to)


@contextmanager
def _in_place_of(out: Path, folder: StudyFolder) -> Iterator[Path]:
    """Provide a folder that replaces `out` when it is complete, and is removed after a failure."""
    _tidy_after_kill(out)
    _refuse_taken(out, folder)
    root = out.with_name(f"{PARTIAL}{secrets.token_hex(4)}-{out.name}")
    old = out.with_name(f"{PARTIAL}{secrets.token_hex(4)}-{out.name}-old")
    try:
        root.mkdir(parents=True)
        yield root
        os.sync()
        _swap(root, out, old)
    except OSError as error:
        raise RecordingError(
            f"{out} cannot be written: {error.strerror}. The previous content is unchanged. Free space, or give a "
            "folder that you can write to."
        ) from error
    finally:
        shutil.rmtree(root, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _tidy_after_kill(out: Path) -> None:
    """Remove the remains of a killed export beside `out`. After a kill in the swap, restore the previous content."""
    with contextlib.suppress(OSError):
        for old in out.parent.glob(f"{PARTIAL}*-{glob.escape(out.name)}-old"):
            if not out.exists():
                old.rename(out)
        for name in (out.name, f"{out.name}-old"):
            for left in out.parent.glob(f"{PARTIAL}*-{glob.escape(name)}"):
                shutil.rmtree(left, ignore_errors=True)


def _swap(root: Path, out: Path, old: Path) -> None:
    """Rename `root` to `out` and the previous `out` to `old`; undo this after a failure."""
    if out.exists():
        out.rename(old)
    try:
        root.rename(out)
    except OSError:
        if old.exists():
            old.rename(out)
        raise


def _refuse_taken(out: Path, folder: StudyFolder) -> None:
    """Refuse to write into a study, or over files that no export has written."""
    study, place = folder.path.resolve(), out.resolve()
    if place == study or study.is_relative_to(place) or place.is_relative_to(folder.sources.resolve()):
        raise ConfigError(f"{out} is the study's folder or contains it. Give --bids a separate folder.")
    if not out.exists():
        return
    if not out.is_dir():
        raise ConfigError(f"{out} is a file. Give --bids a folder.")
    if strange := sorted(set(files_of(out)) - set(read_manifest(out))):
        raise ConfigError(
            f"{out} holds {len(strange)} files that no export wrote, such as {strange[0]}. Move them, or give another "
            "folder: an export replaces the whole folder."
        )
