"""Folder of a virtual study: new or resumed, used by one command at a time."""

import contextlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from exograv import __version__
from exograv.errors import ConfigError, RecordingError
from exograv.files import write_whole
from exograv.study.dataset.beginning import begin_study
from exograv.study.folder.journal import LOCK, locked
from exograv.study.folder.settings import AS_PUBLISHED, ExpectedSessions, StudySettings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import new_participant

from .careers import Career
from .options import StudyOptions

SETTINGS, CAREERS, SWEEP, RECORDINGS, STUDY = "simulate_study.json", "careers", "sweep", ".recordings", "study"


@contextlib.contextmanager
def out_folder(folder: Path, options: StudyOptions, everybody: Sequence[Career], resume: bool) -> Iterator[StudyFolder]:
    """Open the study in the folder, new or resumed, with a lock. The lock of a killed command is released by itself.

    Raises:
        ConfigError: The folder holds another study, or a study without `resume`. Or another command uses it.
        RecordingError: The folder cannot be read or written.
    """
    try:
        _refuse(folder, options, resume)
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(
            f"{error.filename or folder} cannot be read or made: {error.strerror}. Give another --out, or check the "
            "folder's owner."
        ) from error
    busy = f"Another exograv study simulate uses {folder}. Wait until it has ended, or give another --out."
    with locked(folder, busy):
        yield StudyFolder(folder / STUDY) if resume else _begin(folder, options, everybody)


def _refuse(folder: Path, options: StudyOptions, resume: bool) -> None:
    path = folder / SETTINGS
    if resume:
        if not path.is_file():
            raise ConfigError(
                f"There is nothing to resume: {path} is missing. Leave --resume out; if {folder} is not empty, "
                "also give another --out."
            )
        if path.read_bytes() != _bound(options).encode():
            raise ConfigError(
                f"{folder} holds a study with other options, or of another version of exograv. Give the options in "
                f"{path}, or another --out without --resume."
            )
        return
    if folder.exists() and not folder.is_dir():
        raise ConfigError(f"--out is {folder}, a file; give an empty or new folder.")
    if folder.exists() and any(one.name != LOCK for one in folder.iterdir()):
        further = "Continue the study in it with --resume, or give" if path.is_file() else "Give"
        raise ConfigError(f"{folder} is not empty. {further} another --out.")


def _bound(options: StudyOptions) -> str:
    """Options and version that a resumed run must match, as stored."""
    return json.dumps({"version": __version__, **asdict(options)}, indent=1)


def _begin(folder: Path, options: StudyOptions, everybody: Sequence[Career]) -> StudyFolder:
    try:
        (folder / CAREERS).mkdir()
        (folder / RECORDINGS).mkdir()
    except OSError as error:
        raise RecordingError(f"{folder} cannot be written: {error.strerror}. Give another --out.") from error
    study = begin_study(folder / STUDY, settings_of_study(options))
    for career in everybody:
        if career.code is not None:
            new_participant(study, "untrained" if career.condition is None else "trained", career.code)
    write_whole(folder / SETTINGS, _bound(options))
    return study


def settings_of_study(options: StudyOptions) -> StudySettings:
    """Return the settings for the study's folder."""
    trained, untrained = options.sessions
    expected = [
        ExpectedSessions(protocol="training", sessions=trained, groups=["trained"]) if trained else None,
        ExpectedSessions(protocol="familiarisation", sessions=untrained, groups=["untrained"]) if untrained else None,
        ExpectedSessions(protocol="flight", sessions=1),
    ]
    groups = {
        "trained": f"{trained} trainings, condition {options.main.name}",
        "untrained": f"{untrained} familiarisations with the passive exoskeleton",
    }
    return AS_PUBLISHED.model_copy(
        update={
            "name": f"Virtual participants, seed {options.seed}",
            "groups": groups,
            "expected": [one for one in expected if one is not None],
            "is_simulated": True,
            "licence": "CC0-1.0",
        }
    )
