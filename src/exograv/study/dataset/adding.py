"""Adding of files to a study: each file once, under a code, completely or not at all.

Every refusal is named and counted.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from mcap.writer import MCAP0_MAGIC

from exograv.errors import ConfigError, RecordingError
from exograv.files import PARTIAL
from exograv.options import SESSIONS_MAX
from exograv.study.folder.journal import alone, note
from exograv.study.folder.settings import StudySettings, read_settings, read_toml
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.importers.imported_session import Imported, SessionKey, StatedSession, sentences
from exograv.study.importers.joined_recording import whole_recording
from exograv.study.importers.session_parts import session_of
from exograv.study.importers.xdf_mapping import XdfMapping
from exograv.study.participants.codes import typed_code
from exograv.study.participants.register import read_register

from .incoming import Incoming, read_incoming, read_recording
from .making import refresh
from .options import AddOptions
from .quarantine import put_aside, quarantined, set_aside
from .showing import looks_like_code, shown_file
from .sources import SUFFIXES, Kind, Source, SourceNote, copied, placed_sources, put, remove_partial, sha256_of
from .who import same_person

BUILT_IN = ("training", "familiarisation", "flight")
FIRST_WINDOWS = re.compile(r"-first-\d{1,3}$")
"""Suffix that `exograv run train --windows` appends to a protocol's name."""


@dataclass(frozen=True)
class AddingOutcome:
    """Outcome for a file, or for one session in the file."""

    file: str
    """Name of the file in a form that reveals no person."""

    what: str
    """Outcome: `added`, `replaced`, `already there`, `refused`, `quarantined` or `ignored`."""

    sentence: str
    key: SessionKey | None = None
    remark: str | None = None


def add_files(folder: StudyFolder, paths: Sequence[Path], options: AddOptions) -> list[AddingOutcome]:
    """Add recordings, touches as CSV, XDF, and folders of such files.

    Raises:
        ConfigError: The folder is no study, an option cannot be used, or another command is changing the study.
        RecordingError: The disk is full. Sessions that were added before stay, the rest is not added.
    """
    settings = read_settings(folder)
    _refuse_options(options)
    with alone(folder):
        remove_partial(folder)
        codes = {row.code for row in read_register(folder)}
        adding = _Adding(folder, options, codes, settings)
        outcomes = adding.all(_expanded(paths))
        refresh(folder, adding.fresh)
    return outcomes


def _refuse_options(options: AddOptions) -> None:
    if options.acquired is not None:
        try:
            datetime.fromisoformat(options.acquired)
        except ValueError:
            raise ConfigError(
                "--acquired is not a date and time. Write ISO 8601, such as 2026-03-04T09:30:00+01:00."
            ) from None
    if options.session is not None and not 1 <= options.session <= SESSIONS_MAX:
        raise ConfigError(f"--session is {options.session}; give a number from 1 to {SESSIONS_MAX}.")


def said_of(options: AddOptions) -> StatedSession:
    """Return the session that the options state; it holds for all files.

    Raises:
        ConfigError: The text of `--participant` is not a code.
    """
    code = None if options.participant is None else typed_code(options.participant)
    return StatedSession(code, options.protocol, options.session)


def new_codes(pairs: Sequence[str]) -> dict[str, str]:
    """Return the study's code by the code in files that were made under another code.

    Raises:
        ConfigError: An entry has no `=`, or its new code is not a code.
    """
    codes = dict[str, str]()
    for pair in pairs:
        old, equals, new = pair.partition("=")
        if not (old and equals):
            raise ConfigError("--new-code takes OLD=CODE, such as P-02=K7MR4XX.")
        codes[old] = typed_code(new)
    return codes


def _expanded(paths: Sequence[Path]) -> list[Path]:
    files = list[Path]()
    for path in paths:
        files += sorted(one for one in path.rglob("*") if one.is_file()) if path.is_dir() else [path]
    return files


