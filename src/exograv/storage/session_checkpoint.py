"""What is kept beside the recording after each record, so that a run that was broken off can be gone on with."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings
from exograv.options import OptionRecord
from exograv.results import JsonObject, json_value

from .checkpoint import Advice, StateFile

Share = Annotated[float, Field(ge=-100.0, le=100.0)]
AFRESH = "Begin a new session with another --session number."


class KnownPerson(Settings):
    """What control knew of machine and arm, to the last bit."""

    machine: JsonObject
    x: list[float]
    covariance: list[list[float]]

    @classmethod
    def of(cls, machine: CalibratedMachine, x: np.ndarray, covariance: np.ndarray) -> "KnownPerson":
        """As JSON."""
        return cls(machine=json_value(machine), x=x.tolist(), covariance=covariance.tolist())


class LearnedState(Settings):
    """What a virtual participant takes along."""

    slow: tuple[Share, ...]
    """Of `Adaptation`."""

    aim: tuple[Share, Share]
    """Beside the target, right and up [m]."""


class KeptSession(Settings):
    """The whole file."""

    schema_version: Literal[1] = 1
    options: OptionRecord
    t: float
    """On the rig's clock, of the last that is known [s]."""

    run: str
    """`Run.kept()`."""

    person: KnownPerson | None
    """None of a machine that only records."""

    before: JsonObject
    """Figures of the run before its windows, by the room that makes the run."""

    learned: LearnedState | None = None
    """By the virtual participant, until then."""


SESSION_FILE = StateFile[KeptSession](
    pack=KeptSession.model_dump_json,
    unpack=KeptSession.model_validate_json,
    advice=Advice(
        too_large=f"{{path}} has more than {{most}} bytes; it is no run. {AFRESH}",
        unreadable="There is no run to go on with: {path} cannot be read ({why}). Leave --resume out, or give the "
        "--out, --participant, --protocol and --session of the run that was broken off.",
        damaged=f"{{path}} is damaged: {{why}} {AFRESH}",
        other="--{name} is {value}, and the run in {path} was begun with {found}. Give the same.",
        unwritable="{path} cannot be written: {why}. Free some space there; the run can be gone on with by --resume "
        "from where it was kept last.",
    ),
    is_private=True,
    makes_folder=False,
)


def read_kept(path: Path, options: OptionRecord) -> KeptSession:
    """State of a run with these options.

    Raises:
        ConfigError: There is no such file, it is damaged, or of other options.
    """
    kept = SESSION_FILE.read(path)
    SESSION_FILE.refuse_other(path, kept.options, options)
    return kept


def refuse_kept(path: Path) -> None:
    """Refuse to begin where a run of this name is: a second start overwrites no data.

    Raises:
        ConfigError: A run of this name is there.
    """
    if path.exists():
        raise ConfigError(
            f"{path} holds a run of this session. Go on with it by --resume if it was broken off; else give another "
            "--session or --out."
        )
