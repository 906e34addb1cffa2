"""Tidy tables of a study in memory and as Parquet files, with exactly the columns of `columns.py`."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from exograv import __version__
from exograv.errors import RecordingError
from exograv.files import write_whole
from exograv.recording.code import code_sha256
from exograv.study.folder.columns import TABLES, Column
from exograv.study.folder.study_folder import StudyFolder

SCHEMA_VERSION = 1
"""Version of the tables' format; increased when a column's name, type or meaning changes."""

MADE_BY = b"exograv"
"""Metadata key of a Parquet file for the text `version;tables SCHEMA_VERSION;code SHA-256`."""


@dataclass(frozen=True)
class Tables:
    """Data of a study, one row per touch, window, session or participant.

    Types in pandas: `str`, `float64` (NA is NaN), `bool`, `int64`, or `Int64` where NA is allowed.
    """

    touches: pd.DataFrame
    windows: pd.DataFrame
    sessions: pd.DataFrame
    participants: pd.DataFrame


def dtype(column: Column) -> str:
    """Return the pandas type of a column."""
    names = {"string": "str", "int64": "Int64" if column.is_nullable else "int64"}
    return names.get(column.kind, column.kind)


def frame(columns: Sequence[Column], rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Make a table of these rows. A column that a row does not have is NA.

    Raises:
        ValueError: A row has an unknown column, or lacks a column that is not nullable: a mistake of the caller.
    """
    names = [column.name for column in columns]
    for row in rows:
        if unknown := row.keys() - set(names):
            raise ValueError(f"No such column: {', '.join(sorted(unknown))}.")
    table = pd.DataFrame({c.name: pd.Series([row.get(c.name) for row in rows], dtype=dtype(c)) for c in columns})
    missing = [c.name for c in columns if not c.is_nullable and bool(table[c.name].isna().any())]
    if missing:
        raise ValueError(f"Rows lack {', '.join(missing)}, which must not be NA.")
    return table


def write_tables(folder: StudyFolder, tables: Tables) -> None:
    """Write all four tables beside the sources, each completely or not at all.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    made_by = {MADE_BY: f"{__version__};tables {SCHEMA_VERSION};code {code_sha256()}".encode()}
    for name, columns in TABLES.items():
        table = pa.Table.from_pandas(getattr(tables, name), schema=schema(columns), preserve_index=False)
        write_parquet(folder.table(name), table.replace_schema_metadata({**(table.schema.metadata or {}), **made_by}))


def write_parquet(path: Path, table: pa.Table) -> None:
    """Write a table completely or not at all.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    write: Callable[[Path], None] = lambda to: pq.write_table(table, to, compression="zstd")  # noqa: E731
    write_whole(path, write)


def read_tables(folder: StudyFolder | Path) -> Tables:
    """Read the tables as they were last made from a study's sources, for example by `exograv study add`.

    Raises:
        RecordingError: A table is missing, has another version, or cannot be read.
    """
    folder = folder if isinstance(folder, StudyFolder) else StudyFolder(Path(folder))
    return Tables(**{field.name: _read(folder.table(field.name), TABLES[field.name]) for field in fields(Tables)})


def _read(path: Path, columns: Sequence[Column]) -> pd.DataFrame:
    try:
        table = pq.read_table(path)
    except (OSError, pa.ArrowException) as error:
        raise RecordingError(
            f"{path} cannot be read: {error}. To make it again from the study's sources, run `exograv study status "
            f"{path.parent.parent} --remake`."
        ) from error
    if table.schema.names != [column.name for column in columns]:
        raise RecordingError(
            f"{path} has columns of another version of exograv. Run `exograv study status {path.parent.parent} "
            "--remake`."
        )
    return table.to_pandas().astype({column.name: dtype(column) for column in columns})


def schema(columns: Sequence[Column]) -> pa.Schema:
    """Return the Arrow schema of a table: names and types of its columns."""
    kinds = {"string": pa.string(), "int64": pa.int64(), "float64": pa.float64(), "bool": pa.bool_()}
    return pa.schema([pa.field(c.name, kinds[c.kind], nullable=c.is_nullable) for c in columns])
