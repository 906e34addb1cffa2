"""`STUDY.toml`: the kind of task, and the grid from which all tasks follow."""

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from exograv.errors import ConfigError
from exograv.model.description import validation_sentences
from exograv.model.rig_settings import Settings

from .kinds import KINDS
from .task import Grid, SweepTask, TaskBatch, TaskKind

TASKS_MAX = 10_000_000
"""Largest number of tasks; the keys of all tasks are kept in memory."""


class StudyFile(Settings):
    """Contents of the file. The kind of task defines the keys of `grid`."""

    schema_version: Literal[1] = 1
    title: Annotated[str, Field(min_length=1, max_length=200)]
    kind: str
    grid: dict[str, Any]


@dataclass(frozen=True)
class Study:
    """Sweep as its file describes it."""

    kind: TaskKind
    grid: Grid
    title: str
    text: str
    """Text of the file, as stored in the table."""

    def batches(self) -> Iterator[TaskBatch]:
        """Yield all tasks in batches."""
        for group in self.grid.groups():
            yield TaskBatch(tuple(SweepTask(self.kind.name, settings) for settings in group))


def load_study(path: Path) -> Study:
    """Read a study file.

    Raises:
        ConfigError: The file cannot be read, or holds a value that cannot be used.
    """
    try:
        text = path.read_text(encoding="utf-8")
        file = StudyFile.model_validate(tomllib.loads(text))
        if file.kind not in KINDS:
            known = " ".join(f"{kind.name}: {kind.what}" for kind in KINDS.values())
            raise ConfigError(f"{path}: kind is '{file.kind}'; allowed: {known}")
        kind = KINDS[file.kind]
        grid = kind.grid.model_validate(file.grid)
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Give the path of a study's TOML file.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there (docs/howto/sweep.md).") from error
    for name, value in file.grid.items():
        if isinstance(value, list) and len({str(one) for one in value}) < len(value):
            raise ConfigError(f"{path}: grid.{name} has a value twice. Name each once.")
    if not 1 <= len(grid) <= TASKS_MAX:
        raise ConfigError(
            f"{path} asks for {len(grid)} tasks; allowed: 1 to {TASKS_MAX}. Divide it into files with other seeds."
        )
    return Study(kind, grid, file.title, text)
