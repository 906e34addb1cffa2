"""Quarantine: files that cannot be read or were replaced, each stored with the reason. No analysis reads them."""

import json
import shutil
from dataclasses import asdict, dataclass
from pathlib import Path

from exograv.errors import RecordingError
from exograv.files import sync
from exograv.study.folder.study_folder import StudyFolder

from .sources import Source, copied, json_file, put_folder

WHY = "why.json"


@dataclass(frozen=True)
class QuarantineNote:
    """Note that is stored beside a file in quarantine."""

    sha256: str
    """Hash of the file that was given."""

    participant: str | None
    reason: str


def quarantined(folder: StudyFolder) -> dict[str, QuarantineNote]:
    """Return the notes by the hash of the file."""
    found = dict[str, QuarantineNote]()
    for path in sorted(folder.quarantine.glob(f"*/{WHY}")):
        try:
            why = json.loads(path.read_text(encoding="utf-8"))
            found[why["sha256"]] = QuarantineNote(why["sha256"], why.get("participant"), str(why.get("reason")))
        except (OSError, ValueError, KeyError):
            continue
    return found


def put_aside(folder: StudyFolder, path: Path, sha256: str, reason: str, participant: str | None) -> None:
    """Store a copy of a file that cannot be read, under its hash.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    place = folder.quarantine / sha256[:16]
    if place.exists():
        return
    why = QuarantineNote(sha256, participant, reason)
    name = f"{sha256[:16]}{path.suffix.lower()}"
    put_folder(place, {name: copied(path, sha256), WHY: json_file(asdict(why))})


def set_aside(folder: StudyFolder, source: Source, reason: str) -> None:
    """Move a session's folder from the sources to quarantine.

    Raises:
        RecordingError: The folder cannot be written.
    """
    note = source.note
    place = folder.quarantine / f"{note.sha256[:16]}"
    told = f"{note.protocol} {note.session} of {note.participant}: {reason}"
    why = QuarantineNote(note.given_sha256, note.participant, told)
    try:
        folder.quarantine.mkdir(exist_ok=True)
        if place.exists():
            shutil.rmtree(place)
        json_file(asdict(why))(source.path.parent / WHY)
        source.path.parent.rename(place)
        sync(folder.quarantine)
    except OSError as error:
        raise RecordingError(f"{place} cannot be created: {error.strerror}. Free space on the disk.") from error
