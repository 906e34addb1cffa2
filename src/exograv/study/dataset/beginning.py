"""A new study: its folder and the files that somebody fills in."""

from pathlib import Path

from exograv.errors import ConfigError, RecordingError
from exograv.study.folder.journal import note
from exograv.study.folder.settings import StudySettings, write_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import write_register

from .making import refresh


def begin_study(path: Path, settings: StudySettings) -> StudyFolder:
    """Make the folder, with empty tables.

    Raises:
        ConfigError: There is something already.
        RecordingError: It cannot be written.
    """
    folder = StudyFolder(path)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigError(f"{path} is there already and not empty. A study begins in a folder of its own.")
    try:
        for place in (folder.path, folder.sources, folder.quarantine, folder.derivatives):
            place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{path} cannot be made: {error.strerror}. Give another path.") from error
    write_settings(folder, settings)
    write_register(folder, ())
    refresh(folder)
    note(folder, "begun", f"A study with the groups {', '.join(settings.groups)}.")
    return folder
