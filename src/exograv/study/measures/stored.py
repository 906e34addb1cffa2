"""Stored measures and traces of a study. A recording is read again only after it has changed."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from exograv.errors import RecordingError
from exograv.study.dataset.tables import Tables, dtype, frame, schema, write_parquet
from exograv.study.folder.columns import Column
from exograv.study.folder.study_folder import StudyFolder

from .catalogue import MEASURES
from .recordings import read_measures
from .table import MEASURED, SESSION, measures_of
from .traces import TRACES

VERSION = 1
"""Version of the measures of recordings. Increase it when a computation changes: recordings are then read again."""

ABOUT = b"exograv sources"
"""Metadata key of the files for version, hash of each session's source, and `StoredMeasures.unpublished`."""

Key = tuple[str, str, int]
"""Key of a session: participant, protocol, number of the session."""

OF_RECORDINGS = sorted({m.name for m in MEASURES if m.origin != "touches"})


@dataclass(frozen=True)
class StoredMeasures:
    """Measures of a whole study."""

    measures: pd.DataFrame
    """Table with the columns `table.MEASURED`."""

    traces: pd.DataFrame
    """Table with the columns `traces.TRACES`."""

    unpublished: dict[str, list[str]]
    """Values by protocol that are the experimenter's choice and not the paper's, as stated in the recordings."""

    remarks: tuple[str, ...] = ()
    """Sentences on recordings that could not be read, one each."""


def measure_study(
    folder: StudyFolder, tables: Tables, tell: Callable[[str], object] = lambda text: None
) -> StoredMeasures:
    """Compute all measures, and write `derivatives/measures.parquet` and `traces.parquet`.

    Args:
        folder: Folder of the study.
        tables: Its tidy tables.
        tell: Called with the path of each recording before it is read.

    Raises:
        RecordingError: A file cannot be written.
    """
    wanted = recordings_of(tables)
    kept = _kept(folder, wanted)
    measures, traces, unpublished = kept.measures, kept.traces, dict(kept.unpublished)
    hashes = {key: wanted[key][1] for key in kept.keys}
    remarks = []
    for key in sorted(wanted.keys() - hashes.keys()):
        source, sha256 = wanted[key]
        tell(source)
        try:
            found = read_measures(folder.source(source), dict(zip(SESSION, key, strict=True)))
        except RecordingError as error:
            remarks.append(f"No movement was measured in {source}: {error}")
            continue
        measures = _with(measures, frame(MEASURED, found.rows))
        traces = _with(traces, frame(TRACES, found.trace))
        hashes[key] = sha256
        unpublished[key[1]] = sorted({*unpublished.get(key[1], ()), *found.unpublished})
    everything = _with(measures_of(tables), measures)
    about = {"version": VERSION, "sources": [[*key, sha256] for key, sha256 in sorted(hashes.items())]}
    about |= {"unpublished": unpublished}
    _write(folder, "measures", MEASURED, everything, about)
    _write(folder, "traces", TRACES, traces, about)
    return StoredMeasures(everything, traces, unpublished, tuple(remarks))


def recordings_of(tables: Tables) -> dict[Key, tuple[str, str]]:
    """Path and hash of the sources that hold more than touches."""
    sessions = tables.sessions[tables.sessions["kind"] == "recording"]
    columns = [sessions[name].tolist() for name in (*SESSION, "source", "sha256")]
    return {(code, protocol, n): (path, sha) for code, protocol, n, path, sha in zip(*columns, strict=True)}


@dataclass(frozen=True)
class _Kept(StoredMeasures):
    """Stored measures of recordings that are still valid."""

    keys: frozenset[Key] = frozenset()


def _kept(folder: StudyFolder, wanted: dict[Key, tuple[str, str]]) -> _Kept:
    nothing = _Kept(frame(MEASURED, []), frame(TRACES, []), {})
    try:
        stored = [pq.read_table(folder.table(name)) for name in ("measures", "traces")]
        about = json.loads((stored[0].schema.metadata or {})[ABOUT])
    except (OSError, KeyError, pa.ArrowException):
        return nothing
    names = [[column.name for column in columns] for columns in (MEASURED, TRACES)]
    if about["version"] != VERSION or [table.schema.names for table in stored] != names:
        return nothing
    keys = frozenset(
        (code, protocol, n)
        for code, protocol, n, sha256 in about["sources"]
        if wanted.get((code, protocol, n), ("", ""))[1] == sha256
    )
    measures, traces = (
        table.to_pandas().astype({c.name: dtype(c) for c in columns})
        for table, columns in zip(stored, (MEASURED, TRACES), strict=True)
    )
    measures = measures[measures["measure"].isin(OF_RECORDINGS)]
    return _Kept(measures[_is_of(measures, keys)], traces[_is_of(traces, keys)], about["unpublished"], (), keys)


def _is_of(table: pd.DataFrame, keys: frozenset[Any]) -> list[bool]:
    return [key in keys for key in table[SESSION].itertuples(index=False, name=None)]


def _with(first: pd.DataFrame, second: pd.DataFrame) -> pd.DataFrame:
    """Concatenate two tables; empty tables lose no types."""
    return pd.concat([each for each in (first, second) if len(each)] or [first], ignore_index=True)


def _write(folder: StudyFolder, name: str, columns: Sequence[Column], table: pd.DataFrame, about: dict) -> None:
    stored = pa.Table.from_pandas(table, schema=schema(columns), preserve_index=False)
    metadata = {**(stored.schema.metadata or {}), ABOUT: json.dumps(about).encode()}
    write_parquet(folder.table(name), stored.replace_schema_metadata(metadata))
