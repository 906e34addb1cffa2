"""Protocol with adaptive support, from a TOML file: blocks per session, and parameters of the rule."""

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, model_validator

from exograv.errors import ConfigError
from exograv.model.rig_settings import Settings

from .assist_as_needed import AssistSettings
from .protocol import read_protocol

FOLDER = Path(__file__).parent / "assist_protocols"
BLOCKS_MAX = 40


class AssistProtocol(Settings):
    """Content of a protocol file with adaptive support."""

    schema_version: Literal[1]
    name: Annotated[str, Field(pattern=r"^[a-z0-9-]{3,40}$")]
    title: Annotated[str, Field(min_length=1, max_length=200)]
    blocks: Annotated[int, Field(ge=1, le=BLOCKS_MAX)]
    """Blocks of attempts in a session. One decision follows each block."""

    support: dict[str, float]
    """Parameters by the names of `AssistSettings`. Absent ones have the defaults there."""

    @cached_property
    def rule(self) -> AssistSettings:
        """Rule with these parameters."""
        block = {"block": int(self.support["block"])} if "block" in self.support else {}
        return AssistSettings(**{**self.support, **block})

    @model_validator(mode="after")
    def _support_is_a_rule(self) -> "AssistProtocol":
        known = [one.name for one in fields(AssistSettings)]
        unknown = [name for name in self.support if name not in known]
        if unknown:
            raise ValueError(f"support has {', '.join(unknown)}; known: {', '.join(known)}")
        if self.support.get("block", 12.0) % 1.0:
            raise ValueError(f"support.block is {self.support['block']}; give a whole number")
        try:
            _ = self.rule
        except ConfigError as error:
            raise ValueError(f"support: {error}") from error
        return self


@dataclass(frozen=True)
class LoadedAssist:
    """Protocol with its file."""

    settings: AssistProtocol
    path: Path
    sha256: str
    """Hash of the file."""


def load_assist_protocol(protocol: str) -> LoadedAssist:
    """Read a protocol by its name, or by the path of a file.

    Raises:
        ConfigError: There is no such protocol, or its content is not valid.
    """
    return LoadedAssist(*read_protocol(protocol, FOLDER, AssistProtocol))
