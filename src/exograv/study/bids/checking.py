"""Checks beyond the BIDS validator: numbers without header, rows against channels, lists against files, hashes."""

import csv
import gzip
import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pacsv

from exograv.study.dataset.sources import sha256_of

from .bdf import read_bdf_header
from .files import MISSING
from .manifest import files_of, read_manifest
from .names import TASK

IDENTIFYING = frozenset(
    {
        "name", "first_name", "last_name", "surname", "initials", "birth_date", "date_of_birth", "birthday", "email",
        "phone", "address", "age", "height", "mass", "weight",
    }
)  # fmt: skip
"""Columns of people that our export never has; body data are exported in bands."""

LISTED = ("_motion.tsv", "_beh.tsv", "_physio.tsv.gz", "_eeg.bdf", "_emg.bdf")
"""Endings of the data files that `_scans.tsv` lists."""


def problems_of(root: Path, with_hashes: bool = True) -> list[str]:
    """Return all problems of a data set, one sentence each; empty if there are none.

    Args:
        root: Folder of the data set.
        with_hashes: Read every file again and compare its hash with the manifest.
    """
    return list(_problems(root, with_hashes))


def _problems(root: Path, with_hashes: bool) -> Iterator[str]:
    names = list(files_of(root))
    yield from _participants(root, names)
    for name in names:
        if name.startswith("sub-") and name.endswith("_motion.tsv"):
            yield from _motion(root, name)
        elif name.startswith("sub-") and name.endswith("_events.tsv"):
            yield from _events(root, name)
        elif name.startswith("sub-") and name.endswith("_physio.tsv.gz"):
            yield from _physio(root, name)
        elif name.startswith("sub-") and name.endswith(("_eeg.bdf", "_emg.bdf")):
            yield from _biosignal(root, name)
        elif name.startswith("sub-") and name.endswith("_scans.tsv"):
            yield from _scans(root, name, names)
    for folder in sorted({"/".join(name.split("/")[:2]) for name in names if name.startswith("sub-")}):
        if not any(name.startswith(folder) and name.endswith("_scans.tsv") for name in names):
            yield f"{folder} has no _scans.tsv."
    yield from _manifest(root, names, with_hashes)


def read_rows(path: Path) -> tuple[list[str], list[dict[str, str]]]:
    """Read header and rows of a table."""
    with path.open(encoding="utf-8", newline="") as file:
        reader = csv.DictReader(file, delimiter="\t", quoting=csv.QUOTE_NONE, restkey="more", restval="")
        rows = list(reader)
    return list(reader.fieldnames or ()), rows


def _participants(root: Path, names: list[str]) -> Iterator[str]:
    if not (root / "participants.tsv").is_file():
        yield "participants.tsv is missing."
        return
    header, rows = read_rows(root / "participants.tsv")
    listed = [row.get("participant_id", "") for row in rows]
    for name in sorted({name.split("/")[0] for name in names if name.startswith("sub-")} - set(listed)):
        yield f"{name} is not in participants.tsv."
    if twice := sorted({name for name in listed if listed.count(name) > 1}):
        yield f"participants.tsv lists {', '.join(twice)} more than once."
    if identifying := sorted(IDENTIFYING & {name.lower() for name in header}):
        yield f"participants.tsv has the column {', '.join(identifying)}, which may identify a person."


def _motion(root: Path, name: str) -> Iterator[str]:
    path = root / name
    _, channels = read_rows(path.with_name(path.name.replace("_motion.tsv", "_channels.tsv")))
    types = [channel.get("type") for channel in channels]
    numbers = read_numbers(path, [k for k, kind in enumerate(types) if kind == "LATENCY"])
    if isinstance(numbers, str):
        yield f"{name}: {numbers}"
        return
    if not _has_end(path):
        yield f"{name}: the last row has no end of line."
    if numbers.columns != len(channels):
        yield f"{name} has {numbers.columns} columns, but channels.tsv describes {len(channels)}."
        return
    if not numbers.is_time:
        yield f"{name}: LATENCY does not begin at 0 and increase from row to row."
    sidecar = _json(path.with_suffix(".json"))
    if sidecar.get("RowCount") != numbers.rows:
        yield f"{name} has {numbers.rows} rows, but its sidecar counts {sidecar.get('RowCount')}."
    if sidecar.get("MotionChannelCount") != len(channels):
        yield f"{name}: MotionChannelCount of the sidecar differs from the number of channels, {len(channels)}."
    counted = {key.removesuffix("ChannelCount"): n for key, n in sidecar.items() if key.endswith("ChannelCount")}
    if wrong := [kind for kind, count in counted.items() if kind != "Motion" and types.count(kind) != count]:
        yield f"{name}: sidecar and channels.tsv differ in the number of channels of type {', '.join(wrong)}."


