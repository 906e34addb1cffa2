"""What a session is asked for, refused before anything moves."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.laboratory.demo_options import DONNINGS_MAX, GRAVITY_LEVEL_MAX
from exograv.laboratory.virtual_laboratory import ACTIVE_RIG, PASSIVE_RIG
from exograv.model.description import Side, validation_sentences
from exograv.task.allocation import AllocationList, exo_for, group_of
from exograv.task.protocol import SESSIONS_MAX, LoadedProtocol, first_windows, load_protocol, refuse_levels
from exograv.task.protocol_schema import ExoMode

CODE = "3 to 16 letters, digits, '+' and '-', with a digit among them: what has none looks like a name"
ALLOCATION_MAX_BYTES = 1_000_000


@dataclass(frozen=True)
class TrainOptions:
    """What `exograv train` is asked for."""

    protocol: str
    participant: str
    """A code, never a name."""
    session: int = 1
    """Which one of this protocol it is for this participant."""
    rig: str | None = None
    """`recupera_like` where absent, and in flight the passive one."""
    side: Side | None = None
    level: int = 2
    """Of the twin's disturbances."""
    seed: int = 0
    donning: int = 0
    calibration: Path | None = None
    person_file: Path | None = None
    """Read where it is there, and written after the identification."""
    allocation: Path | None = None
    windows: int | None = None
    """So many of the protocol's, to try it; all where absent."""
    verify_every: int = 0
    """Windows between two verifications; 0 for none."""
    resume: bool = False
    lsl: bool = False
    """Whether every record goes out as a marker too."""

    def __post_init__(self):
        if re.fullmatch(r"[0-9A-Za-z+-]{3,16}", self.participant) is None or not any(
            letter.isdigit() for letter in self.participant
        ):
            raise ConfigError(
                f"--participant is '{self.participant}'; it must have {CODE}. Give the code that stands for the "
                "person, such as P-07."
            )
        for name, value, low, high in (
            ("level", self.level, 0, 4),
            ("seed", self.seed, 0, 2**31),
            ("session", self.session, 1, SESSIONS_MAX),
            ("donning", self.donning, 0, DONNINGS_MAX),
            ("verify-every", self.verify_every, 0, 500),
        ):
            if not low <= value <= high:
                raise ConfigError(f"--{name} is {value}; allowed: {low} to {high}.")

    @property
    def name(self) -> str:
        """Of all files of this session, without ending."""
        protocol = Path(self.protocol).stem
        return f"{self.participant}_{protocol}_{self.session:02d}"

    @property
    def kept(self) -> dict[str, Any]:
        """What has to be the same when a run is gone on with."""
        return {
            "protocol": self.protocol, "participant": self.participant, "session": self.session, "rig": self.rig,
            "side": self.side, "level": self.level, "seed": self.seed, "donning": self.donning,
            "windows": self.windows, "allocation": None if self.allocation is None else str(self.allocation),
        }  # fmt: skip


@dataclass(frozen=True)
class TrainingRequest:
    """What comes of the options and of the files that they name."""

    loaded: LoadedProtocol
    """To be run: the file's, or a part of it."""

    exo: ExoMode
    rig: str
    allocation_sha256: str | None
    is_whole: bool
    """Whether all windows of the file are run."""


def asked_for(options: TrainOptions) -> TrainingRequest:
    """Read protocol and allocation.

    Raises:
        ConfigError: One of them cannot be used, or this machine does not make what the protocol states.
    """
    loaded = load_protocol(options.protocol)
    refuse_levels(loaded.settings, GRAVITY_LEVEL_MAX)
    exo, sha256 = exo_for(loaded.settings, None), None
    if options.allocation is not None:
        allocation, sha256 = read_allocation(options.allocation)
        exo = exo_for(loaded.settings, group_of(allocation, options.participant))
    rig = options.rig or (PASSIVE_RIG if loaded.settings.opening == "aircraft" else ACTIVE_RIG)
    run = loaded if options.windows is None else first_windows(loaded, options.windows)
    return TrainingRequest(run, exo, rig, sha256, is_whole=run is loaded)


def read_allocation(path: Path) -> tuple[AllocationList, str]:
    """The sealed list of a study, and the hash of its file.

    Raises:
        ConfigError: It cannot be read, or is no such list.
    """
    import hashlib

    try:
        if path.stat().st_size > ALLOCATION_MAX_BYTES:
            raise ConfigError(f"{path} has more than {ALLOCATION_MAX_BYTES} bytes; a list has 100 a place.")
        content = path.read_bytes()
        return AllocationList.model_validate_json(content), hashlib.sha256(content).hexdigest()
    except OSError as error:
        raise ConfigError(f"--allocation {path} cannot be read: {error.strerror}. Give the study's list.") from error
    except ValidationError as error:
        raise ConfigError(
            f"--allocation {path} is no list of a study: {validation_sentences(error)} Give the one that was drawn."
        ) from error
