"""Files to be added, read by the importer of their kind. A CSV may hold several sessions, other files one."""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import RecordingError
from exograv.study.importers.imported_session import Imported, StatedSession
from exograv.study.importers.recording import import_recording
from exograv.study.importers.touch_sheet import cut_sheet
from exograv.study.importers.xdf_mapping import XdfMapping

from .sources import Kind, RecordedBody, sha256_of

NO_BODY = RecordedBody()


@dataclass(frozen=True)
class Incoming:
    """Session that is to be added."""

    imported: Imported
    kind: Kind
    suffix: str
    content: Path | bytes
    """Path of the file, or the content that was cut out of the file."""

    sha256: str
    """Hash of this content."""

    given_sha256: str
    """Hash of the given file."""

    body: RecordedBody = NO_BODY
    parts: tuple[str, ...] = ()
    """Hashes of the recordings that the content joins."""

    @property
    def given(self) -> frozenset[str]:
        """Hashes of all given files."""
        return frozenset((self.given_sha256, *self.parts))

    def write(self, to: Path) -> None:
        """Write the content that was cut out of the file."""
        if isinstance(self.content, bytes):
            to.write_bytes(self.content)


@dataclass(frozen=True)
class IncomingFile:
    """Sessions that were read from one file, and its lines that belong to none."""

    sessions: Sequence[Incoming]
    nowhere: Sequence[str] = ()
    """Lines that belong to no session."""


def read_recording(path: Path, given_sha256: str, parts: tuple[str, ...]) -> Incoming:
    """Read the recording of a session.

    Args:
        path: The given recording, or a file that joins all recordings of the session.
        given_sha256: Hash of the given recording.
        parts: Hashes of the recordings that are joined; empty for one recording.

    Raises:
        RecordingError: The file is not a recording of exograv.
    """
    found = import_recording(path)
    sha256 = sha256_of(path) if parts else given_sha256
    body = RecordedBody.model_validate(found.body)
    return Incoming(found, "recording", path.suffix.lower(), path, sha256, given_sha256, body, parts)


def read_incoming(
    path: Path,
    kind: Kind,
    sha256: str,
    said: StatedSession,
    gravity_level: float | None,
    mapping: XdfMapping | None,
    code_of: Callable[[str], str | None],
) -> IncomingFile:
    """Read a file of touches that is to be added.

    Args:
        path: The file.
        kind: Kind of the file, from its suffix.
        sha256: Hash of the file.
        said: Session that the options state.
        gravity_level: Felt share of the arm's weight for touches without one.
        mapping: Mapping for XDF from other software.
        code_of: Code of the study for a participant in a CSV.

    Raises:
        RecordingError: The content does not match the suffix, or nothing in the file can be used.
    """
    suffix = path.suffix.lower()
    if kind == "xdf":
        from exograv.study.importers.xdf import import_xdf  # importing pyxdf takes half a second

        return IncomingFile([Incoming(import_xdf(path, mapping), kind, suffix, path, sha256, sha256)])
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"The file cannot be read: {error.strerror}. Check its path.") from error
    parts, nowhere = cut_sheet(content, said, gravity_level, code_of)
    sessions = [
        Incoming(part.imported(), kind, suffix, part.content, hashlib.sha256(part.content).hexdigest(), sha256)
        for part in parts
    ]
    return IncomingFile(sessions, nowhere)
