"""Creation of a new study: its folder and the files that the experimenter completes."""

from pathlib import Path

from exograv.errors import ConfigError, RecordingError
from exograv.study.folder.journal import note
from exograv.study.folder.settings import StudySettings, write_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import write_register

from .making import refresh


def begin_study(path: Path, settings: StudySettings) -> StudyFolder:
    """Create the folder of a study, with empty tables.

    Raises:
        ConfigError: The path exists already and is not an empty folder.
        RecordingError: The folder cannot be written.
    """
    folder = StudyFolder(path)
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigError(
            f"{path} exists already and is not an empty folder. Give a new path: a study needs its own folder."
        )
    try:
        for place in (folder.path, folder.sources, folder.quarantine, folder.derivatives):
            place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{path} cannot be created: {error.strerror}. Give another path.") from error
    write_settings(folder, settings)
    write_register(folder, ())
    refresh(folder)
    note(folder, "begun", f"The study was created with the groups {', '.join(settings.groups)}.")
    return folder
