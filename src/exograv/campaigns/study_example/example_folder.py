"""Folder of an example: new, or continued after an interruption; used by one command at a time."""

import contextlib
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from exograv import __version__
from exograv.errors import ConfigError, RecordingError
from exograv.files import PARTIAL
from exograv.recording.code import code_sha256
from exograv.results import json_value
from exograv.storage.checkpoint import Advice, StateFile
from exograv.study.folder.journal import locked
from exograv.study.folder.study_folder import StudyFolder

from .options import ExampleOptions

SIMULATED = ".simulated"
"""Folder of recordings that are not added yet. Its lock keeps a second command away."""

CHECKPOINT = StateFile[dict[str, Any]](
    pack=json.dumps,
    unpack=json.loads,
    advice=Advice(
        damaged="{path} is damaged: {why} Make the example in another folder.",
        too_large="{path} has more than {most} bytes; it is not the checkpoint of an example.",
        other="{path} belongs to an example with {name} {found}, and this command has {value}. Give the same options "
        "to the same version of exograv, or another --out.",
    ),
)


@contextlib.contextmanager
def example_folder(
    path: Path, options: ExampleOptions, begin: Callable[[Path], None]
) -> Iterator[tuple[StudyFolder, Path]]:
    """Open the study, new or continued, and yield it with a folder for recordings. It is unfinished until the end.

    Args:
        path: Folder of the study.
        options: Options of the example.
        begin: Function that creates a study without sessions.

    Raises:
        ConfigError: The folder is not empty, holds another example, or another command uses it.
        RecordingError: The folder cannot be written.
    """
    folder, place, wanted = StudyFolder(path), path / SIMULATED, _wanted(options)
    found = CHECKPOINT.find(folder.unfinished)
    if found is None:
        _begin(folder, wanted, begin)
    else:
        CHECKPOINT.refuse_other(folder.unfinished, found, wanted)
    try:
        place.mkdir(exist_ok=True)
    except OSError as error:
        raise RecordingError(f"{place} cannot be written: {error.strerror}. Check the folder's owner.") from error
    with locked(place, f"Another exograv command is making the example in {path}. Wait until it has ended."):
        for left in place.glob("*.mcap"):
            left.unlink()
        yield folder, place
        shutil.rmtree(place)
        folder.unfinished.unlink()


def _wanted(options: ExampleOptions) -> dict[str, Any]:
    """Options and code that a continued example must match, because recordings name the code that made them."""
    return json_value({"version": __version__, "code": code_sha256(), **asdict(options)})


def _begin(folder: StudyFolder, wanted: dict[str, Any], begin: Callable[[Path], None]) -> None:
    """Create the study under another name first: a command that is killed here leaves no half study behind."""
    path = folder.path
    if path.exists() and (not path.is_dir() or any(path.iterdir())):
        raise ConfigError(
            f"{path} exists already and is not an empty folder. Give a new path: a study needs its own folder."
        )
    partial = path.with_name(f"{PARTIAL}{path.name}")
    try:
        shutil.rmtree(partial, ignore_errors=True)
        begin(partial)
        CHECKPOINT.write(StudyFolder(partial).unfinished, wanted)
        if path.exists():
            path.rmdir()
        partial.rename(path)
    except OSError as error:
        raise RecordingError(f"{path} cannot be created: {error.strerror}. Give another path.") from error
