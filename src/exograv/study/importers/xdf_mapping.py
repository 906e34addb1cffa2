"""Where touches are in an XDF file of somebody else; a TOML file says it."""

from typing import Annotated

from pydantic import Field

from exograv.model.rig_settings import Settings


class XdfMapping(Settings):
    """Content of the file."""

    stream: Annotated[str, Field(min_length=1)]
    """Name of the stream that has a sample a touch."""

    columns: dict[str, str | Annotated[int, Field(ge=0)]]
    """Column of a CSV of touches (docs/howto/study.md) to the label of a channel, or its number from 0."""

    fixed: dict[str, str | float | bool] = Field(default={})
    """Columns that are the same in all touches."""
