"""What is kept beside the recording after each record, so that a run that was broken off can be gone on with."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError, RecordingError
from exograv.files import replace_file
from exograv.model.description import validation_sentences
from exograv.model.rig_settings import Settings

SIZE_MAX_BYTES = 20_000_000
Share = Annotated[float, Field(ge=-100.0, le=100.0)]
AFRESH = "Begin a new session with another --session number."


class KnownPerson(Settings):
    """What control knew of machine and arm, to the last bit."""

    machine: dict[str, Any]
    x: list[float]
    covariance: list[list[float]]

    @classmethod
    def of(cls, machine: CalibratedMachine, x: np.ndarray, covariance: np.ndarray) -> "KnownPerson":
        """As JSON."""
        plain = json.loads(json.dumps(asdict(machine), default=np.ndarray.tolist))
        return cls(machine=plain, x=x.tolist(), covariance=covariance.tolist())


class LearnedState(Settings):
    """What a virtual participant takes along."""

    slow: tuple[Share, ...]
    """Of `Adaptation`."""

    aim: tuple[Share, Share]
    """Beside the target, right and up [m]."""


class KeptSession(Settings):
    """The whole file."""

    schema_version: Literal[1] = 1
    options: dict[str, Any]
    t: float
    """On the rig's clock, of the last that is known [s]."""

    run: str
    """`Run.kept()`."""

    person: KnownPerson | None
    """None of a machine that only records."""

    before: dict[str, Any]
    """Figures of what came before the windows."""

    learned: LearnedState | None = None
    """By the virtual participant, until then."""


def write_kept(path: Path, kept: KeptSession) -> None:
    """Write it at once or not at all.

    Raises:
        RecordingError: The place cannot be written.
    """
    try:
        replace_file(path, kept.model_dump_json(), is_private=True)
    except OSError as error:
        raise RecordingError(
            f"{path} cannot be written: {error.strerror}. Free some space there; the run can be gone on with by "
            "--resume from where it was kept last."
        ) from error


def read_kept(path: Path, options: dict[str, Any]) -> KeptSession:
    """What was kept of a run with these options.

    Raises:
        ConfigError: There is none, it is damaged, or of other options.
    """
    try:
        if path.stat().st_size > SIZE_MAX_BYTES:
            raise ConfigError(f"{path} has more than {SIZE_MAX_BYTES} bytes; it is no run. {AFRESH}")
        kept = KeptSession.model_validate_json(path.read_bytes())
    except OSError as error:
        raise ConfigError(
            f"There is no run to go on with: {path} cannot be read ({error.strerror}). Leave --resume out, or give the "
            "--out, --participant, --protocol and --session of the run that was broken off."
        ) from error
    except ValidationError as error:
        raise ConfigError(f"{path} is damaged: {validation_sentences(error)} {AFRESH}") from error
    for name, value in options.items():
        if kept.options.get(name) != value:
            raise ConfigError(
                f"--{name} is {value}, and the run in {path} was begun with {kept.options.get(name)}. Give the same."
            )
    return kept


def refuse_kept(path: Path) -> None:
    """Nobody's data are overwritten by a second start.

    Raises:
        ConfigError: A run of this name is there.
    """
    if path.exists():
        raise ConfigError(
            f"{path} holds a run of this session. Go on with it by --resume if it was broken off; else give another "
            "--session or --out."
        )
