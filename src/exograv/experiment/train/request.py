"""Protocol, group and machine of a session, from the options and the files that they name."""

from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.model.description import ACTIVE_RIG, PASSIVE_RIG, validation_sentences
from exograv.safety.guard import GRAVITY_LEVEL_MAX
from exograv.task.allocation import AllocationList, exo_for, group_of
from exograv.task.protocol import LoadedProtocol, first_windows, load_protocol, refuse_levels
from exograv.task.protocol_schema import ExoMode

from .options import TrainOptions

ALLOCATION_MAX_BYTES = 1_000_000


@dataclass(frozen=True)
class TrainingRequest:
    """Protocol, group and machine of a session."""

    loaded: LoadedProtocol
    """Protocol of the run: the whole file, or its first windows."""

    exo: ExoMode
    rig: str
    allocation_sha256: str | None
    is_whole: bool
    """True if all windows of the file are run."""


def asked_for(options: TrainOptions) -> TrainingRequest:
    """Read protocol and allocation.

    Raises:
        ConfigError: A file is not valid, or this machine does not make the protocol's levels.
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
    """Read the sealed list of a study. Return it with the hash of its file.

    Raises:
        ConfigError: The file cannot be read, or is not such a list.
    """
    import hashlib

    try:
        if path.stat().st_size > ALLOCATION_MAX_BYTES:
            raise ConfigError(
                f"{path} has more than {ALLOCATION_MAX_BYTES} bytes; a list has about 100 bytes per place."
            )
        content = path.read_bytes()
        return AllocationList.model_validate_json(content), hashlib.sha256(content).hexdigest()
    except OSError as error:
        raise ConfigError(f"--allocation {path} cannot be read: {error.strerror}. Give the study's list.") from error
    except ValidationError as error:
        raise ConfigError(
            f"--allocation {path} is not an allocation list: {validation_sentences(error)} Give the list that was "
            "drawn."
        ) from error
