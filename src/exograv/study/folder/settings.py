"""Settings of a study (`study.toml`): name, groups, expected sessions, authors, licence."""

import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tomlkit
from pydantic import Field, ValidationError, model_validator

from exograv.errors import ConfigError
from exograv.files import toml_text, write_whole
from exograv.model.rig_settings import Settings

from .stream_settings import StreamSettings
from .study_folder import StudyFolder

VERSION = 1
"""Version of the format of `study.toml` and `participants.toml`."""

HEAD = "# Settings of a study and its expected sessions. Checked by every `exograv study` command.\n"

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,30}$")]


class ExpectedSessions(Settings):
    """Number of sessions of a protocol that each participant of a group is expected to have."""

    protocol: Name
    sessions: Annotated[int, Field(ge=1, le=99)]
    groups: list[Name] = Field(default=[])
    """Groups that the expectation concerns; empty for all participants. Only such expectations hold for a sealed
    participant.
    """


class StudySettings(Settings):
    """Settings of a study."""

    schema_version: Annotated[int, Field(ge=VERSION, le=VERSION)] = VERSION
    name: Annotated[str, Field(min_length=1, max_length=120)]
    groups: Annotated[dict[Name, str], Field(min_length=1, max_length=10)]
    """Groups by name, each with a sentence that says what happens to its participants."""

    authors: list[str] = Field(default=[])
    licence: Annotated[str, Field(max_length=60)] = ""
    """Licence under which the data may be shared; empty while it is not decided."""

    is_simulated: bool = False
    """True if all participants are simulated; every page then states it."""

    expected: list[ExpectedSessions] = Field(default=[])

    streams: dict[str, StreamSettings] = Field(default={})
    """Statements about EEG and EMG streams, by the name of the stream or by its type."""

    def expected_of(self, group: str | None) -> dict[str, int]:
        """Return the expected sessions by protocol; for None, a sealed participant, those that hold for all."""
        return {one.protocol: one.sessions for one in self.expected if not one.groups or group in one.groups}

    @model_validator(mode="after")
    def _groups_are_known(self) -> "StudySettings":
        if "sealed" in self.groups:
            raise ValueError("groups may not hold 'sealed': this word stands for a group that is still sealed")
        for one in self.expected:
            if unknown := [name for name in one.groups if name not in self.groups]:
                raise ValueError(f"expected has group {', '.join(unknown)}, which is not one of the groups")
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
"""Settings of a new study, after the paper: 16 trainings, 4 familiarisations, one flight."""


def read_settings(folder: StudyFolder) -> StudySettings:
    """Read the settings of the study.

    Raises:
        ConfigError: The folder is no study, or its `study.toml` cannot be used.
    """
    if not folder.settings.is_file():
        raise ConfigError(
            f"{folder.path} is not a study: study.toml is missing. Create a study with `exograv study init`."
        )
    return read_toml(folder.settings, StudySettings)


def write_settings(folder: StudyFolder, settings: StudySettings) -> None:
    """Write `study.toml` completely or not at all.

    Raises:
        RecordingError: The folder cannot be written.
    """
    content: Any = tomlkit.parse(toml_text(settings.model_dump(exclude_none=True), HEAD))
    content["licence"].comment("licence under which the data may be shared, such as CC-BY-4.0")
    content["groups"].comment("what happens to the participants of each group")
    content["streams"].comment("what EEG and EMG devices do not transmit, such as [streams.EMG]")
    for row in content["expected"]:
        row["groups"].comment("empty: all participants")
    write_whole(folder.settings, tomlkit.dumps(content))


Kind = TypeVar("Kind", bound=Settings)


def read_toml(path: Path, kind: type[Kind]) -> Kind:
    """Read a file of typed settings.

    Errors do not repeat values, because a value may be personal data in the wrong place.

    Raises:
        ConfigError: The file cannot be read, or it holds a value that cannot be used.
    """
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Check its path.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML. Correct it, or restore the last copy.") from error
    return checked(kind, content, str(path))


def checked(kind: type[Kind], content: object, where: str) -> Kind:
    """Validate content that was read or typed. Errors do not repeat values.

    Raises:
        ConfigError: A value cannot be used.
    """
    try:
        return kind.model_validate(content)
    except ValidationError as error:
        places = [f"{'.'.join(map(str, one['loc'])) or 'all of it'}: {one['msg']}" for one in error.errors()]
        raise ConfigError(f"{where} cannot be used. {'; '.join(places)}. Correct it.") from None
