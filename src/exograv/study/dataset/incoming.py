"""A file that is to be added, read by the importer of its kind: one session, or of a CSV as many as are in it."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import RecordingError
from exograv.study.importers.imported_session import Imported, StatedSession
from exograv.study.importers.recording import import_recording
from exograv.study.importers.touch_sheet import cut_sheet
from exograv.study.importers.xdf_mapping import XdfMapping

from .sources import Kind, RecordedBody

NO_BODY = RecordedBody()


@dataclass(frozen=True)
class Incoming:
    """One session that is to be added."""

    imported: Imported
    kind: Kind
    suffix: str
    content: Path | bytes
    """The file itself, or what was cut out of it."""

    sha256: str
    """Of this content."""

    given_sha256: str
    """Of the file."""

    body: RecordedBody = NO_BODY

    def write(self, to: Path) -> None:
        """Write what was cut out."""
        if isinstance(self.content, bytes):
            to.write_bytes(self.content)


@dataclass(frozen=True)
class IncomingFile:
    """All of a file."""

    sessions: Sequence[Incoming]
    nowhere: Sequence[str] = ()
    """Lines that belong to no session."""


def read_incoming(
    path: Path,
    kind: Kind,
    sha256: str,
    said: StatedSession,
    gravity_level: float | None,
    mapping: XdfMapping | None,
    code_of: Callable[[str], str | None],
) -> IncomingFile:
    """Read it.

    Args:
        path: The file.
        kind: By its suffix.
        sha256: Of the file.
        said: What somebody told.
        gravity_level: Of touches that say none.
        mapping: Of XDF of somebody else.
        code_of: Code of the study for what stands in a CSV.

    Raises:
        RecordingError: It is not what its suffix says, or nothing in it can be used.
    """
    suffix = path.suffix.lower()
    if kind == "recording":
        found = import_recording(path)
        return IncomingFile(
            [Incoming(found, kind, suffix, path, sha256, sha256, RecordedBody.model_validate(found.body))]
        )
    if kind == "xdf":
        from exograv.study.importers.xdf import import_xdf  # pyxdf: half a second

        return IncomingFile([Incoming(import_xdf(path, mapping), kind, suffix, path, sha256, sha256)])
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"It cannot be read: {error.strerror}. Check its path.") from error
    parts, nowhere = cut_sheet(content, said, gravity_level, code_of)
    sessions = [
        Incoming(part.imported(), kind, suffix, part.content, hashlib.sha256(part.content).hexdigest(), sha256)
        for part in parts
    ]
    return IncomingFile(sessions, nowhere)