class _Adding:
    """State of one call of `exograv study add`."""

    def __init__(self, folder: StudyFolder, options: AddOptions, codes: set[str], settings: StudySettings):
        self._folder, self._options, self._codes, self._settings = folder, options, codes, settings
        self._said, self._new_codes = said_of(options), new_codes(options.new_code)
        self._mapping = None if options.mapping is None else read_toml(options.mapping, XdfMapping)
        self._protocols = {*BUILT_IN, *(one.protocol for one in settings.expected)}
        self._sources = {source.note.key: source for source in placed_sources(folder)}
        self.fresh = dict[SessionKey, Imported]()

    def all(self, paths: Sequence[Path]) -> list[AddingOutcome]:
        outcomes = list[AddingOutcome]()
        for number, path in enumerate(paths, start=1):
            shown = shown_file(path, number, len(paths))
            try:
                outcomes += self._file(path, shown)
            except ConfigError as error:
                outcomes.append(self._refused(shown, str(error)))
        return outcomes

    def _file(self, path: Path, shown: str) -> list[AddingOutcome]:
        kind = SUFFIXES.get(path.suffix.lower())
        if kind is None:
            return [AddingOutcome(shown, "ignored", f"Only {', '.join(SUFFIXES)} files can be added.")]
        try:
            sha256 = sha256_of(path)
        except OSError as error:
            return [self._refused(shown, f"The file cannot be read: {error.strerror}. Check its path.")]
        parts = self._parts(path, kind, sha256)
        there = [key for key, source in self._sources.items() if source.note.given.issuperset(parts or (sha256,))]
        if there:
            return [
                AddingOutcome(
                    shown, "already there", f"The study has it as {_named(there[0])}; nothing was changed.", there[0]
                )
            ]
        if sha256 in quarantined(self._folder) and not self._options.replace:
            return [AddingOutcome(shown, "already there", "The file is in quarantine; nothing was changed.")]
        try:
            if kind == "recording":
                with whole_recording(session_of(path), self._folder.path, PARTIAL) as whole:
                    return [self._session(read_recording(whole, sha256, parts if whole != path else ()), shown)]
            incoming = read_incoming(path, kind, sha256, self._said, self._options.gravity_level,
                                     self._mapping, self._code_of)  # fmt: skip
        except RecordingError as error:
            sentence = str(error).replace(str(path), "It").replace(path.name, "It")
            return [self._unreadable(path, shown, kind, sha256, sentence)]
        outcomes = [self._session(one, shown) for one in incoming.sessions]
        if incoming.nowhere:
            few = "; ".join(incoming.nowhere[:5])
            outcomes.append(self._refused(shown, f"Lines that belong to no session, {len(incoming.nowhere)}: {few}."))
        return outcomes

    def _parts(self, path: Path, kind: Kind, sha256: str) -> tuple[str, ...]:
        """Return the hashes of all recordings of the session of a recording; empty for another file."""
        if kind != "recording":
            return ()
        try:
            recordings = session_of(path).recordings
            return tuple(sha256 if one == path else sha256_of(one) for one in recordings)
        except (RecordingError, OSError):
            return ()

    def _session(self, one: Incoming, shown: str) -> AddingOutcome:
        try:
            self._refuse_rehearsal(one)
            key, remark = self._key(one.imported.said)
            taken = self._sources.get(key)
            is_longer = taken is not None and taken.note.given < one.given  # the session was resumed since
            if taken is not None and not (self._options.replace or is_longer):
                raise ConfigError(
                    f"{_named(key)} exists already, from another file: either two people have the same code, or this "
                    "is another copy. If this file is the right one, add it with --replace, which moves the other to "
                    "quarantine."
                )
        except ConfigError as error:
            return self._refused(shown, str(error), one.sha256)
        what = "added" if taken is None else "replaced"
        try:
            source = self._placed(one, key, remark, taken)
        except ConfigError as error:
            return self._refused(shown, str(error), one.sha256)
        refusals = f" Refused rows, {len(one.imported.refusals)}: " if one.imported.refusals else ""
        refusals += "; ".join(one.imported.refusals[:5]) + ("." if one.imported.refusals else "")
        sentence = f"{_named(key)}: {one.imported.session['touches']} accepted touches.{refusals}"
        found = sentences(one.imported.session.get("remark"), source.note.remark)
        note(self._folder, what, sentence, participant=key.participant, sha256=source.note.sha256, remark=found)
        return AddingOutcome(shown, what, sentence, key, found)

    def _placed(self, one: Incoming, key: SessionKey, remark: str | None, taken: Source | None) -> Source:
        others = [
            source.note
            for other, source in self._sources.items()
            if other.participant == key.participant and other != key
        ]
        told = next(row for row in read_register(self._folder) if row.code == key.participant)
        doubt = same_person(one.body, told, others)
        recorded_as = one.imported.said.participant
        described = SourceNote(
            file=f"{key.participant}_{key.protocol}_{key.session:02d}{one.suffix}",
            sha256=one.sha256,
            given_sha256=one.given_sha256,
            parts=one.parts,
            kind=one.kind,
            **key._asdict(),
            recorded_as=None if recorded_as in (None, key.participant) else recorded_as,
            acquired=self._options.acquired,
            gravity_level=self._options.gravity_level,
            mapping=self._mapping if one.kind == "xdf" else None,
            body=one.body,
            remark=sentences(remark, doubt, _refused_lines(one)),
        )
        write = copied(one.content, one.sha256) if isinstance(one.content, Path) else one.write

        def make_way() -> None:
            if taken is not None:
                set_aside(self._folder, taken, "replaced by another file")

        source = put(self._folder, described, write, make_way)
        self._sources[key], self.fresh[key] = source, one.imported
        return source

    def _refuse_rehearsal(self, one: Incoming) -> None:
        if one.imported.session["is_simulated"] and not self._settings.is_simulated:
            raise ConfigError(
                "The recording is simulated, and the study is not: a rehearsal is no session. The file was not added. "
                "For a study of simulated sessions, set is_simulated = true in study.toml before the first file."
            )

    def _key(self, recorded: StatedSession) -> tuple[SessionKey, str | None]:
        """Return the session's key, and a remark where the options differ from the file."""
        told = self._said
        said = StatedSession(self._participant(recorded.participant), told.protocol or recorded.protocol,
                    told.session or recorded.session)  # fmt: skip
        if said.participant is None or said.protocol is None or said.session is None:
            missing = " ".join(f"--{name}" for name in said.missing)
            raise ConfigError(f"The file does not state which session it is. Give {missing}.")
        if FIRST_WINDOWS.sub("", said.protocol) not in self._protocols:
            raise ConfigError(
                f"The file's protocol is not one of the study's: {', '.join(sorted(self._protocols))}. Add it under "
                "[[expected]] in study.toml, or give --protocol."
            )
        if not 1 <= said.session <= SESSIONS_MAX:
            raise ConfigError(f"The file's session is not from 1 to {SESSIONS_MAX}. Give --session.")
        other = [name for name in ("protocol", "session") if getattr(recorded, name) not in (None, getattr(said, name))]
        remark = sentences(*(f"The file itself states {name} {getattr(recorded, name)}." for name in other))
        return SessionKey(said.participant, said.protocol, said.session), remark

    def _participant(self, recorded: str | None) -> str | None:
        told = self._said.participant
        if recorded is None:
            if told is not None and told not in self._codes:
                raise ConfigError(
                    f"Participant {told} is not in the study. See `exograv study participant STUDY list`."
                )
            return told
        if not looks_like_code(recorded):
            raise ConfigError(
                "The file's participant does not look like a code. It may be a name, and files are kept unchanged. The "
                "file was not added. Record under codes, or remove the name from a copy."
            )
        code = self._code_of(recorded)
        if code is None:
            raise ConfigError(
                f"The file states participant '{recorded}', who is not in the study. If it was made under another "
                "code, add it with --new-code OLD=CODE. Add a new participant with `exograv study participant STUDY "
                "new`."
            )
        if told not in (None, code):
            raise ConfigError(
                f"The file states participant '{recorded}', but --participant differs. If it was made under another "
                "code, add it with --new-code OLD=CODE."
            )
        return code

    def _code_of(self, recorded: str) -> str | None:
        """Return the study's code for a participant in a file; None if the study has no such participant."""
        code = self._new_codes.get(recorded, recorded) if looks_like_code(recorded) else None
        return code if code in self._codes else None

    def _unreadable(self, path: Path, shown: str, kind: str, sha256: str, sentence: str) -> AddingOutcome:
        if kind == "csv" or not _has_mark(path):
            # Without a known file header the content may be anything and may hold a name, so no copy is kept.
            return self._refused(shown, sentence, sha256)
        put_aside(self._folder, path, sha256, sentence, self._said.participant)
        note(self._folder, "quarantined", sentence, sha256=sha256, participant=self._said.participant)
        return AddingOutcome(shown, "quarantined", sentence)

    def _refused(self, shown: str, sentence: str, sha256: str | None = None) -> AddingOutcome:
        note(self._folder, "refused", f"{shown}: {sentence}", sha256=sha256)
        return AddingOutcome(shown, "refused", sentence)


def _refused_lines(one: Incoming) -> str | None:
    """Count the refused lines of a CSV. These lines are not stored, so no later reading can count them."""
    count = len(one.imported.refusals) if one.kind == "csv" else 0
    return f"Lines of the file that were refused: {count}." if count else None


def _has_mark(path: Path) -> bool:
    """Return True if the file begins like a file of its suffix."""
    try:
        with path.open("rb") as file:
            return file.read(len(MCAP0_MAGIC)).startswith((b"XDF:", b"\x1f\x8b", MCAP0_MAGIC))
    except OSError:
        return False


def _named(key: SessionKey) -> str:
    return f"{key.protocol} {key.session} of {key.participant}"


def worst(outcomes: Sequence[AddingOutcome]) -> bool:
    """Return True if a file was refused or quarantined."""
    return any(one.what in ("refused", "quarantined") for one in outcomes)
