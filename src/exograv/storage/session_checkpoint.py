"""Checkpoint of a session, written beside the recording after each record so that the run can be resumed."""

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
    """Controller's knowledge of machine and arm, to the last bit."""

    machine: JsonObject
    x: list[float]
    covariance: list[list[float]]
    slid_m: tuple[float, ...] = ()
    """Way of each cuff along the limb since it was fastened [m]; empty if no cuff has moved."""

    @classmethod
    def of(
        cls, machine: CalibratedMachine, x: np.ndarray, covariance: np.ndarray, slid_m: tuple[float, ...] = ()
    ) -> "KnownPerson":
        """Return the record from arrays."""
        return cls(machine=json_value(machine), x=x.tolist(), covariance=covariance.tolist(), slid_m=slid_m)


class KeptArm(Settings):
    """Parameters of an arm with their covariance, to the last bit."""

    x: list[float]
    covariance: list[list[float]]

    @classmethod
    def of(cls, x: np.ndarray, covariance: np.ndarray) -> "KeptArm":
        """Return the record from arrays."""
        return cls(x=x.tolist(), covariance=covariance.tolist())

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray]:
        """Return parameters and covariance as arrays."""
        return np.array(self.x), np.array(self.covariance)


class CheckedArm(KeptArm):
    """Estimate from rests for the participant's file, with the result of its check."""

    motion_s: float
    outcome: str
    predicted_left_over_Nm: list[float]
    held_out_error_Nm: list[float]
    held_out_s: float


class KeptRests(Settings):
    """State of learning in rests, from which a resumed session continues."""

    start: KeptArm
    """Arm at the start of the session, which a decision to float refers to."""
    estimate: KeptArm
    motion_s: float = 0.0
    """Driven motion of the estimate [s]."""
    rests: int = 0
    left_out: int = 0
    """Number of restless motions that the estimate does not use."""
    is_contradicted: bool = False
    """True if the last motion contradicted the estimate before it."""
    checked: CheckedArm | None = None
    """Estimate for the participant's file; None before the first rest that gave one."""


class LearnedState(Settings):
    """State that a virtual participant keeps between sessions."""

    slow: tuple[Share, ...]
    """Slow states of `Adaptation`, one per context [-]."""

    aim: tuple[Share, Share]
    """Offset of the aim from the target, right and up [m]."""


class KeptSession(Settings):
    """Content of a session's checkpoint file."""

    schema_version: Literal[1] = 1
    options: OptionRecord
    t: float
    """Time of the last record on the rig's clock [s]."""

    passed_s: float = 0.0
    """Time of rests that has passed without ticks [s]."""

    run: str
    """State of the task, from `Run.kept()`."""

    records: int | None = None
    """Number of the run's records in the recording; later ones belong to no checkpoint. None if it is not counted."""

    person: KnownPerson | None
    """Knowledge of the person; None on a machine that only records."""

    rests: KeptRests | None = None
    """State of learning in rests; None without it."""

    before: JsonObject
    """Figures of the run before its windows, in the form of the room that makes the run."""

    learned: LearnedState | None = None
    """Learned state of the virtual participant; None without one."""


SESSION_FILE = StateFile[KeptSession](
    pack=KeptSession.model_dump_json,
    unpack=KeptSession.model_validate_json,
    advice=Advice(
        too_large=f"{{path}} has more than {{most}} bytes; it is not the state of a run. {AFRESH}",
        unreadable="There is no run to go on with: {path} cannot be read ({why}). Leave --resume out, or give the "
        "--out, --participant, --protocol and --session of the interrupted run.",
        damaged=f"{{path}} is damaged: {{why}} {AFRESH}",
        other="--{name} is {value}, and the run in {path} was started with {found}. Give the same value.",
        unwritable="{path} cannot be written: {why}. Free some space there; then resume the run with --resume "
        "from its last state.",
    ),
    is_private=True,
    makes_folder=False,
)


def session_name(participant: str | None, protocol: str, session: int, windows: int | None = None) -> str:
    """Return the name of the files of a session with a person, or of a trial of its first windows, without suffix."""
    part = "" if windows is None else f"-first-{windows}"
    return f"{participant or 'console'}_{Path(protocol).stem}{part}_{session:02d}"


def checkpoint_path(folder: Path, session: str, *, is_simulated: bool) -> Path:
    """Return the checkpoint of a session by its name. A simulation has another file, so that it blocks no session."""
    return folder / f"{session}{'.simulated' if is_simulated else ''}.run.json"


def read_kept(path: Path, options: OptionRecord) -> KeptSession:
    """Return the state of a run with these options.

    Raises:
        ConfigError: The file is missing, damaged, or of a run with other options.
    """
    kept = SESSION_FILE.read(path)
    SESSION_FILE.refuse_other(path, kept.options, options)
    return kept


def refuse_kept(path: Path) -> None:
    """Refuse to start a run where one of this name exists: a second start overwrites no data.

    Raises:
        ConfigError: A run of this name exists.
    """
    if path.exists():
        raise ConfigError(
            f"{path} holds a run of this session. Resume it with --resume if it was interrupted; else give another "
            "--session or --out."
        )
