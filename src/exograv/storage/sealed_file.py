"""TOML files with a hash of their own values: calibrations, participants, passes, sheets."""

import hashlib
import json
import tomllib
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.files import replace_file, toml_text
from exograv.model.description import validation_sentences
from exograv.model.rig_settings import Settings

SIZE_MAX_BYTES = 1_000_000
"""Largest size of a file, far above any of these files; a larger one is a mistake."""

CHECK_SUM = """\
# content_sha256 is a check sum against accidental changes. Anybody can compute it again: it is no signature.
"""


class Sealed(Settings):
    """Content of a sealed file; each kind adds its tables and its version."""

    VERSION: ClassVar[int]
    """Value of `schema_version` that is written."""
    OLDER: ClassVar[tuple[int, ...]] = ()
    """Earlier values that are still read."""
    content_sha256: str = ""

    @property
    def hash(self) -> str:
        """SHA-256 of all values except the hash itself."""
        return hashlib.sha256(json.dumps(self._sealed_values(), sort_keys=True).encode()).hexdigest()

    def _sealed_values(self) -> dict[str, Any]:
        """Return the values that the hash covers; for an older version, only those that it has."""
        return self.model_dump(mode="json", exclude={"content_sha256"})


Kind = TypeVar("Kind", bound=Sealed)


def sealed(whole: Kind) -> Kind:
    """Return a copy with its hash."""
    return whole.model_copy(update={"content_sha256": whole.hash})


def write_sealed(path: Path, whole: Sealed, head: str, option: str) -> None:
    """Write the file below the comments `head` and `CHECK_SUM`, or leave the old one as it was.

    Raises:
        ConfigError: The file cannot be written; `option` sets another place.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, toml_text(whole.model_dump(), head + CHECK_SUM), is_private=True)
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}. Give another {option}.") from error


def refuse_other_kind(path: Path, kind: type[Sealed], head: str, option: str) -> None:
    """Check before a run that its result will not replace a file of another kind.

    A damaged file of the same kind may be replaced: its comment or its keys show the kind.

    Args:
        path: Place of the result.
        kind: Kind of the result.
        head: Comment that begins a file of this kind.
        option: Option that sets another place.

    Raises:
        ConfigError: There is a file of another kind, or a folder.
    """
    if not path.exists() or (path.is_file() and _is_of_kind(path, kind, head)):
        return
    raise ConfigError(f"{path} is of another kind, and the result would replace it. Give another path with {option}.")


def _is_of_kind(path: Path, kind: type[Sealed], head: str) -> bool:
    if path.stat().st_size > SIZE_MAX_BYTES:
        return False
    text = path.read_text(encoding="utf-8", errors="replace")
    if not text.strip() or text.startswith(head.split(",", 1)[0]):
        return True
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return "content_sha256" in content and set(content) <= {"schema_version", *kind.model_fields}


def read_sealed(path: Path, kind: type[Kind], give: str, again: str) -> Kind:
    """Read a sealed file.

    Args:
        path: The file.
        kind: Expected kind of content.
        give: Advice if the file cannot be read.
        again: Advice if the file is damaged.

    Raises:
        ConfigError: The file cannot be read, is of another version, or its values do not match its hash.
    """
    content = _content(path, give, again)
    version = content.get("schema_version")
    if version is None:
        raise ConfigError(f"{path} has no schema_version: it is damaged, or of another kind. {again}")
    if version not in (kind.VERSION, *kind.OLDER):
        read = " and ".join(map(str, (*kind.OLDER, kind.VERSION)))
        raise ConfigError(f"{path} has schema_version {version}; this exograv reads version {read}. {again}")
    try:
        whole = kind.model_validate(content)
    except ValidationError as error:
        raise ConfigError(f"{path} is damaged: {validation_sentences(error)} {again}") from error
    if whole.content_sha256 != whole.hash:
        raise ConfigError(
            f"{path} is damaged or edited: its values have the hash {whole.hash[:12]}…, and it says "
            f"{whole.content_sha256[:12]}…. {again}"
        )
    return whole


def _content(path: Path, give: str, again: str) -> dict[str, Any]:
    try:
        if path.stat().st_size > SIZE_MAX_BYTES:
            raise ConfigError(f"{path} has more than the {SIZE_MAX_BYTES} bytes allowed. {give}")
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. {give}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is damaged: it is not valid TOML ({error}). {again}") from error
