"""Raw files of a study: one folder per session with one file, byte for byte, and `source.json` that describes it.

A folder is created under a temporary name and then renamed, so a killed command leaves only complete folders.
"""

import hashlib
import json
import secrets
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from exograv.errors import ConfigError, RecordingError
from exograv.files import PARTIAL, sync
from exograv.model.rig_settings import Settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.importers.imported_session import Imported, SessionKey
from exograv.study.importers.xdf_mapping import XdfMapping

NOTE = "source.json"
BLOCK_BYTES = 1 << 22

Write = Callable[[Path], None]
"""Callback that writes the content of a file to a path."""

Kind = Literal["recording", "csv", "xdf"]
SUFFIXES: dict[str, Kind] = {".mcap": "recording", ".csv": "csv", ".tsv": "csv", ".xdf": "xdf", ".xdfz": "xdf"}
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class RecordedBody(Settings):
    """Body data exactly as the recording has them. The study itself stores bands only."""

    height_m: float | None = None
    mass_kg: float | None = None
    sex: str | None = None


class SourceNote(Settings):
    """Content of `source.json`: the origin of one raw file."""

    file: str
    """Name of the stored file, made from the code. The original name is not stored."""

    sha256: Sha256
    given_sha256: Sha256
    """Hash of the given file. It differs from `sha256` if the session was cut out of a file with several sessions, or
    joined from several recordings.
    """

    parts: tuple[Sha256, ...] = ()
    """Hashes of the recordings of an interrupted session, in order. The stored file joins them; else empty."""

    kind: Kind
    participant: str
    protocol: str
    session: int
    recorded_as: str | None = None
    """Code in the file if it differs from the study's code (`--new-code`)."""

    acquired: str | None = None
    gravity_level: float | None = None
    """Felt share of the arm's weight, for touches without one."""

    mapping: XdfMapping | None = None
    body: RecordedBody = RecordedBody()
    remark: str | None = None
    """Problems that were found when the file was added."""

    @property
    def key(self) -> SessionKey:
        """Key of the session."""
        return SessionKey(self.participant, self.protocol, self.session)

    @property
    def given(self) -> frozenset[str]:
        """Hashes of all given files."""
        return frozenset((self.given_sha256, *self.parts))


@dataclass(frozen=True)
class Source:
    """Raw file of one session, and its place in the study's folder."""

    path: Path
    note: SourceNote


def placed_sources(folder: StudyFolder) -> list[Source]:
    """Return all sessions of the study, sorted by code, protocol and number.

    Raises:
        RecordingError: A `source.json` cannot be read.
    """
    return sorted(_placed(folder), key=lambda source: source.note.key)


def _placed(folder: StudyFolder) -> Iterator[Source]:
    for path in folder.sources.glob(f"*/*/{NOTE}"):
        if path.parent.name.startswith(PARTIAL):
            continue
        try:
            note = SourceNote.model_validate_json(path.read_bytes())
        except (OSError, ValidationError) as error:
            raise RecordingError(
                f"{path} cannot be used ({type(error).__name__}). It was changed by hand: restore the last copy of its "
                "folder, or remove the folder and add the file again."
            ) from None
        yield Source(path.parent / note.file, note)


def nothing() -> None:
    """Do nothing: the place is free."""


def put(folder: StudyFolder, note: SourceNote, write: Write, make_way: Callable[[], None] = nothing) -> Source:
    """Put a session in its place, completely or not at all.

    Args:
        folder: Folder of the study.
        note: Description of the session.
        write: Writes the raw file.
        make_way: Removes a previous session, called when all files are written.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    place = folder.session(*note.key)
    put_folder(place, {note.file: write, NOTE: json_file(note.model_dump(mode="json"))}, make_way)
    return Source(place / note.file, note)


def put_folder(place: Path, files: dict[str, Write], make_way: Callable[[], None] = nothing) -> None:
    """Create a folder with these files, completely or not at all.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    partial = place.with_name(f"{PARTIAL}{secrets.token_hex(4)}")
    try:
        partial.mkdir(parents=True)
        for name, write in files.items():
            write(partial / name)
            sync(partial / name)
        sync(partial)
        make_way()
        partial.rename(place)
        sync(place.parent)
    except OSError as error:
        raise RecordingError(
            f"{place} cannot be created: {error.strerror}. This session was not added; earlier ones "
            "stay. Free space on the disk, and add it again."
        ) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def remove_partial(folder: StudyFolder) -> int:
    """Remove the incomplete folders and files of killed commands; return their number."""
    left = list(folder.path.rglob(f"{PARTIAL}*"))
    for path in left:
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    return len(left)


def sha256_of(path: Path) -> str:
    """Compute the hash of a file.

    Raises:
        OSError: The file cannot be read.
    """
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def copied(path: Path, sha256: str) -> Write:
    """Return a function that writes a copy of the file.

    Raises:
        ConfigError: The hash of the file has changed in the meantime.
    """

    def write(to: Path) -> None:
        digest = hashlib.sha256()
        with path.open("rb") as source, to.open("wb") as target:
            while block := source.read(BLOCK_BYTES):
                digest.update(block)
                target.write(block)
        if digest.hexdigest() != sha256:
            raise ConfigError(
                "The file changes while it is read: another program is still writing it. Add it again afterwards."
            )

    return write


def json_file(content: dict[str, object]) -> Write:
    """Return a function that writes this content as JSON."""

    def write(to: Path) -> None:
        to.write_text(json.dumps(content, ensure_ascii=False, indent=1), encoding="utf-8")

    return write


def rows_of(source: Source, imported: Imported, folder: StudyFolder) -> dict[str, list[dict[str, object]]]:
    """Return rows of touches, windows and the session, with the key that the study gives them."""
    note = source.note
    key = note.key._asdict()
    session = {
        **imported.session,
        "source": source.path.relative_to(folder.path).as_posix(),
        "sha256": note.sha256,
        "acquired": note.acquired,
        "remark": " ".join(part for part in (imported.session.get("remark"), note.remark) if part) or None,
    }
    return {
        "touches": [{**key, **row} for row in imported.touches],
        "windows": [{**key, **row} for row in imported.windows],
        "sessions": [{**key, **session}],
    }