def _physio(root: Path, name: str) -> Iterator[str]:
    columns = _json(root / name.replace(".tsv.gz", ".json")).get("Columns", [])
    numbers = read_numbers(root / name, [k for k, column in enumerate(columns) if column == "latency"])
    if isinstance(numbers, str):
        yield f"{name}: {numbers}"
    elif numbers.columns != len(columns):
        yield f"{name} has {numbers.columns} columns, but its sidecar describes {len(columns)}."
    elif not numbers.is_time:
        yield f"{name}: latency does not begin at 0 and increase from row to row."


def _biosignal(root: Path, name: str) -> Iterator[str]:
    path = root / name
    header = read_bdf_header(path)
    _, channels = read_rows(path.with_name(f"{path.stem.rpartition('_')[0]}_channels.tsv"))
    if header.channels != len(channels):
        yield f"{name} has {header.channels} channels, but channels.tsv describes {len(channels)}."
    if header.bytes != path.stat().st_size:
        yield f"{name} has {path.stat().st_size} bytes, but its header describes {header.bytes}."


@dataclass(frozen=True)
class HeaderlessTable:
    """Size of a table without header, and the state of its time columns."""

    rows: int
    columns: int
    is_time: bool
    """True if the time columns begin at 0 and increase from row to row."""


def read_numbers(path: Path, times: Sequence[int]) -> HeaderlessTable | str:
    """Read a table without header, all finite numbers or `n/a`, or return the problem of the table.

    Args:
        path: Path of the table, which may be compressed.
        times: Indices of the time columns.
    """
    opened = gzip.open if path.suffix == ".gz" else open
    with opened(path, "rb") as file:
        first = file.readline()
    if not first:
        return "the table is empty."
    names = [f"c{k}" for k in range(first.count(b"\t") + 1)]
    rows, is_time = 0, True
    last = dict.fromkeys(times, -np.inf)
    try:
        for batch in _batches(path, names):
            for k, column in enumerate(batch.columns):
                values = column.to_numpy(zero_copy_only=False)
                if np.count_nonzero(~np.isfinite(values)) != column.null_count:
                    return f"a cell is not a finite number; write {MISSING} for a missing value."
                if k in last and len(values):
                    begins = rows > 0 or float(values[0]) == 0.0
                    is_time = is_time and begins and bool((np.diff(values, prepend=last[k]) > 0.0).all())
                    last[k] = float(values[-1])
            rows += batch.num_rows
    except pa.ArrowInvalid as error:
        return f"a cell is not a number or {MISSING}, or rows have different lengths ({str(error)[:120]})."
    return HeaderlessTable(rows, len(names), is_time)


def _batches(path: Path, names: Sequence[str]) -> Iterator[pa.RecordBatch]:
    """Yield some thousand rows at a time: a session with all its ticks has a gigabyte of text."""
    convert = pacsv.ConvertOptions(
        column_types=dict.fromkeys(names, pa.float64()), null_values=[MISSING], strings_can_be_null=True
    )
    parse = pacsv.ParseOptions(delimiter="\t", quote_char=False, ignore_empty_lines=False)
    with pacsv.open_csv(path, pacsv.ReadOptions(column_names=list(names)), parse, convert) as reader:
        yield from reader


def _events(root: Path, name: str) -> Iterator[str]:
    _, rows = read_rows(root / name)
    onsets = [_number(row.get("onset")) for row in rows]
    if any(onset is None for onset in onsets):
        yield f"{name}: an onset is not a number."
        return
    known = [onset for onset in onsets if onset is not None]
    if known != sorted(known):
        yield f"{name}: events are not in the order of their onsets."
    folder, _, file = name.rpartition("/")
    behaviour = root / folder / ".." / "beh" / f"{file.partition(f'_task-{TASK}')[0]}_task-{TASK}_beh.tsv"
    touched = sum(row.get("trial_type") in ("touch", "rejected_touch") for row in rows)
    if behaviour.is_file() and touched != len(read_rows(behaviour)[1]):
        yield f"{name} has {touched} touches, but {behaviour.name} has {len(read_rows(behaviour)[1])}."


def _scans(root: Path, name: str, names: list[str]) -> Iterator[str]:
    folder = name.rpartition("/")[0]
    _, rows = read_rows(root / name)
    listed = [f"{folder}/{row.get('filename', '')}" for row in rows]
    there = [one for one in names if one.startswith(f"{folder}/") and one.endswith(LISTED)]
    if sorted(listed) != sorted(there):
        differ = sorted(set(listed) ^ set(there)) or sorted(listed)
        yield f"{name} and the existing files differ: {', '.join(differ)}."


def _manifest(root: Path, names: list[str], with_hashes: bool) -> Iterator[str]:
    manifest = read_manifest(root)
    if missing := sorted(set(manifest) - set(names)):
        yield f"{missing[0]} is in the manifest but missing ({len(missing)} such files)."
    if added := sorted(set(names) - set(manifest)):
        yield f"{added[0]} exists but is not in the manifest ({len(added)} such files)."
    if with_hashes:
        for name in sorted(set(names) & set(manifest)):
            if sha256_of(root / name) != manifest[name]:
                yield f"{name} was changed after the export: its hash differs."


def _has_end(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n"


def _json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None
