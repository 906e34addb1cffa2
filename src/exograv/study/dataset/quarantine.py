"""What cannot be read, or was replaced, is kept apart with the reason, and read by nothing."""

import json
import shutil
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError
from exograv.files import sync
from exograv.study.folder.study_folder import StudyFolder

from .sources import Source, copied, json_file, put_folder

WHY = "why.json"


def quarantined(folder: StudyFolder) -> dict[str, dict[str, Any]]:
    """What is there: reason and participant, by the hash of the file."""
    found = dict[str, dict[str, Any]]()
    for path in sorted(folder.quarantine.glob(f"*/{WHY}")):
        try:
            why = json.loads(path.read_text(encoding="utf-8"))
            found[why["sha256"]] = why
        except (OSError, ValueError, KeyError):
            continue
    return found


def put_aside(folder: StudyFolder, path: Path, sha256: str, reason: str, participant: str | None) -> None:
    """Keep a copy of a file that cannot be read, under its hash.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    place = folder.quarantine / sha256[:16]
    if place.exists():
        return
    why: dict[str, object] = {"sha256": sha256, "participant": participant, "reason": reason}
    name = f"{sha256[:16]}{path.suffix.lower()}"
    put_folder(place, {name: copied(path, sha256), WHY: json_file(why)})


def set_aside(folder: StudyFolder, source: Source, reason: str) -> None:
    """Move a session's folder out of the sources.

    Raises:
        RecordingError: The folder cannot be written.
    """
    note = source.note
    place = folder.quarantine / f"{note.sha256[:16]}"
    why: dict[str, object] = {
        "sha256": note.given_sha256,
        "participant": note.participant,
        "reason": f"{note.protocol} {note.session} of {note.participant}: {reason}",
    }
    try:
        folder.quarantine.mkdir(exist_ok=True)
        if place.exists():
            shutil.rmtree(place)
        json_file(why)(source.path.parent / WHY)
        source.path.parent.rename(place)
        sync(folder.quarantine)
    except OSError as error:
        raise RecordingError(f"{place} cannot be made: {error.strerror}. Free space on the disk.") from error
