"""`study.toml`: name, groups, sessions that are expected, authors, licence."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tomlkit
from pydantic import Field, ValidationError, model_validator

from exograv.errors import ConfigError
from exograv.files import toml_text, write_whole
from exograv.model.rig_settings import Settings

from .study_folder import StudyFolder

VERSION = 1
"""Of `study.toml` and `participants.toml`."""

HEAD = "# A study: what it is, and which sessions are expected. Checked by every `exograv study` command.\n"

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]


class ExpectedSessions(Settings):
    """So many sessions of a protocol a person of a group shall have."""

    protocol: Name
    sessions: Annotated[int, Field(ge=1, le=99)]
    groups: list[Name] = Field(default=[])
    """Whom it concerns; everybody where it is empty, which is all that can be asked of who is sealed."""


class StudySettings(Settings):
    """What a study is."""

    schema_version: Annotated[int, Field(ge=VERSION, le=VERSION)] = VERSION
    name: Annotated[str, Field(min_length=1, max_length=120)]
    groups: Annotated[dict[Name, str], Field(min_length=1, max_length=10)]
    """What happens to those who are in it, as a sentence, by name."""

    authors: list[str] = Field(default=[])
    licence: Annotated[str, Field(max_length=60)] = ""
    """Under which data may be given on; empty where it was not decided."""

    is_simulated: bool = False
    """Nobody took part; every page says so."""

    expected: list[ExpectedSessions] = Field(default=[])

    def expected_of(self, group: str | None) -> dict[str, int]:
        """Sessions by protocol; of None, who is sealed, what is expected of everybody."""
        return {one.protocol: one.sessions for one in self.expected if not one.groups or group in one.groups}

    @model_validator(mode="after")
    def _groups_are_known(self) -> "StudySettings":
        if "sealed" in self.groups:
            raise ValueError("groups may not hold 'sealed': it stands for a group that is not to be known yet")
        for one in self.expected:
            if unknown := [name for name in one.groups if name not in self.groups]:
                raise ValueError(f"expected has group {', '.join(unknown)}, which is not among the groups")
        return self


AS_PUBLISHED = StudySettings(
    name="Pointing in weightlessness",
    groups={
        "trained": "16 trainings in simulated microgravity with the active exoskeleton",
        "untrained": "4 familiarisations with the passive exoskeleton",
    },
    expected=[
        ExpectedSessions(protocol="training", sessions=16, groups=["trained"]),
        ExpectedSessions(protocol="familiarisation", sessions=4, groups=["untrained"]),
        ExpectedSessions(protocol="flight", sessions=1),
    ],
)
"""What a new study begins with, after the paper: 16 trainings, 4 familiarisations, one flight."""


def read_settings(folder: StudyFolder) -> StudySettings:
    """What the study is.

    Raises:
        ConfigError: The folder is no study, or its `study.toml` cannot be used.
    """
    if not folder.settings.is_file():
        raise ConfigError(f"{folder.path} is no study: study.toml is missing. Begin one by `exograv study init`.")
    return read_toml(folder.settings, StudySettings)


def write_settings(folder: StudyFolder, settings: StudySettings) -> None:
    """Write `study.toml`, at once or not at all.

    Raises:
        RecordingError: The folder cannot be written.
    """
    content: Any = tomlkit.parse(toml_text(settings.model_dump(), HEAD))
    content["licence"].comment("under which data may be given on, such as CC-BY-4.0")
    content["groups"].comment("what happens to those who are in it")
    for row in content["expected"]:
        row["groups"].comment("nobody named: everybody")
    write_whole(folder.settings, tomlkit.dumps(content))


Kind = TypeVar("Kind", bound=Settings)


def read_toml(path: Path, kind: type[Kind]) -> Kind:
    """A file of typed settings. Values are not repeated in an error: they may be what does not belong there.

    Raises:
        ConfigError: It cannot be read, or holds what cannot be used.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Check its path.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is no valid TOML. Correct it, or put the last copy back.") from error
    return checked(kind, content, str(path))


def checked(kind: type[Kind], content: object, where: str) -> Kind:
    """Typed settings of what was read or typed; values are not repeated in an error.

    Raises:
        ConfigError: Something cannot be used.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        places = [f"{'.'.join(map(str, one['loc'])) or 'all of it'}: {one['msg']}" for one in error.errors()]
        raise ConfigError(f"{where} cannot be used. {'; '.join(places)}. Correct it.") from None
