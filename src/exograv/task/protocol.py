"""Protocol of a session: loaded by name, or from a file of the laboratory."""

import difflib
import hashlib
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.model.description import validation_sentences
from exograv.model.rig_settings import Settings
from exograv.results import MERGED

from .levels import EARTH
from .protocol_schema import Protocol, level_value

FOLDER = Path(__file__).parent / "protocols"
SIZE_MAX_BYTES = 200_000
"""Upper limit of a protocol file's size. A normal protocol has 3000 bytes."""

Read = TypeVar("Read", bound=Settings)


@dataclass(frozen=True)
class RecordedProtocol:
    """Protocol as a recording holds it."""

    sha256: str
    rest_lengths_s: Sequence[float]
    settings: Protocol = field(metadata=MERGED)


@dataclass(frozen=True)
class LoadedProtocol:
    """Protocol with its file."""

    settings: Protocol
    path: Path
    sha256: str
    """Hash of the file."""

    @property
    def recorded(self) -> "RecordedProtocol":
        """Values, rests, and list of unpublished values, for the settings of a recording."""
        return RecordedProtocol(self.sha256, self.settings.rest_lengths_s, self.settings)


def protocol_names(folder: Path = FOLDER) -> list[str]:
    """Names of the protocols that come with exograv."""
    return sorted(path.stem for path in folder.glob("*.toml"))


def load_protocol(protocol: str) -> LoadedProtocol:
    """Read a protocol by its name, or by the path of a file.

    Raises:
        ConfigError: There is no such protocol, or its content is not valid.
    """
    return LoadedProtocol(*read_protocol(protocol, FOLDER, Protocol))


def read_protocol(protocol: str, folder: Path, schema: type[Read]) -> tuple[Read, Path, str]:
    """Read a protocol of a folder by its name, or from the path of a file: settings, path, and the file's SHA-256.

    Raises:
        ConfigError: There is no such protocol, or its content is not valid.
    """
    names = protocol_names(folder)
    path = folder / f"{protocol}.toml" if protocol in names else Path(protocol)
    if not path.is_file():
        near = difflib.get_close_matches(protocol, names, n=1)
        hint = f" Did you mean '{near[0]}'?" if near else ""
        raise ConfigError(f"No protocol '{protocol}'.{hint} Known: {', '.join(names)}; or give the path of a file.")
    try:
        size = path.stat().st_size
        if size > SIZE_MAX_BYTES:
            raise ConfigError(f"{path} has {size} bytes; a protocol has at most {SIZE_MAX_BYTES}. Give another file.")
        content = path.read_bytes()
        settings = schema.model_validate(tomllib.loads(content.decode("utf-8")))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Check its permissions.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there.") from error
    return settings, path, hashlib.sha256(content).hexdigest()


def refuse_levels(protocol: Protocol, level_max: float) -> None:
    """Reject a protocol with gravity levels that this machine may not make.

    Raises:
        ConfigError: A level is above the machine's limit.
    """
    if protocol.exo != "active":
        return
    hyper = 0.0 if protocol.hypergravity is None else level_value(protocol.hypergravity.level)
    for entry in protocol.windows.levels:
        highest = max(entry.start, entry.end, hyper)
        if highest > level_max:
            push = " A level above 1 pushes the arm down." if highest > EARTH else ""
            raise ConfigError(
                f"Protocol '{protocol.name}' has gravity level {highest:g} from window {entry.window} on; this machine "
                f"makes at most {level_max:g}.{push} Lower windows.levels, or use a passive protocol."
            )


def first_windows(loaded: LoadedProtocol, count: int) -> LoadedProtocol:
    """Protocol with only the first `count` windows, for a trial. Its name differs from that of the whole protocol.

    Raises:
        ConfigError: The protocol has fewer windows.
    """
    protocol = loaded.settings
    if not 1 <= count <= protocol.windows.count:
        raise ConfigError(f"--windows is {count}; '{protocol.name}' has 1 to {protocol.windows.count}.")
    if count == protocol.windows.count:
        return loaded
    content = protocol.model_dump(mode="json")
    first = protocol.windows.first_number
    content["windows"]["count"] = count
    content["windows"]["levels"] = [one for one in content["windows"]["levels"] if one["window"] < first + count]
    rests = list(protocol.rest_lengths_s)[: count - 1]
    table = {"each_s": rests} if rests else {"rest_s": protocol.rest_lengths_s[0]}
    content["rests"], content["rest_tables"] = "part", {"part": table}
    content["name"] = f"{protocol.name[:28]}-first-{count}"
    content["title"] = f"The first {count} of {protocol.windows.count} windows. {protocol.title}"[:200]
    content["unpublished"] = sorted({*content["unpublished"], "windows.count", "rests", "rest_tables"})
    return LoadedProtocol(Protocol.model_validate(content), loaded.path, loaded.sha256)
