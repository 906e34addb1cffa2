"""Mapping of channels in an XDF file of other software to columns of touches, read from a TOML file."""

from typing import Annotated

from pydantic import Field

from exograv.model.rig_settings import Settings


class XdfMapping(Settings):
    """Mapping from XDF channels to columns of touches: name of the stream, channel per column, and fixed values."""

    stream: Annotated[str, Field(min_length=1)]
    """Name of the stream that has one sample per touch."""

    columns: dict[str, str | Annotated[int, Field(ge=0)]]
    """Channel by column of a CSV of touches (docs/howto/study.md): the label of the channel, or its number from 0."""

    fixed: dict[str, str | float | bool] = Field(default={})
    """Values of columns that are the same in all touches."""
