"""Tables of LeRobot datasets (formats 2 and 3): Parquet files with names in `meta/info.json`, or CSV with such columns.

A feature holds one number per name: `observation.state` with `elbow.pos` and `elbow.current`, or features of their own,
such as `observation.effort`. An `action` counts only if its names say that it is a torque or a current: usually it is a
position.

Source: LeRobotDataset v3.0, https://huggingface.co/docs/lerobot/lerobot-dataset-v3.
"""

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError

INFO = Path("meta") / "info.json"
STATE, ACTION, TIME, EPISODE = "observation.state", "action", "timestamp", "episode_index"

QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "position": ("pos", "position", "q", "qpos"),
    "current": ("current", "cur", "i"),
    "torque": ("torque", "effort", "tau"),
    "temperature": ("temperature", "temp", "motor_temperature"),
}
"""Endings of names, and of features of their own, by quantity."""

BETWEEN_S = 3600.0
"""Time that is put between two episodes, which do not follow each other [s]."""


@dataclass(frozen=True)
class LeRobotTable:
    """Table of a LeRobot dataset, one row per frame; columns in the order of the requested joints."""

    t: Float[np.ndarray, " frame"]
    """Time [s]; episodes are far apart."""

    q: Float[np.ndarray, "frame joint"]
    """Joint positions as the table holds them [rad or °]."""

    current: Float[np.ndarray, "frame joint"] | None
    """Motor currents [A]."""

    torque: Float[np.ndarray, "frame joint"] | None
    """Joint torques [N·m]."""

    current_asked: Float[np.ndarray, "frame joint"] | None
    torque_asked: Float[np.ndarray, "frame joint"] | None

    temperature: Float[np.ndarray, "frame joint"] | None
    """Temperatures of the motors [°C]."""


def is_lerobot(path: Path) -> bool:
    """Return True for the folder of a dataset, one of its Parquet files, or a CSV file with its columns."""
    if path.is_dir():
        return (path / INFO).is_file()
    if path.suffix == ".csv":
        with path.open(encoding="utf-8-sig", errors="replace") as stream:
            return STATE in stream.readline()
    return path.suffix == ".parquet"


def read_lerobot(path: Path, joints: Sequence[str]) -> LeRobotTable:
    """Read all episodes of a dataset, or those of one of its files.

    Raises:
        RecordingError: The table cannot be read, or lacks positions, times, or currents and torques of the joints.
    """
    columns = dict(_of_csv(path) if path.suffix == ".csv" else _of_parquet(path))
    there = ", ".join(columns) or "none"
    q = _group(columns, joints, "observation", "position")
    current, torque = (_group(columns, joints, "observation", quantity) for quantity in ("current", "torque"))
    if TIME not in columns or q is None or (current is None and torque is None):
        raise RecordingError(
            f"{path} lacks {TIME}, or positions and currents or torques of the joints {', '.join(joints)}. Name them "
            f"in {INFO}, as {joints[0]}.pos and {joints[0]}.current in {STATE}. Columns there: {there}."
        )
    t = _one_clock(columns[TIME], columns.get(EPISODE))
    asked = (_group(columns, joints, ACTION, quantity) for quantity in ("current", "torque"))
    warmth = _group(columns, joints, "observation", "temperature")
    return LeRobotTable(t, q, current, torque, *asked, temperature=warmth)


def _one_clock(stamp: Float[np.ndarray, " frame"], episode: Float[np.ndarray, " frame"] | None) -> np.ndarray:
    """Return times that rise over all episodes; each episode's own time begins at zero."""
    if episode is None:
        return _without_rounding(stamp)
    starts = np.flatnonzero(np.diff(episode, prepend=np.nan) != 0.0)
    t, end = stamp.copy(), 0.0
    for first, last in zip(starts, [*starts[1:], len(stamp)], strict=True):
        t[first:last] = end - stamp[first] + _without_rounding(stamp[first:last])
        end = float(t[last - 1]) + BETWEEN_S
    return t


def _without_rounding(stamp: Float[np.ndarray, " frame"]) -> Float[np.ndarray, " frame"]:
    """Return even times if the stamps [s] are even up to their rounding to 32 bits, otherwise the stamps.

    After 256 s the rounding is 15 µs, and the median of the differences is no longer the period of a fast table.
    """
    if not np.isfinite(stamp).all() or len(stamp) < 2:
        return stamp
    even = np.linspace(stamp[0], stamp[-1], len(stamp))
    rounding = float(np.spacing(np.float32(np.abs(stamp).max())))
    return even if np.abs(stamp - even).max() <= rounding else stamp


def _group(
    columns: Mapping[str, np.ndarray], joints: Sequence[str], source: str, quantity: str
) -> Float[np.ndarray, "frame joint"] | None:
    """Return the columns of a quantity, one per joint; None if one is missing."""
    features = [STATE] if source == "observation" else [ACTION]
    names = [[f"{feature}.{joint}.{end}" for joint in joints] for feature in features for end in QUANTITIES[quantity]]
    # Without an ending, a feature of its own says the quantity; that of a plain state is a position.
    plain = [f"{source}.{end}" for end in QUANTITIES[quantity]]
    plain += [STATE] if (source, quantity) == ("observation", "position") else []
    for feature in plain:
        names += [[f"{feature}.{joint}" for joint in joints], [f"{feature}.{k}" for k in range(len(joints))]]
    for group in names:
        # Numbers stand for the joints only if there are as many of them.
        is_numbered = group[0].endswith(".0")
        surplus = is_numbered and f"{group[0][:-2]}.{len(joints)}" in columns
        if all(name in columns for name in group) and not surplus:
            return np.column_stack([columns[name] for name in group])
    return None


def _of_csv(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and values of each column; a cell such as `[0.1 0.2]` holds all numbers of a feature."""
    with path.open(newline="", encoding="utf-8-sig") as stream:
        rows = list(csv.DictReader(stream))
    info = _info_of(path)
    for name in rows[0] if rows else ():
        cells = [row[name] for row in rows]
        try:
            if str(cells[0]).startswith("["):
                values = np.array([cell.strip("[] ").replace(",", " ").split() for cell in cells], dtype=float)
                yield from _named(name, values, info)
            else:
                yield name, np.array(cells, dtype=float)
        except ValueError as error:
            if name in (TIME, EPISODE) or name.startswith((STATE, ACTION)):
                raise RecordingError(f"{path}, column {name}: {error}.") from error


def _of_parquet(path: Path) -> Iterator[tuple[str, np.ndarray]]:
    """Yield name and values of each column of numbers, over all files of the dataset in their order."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    files = sorted((path / "data").rglob("*.parquet")) if path.is_dir() else [path]
    if not files:
        raise RecordingError(f"{path} has no Parquet file below data/. Download the dataset completely.")
    info = _info_of(path)
    try:
        names = [
            field.name
            for field in pq.read_schema(files[0])
            if field.name in (TIME, EPISODE, ACTION) or field.name.startswith("observation.")
        ]
        table = pa.concat_tables([pq.read_table(file, columns=names) for file in files])
    except (pa.ArrowInvalid, OSError) as error:
        raise RecordingError(f"{path} cannot be read as Parquet: {error}.") from error
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        kind = column.type
        if pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind) or pa.types.is_large_list(kind):
            values = np.asarray(column.flatten().to_numpy(zero_copy_only=False), dtype=float)
            if len(column) and len(values) % len(column) == 0:
                yield from _named(name, values.reshape(len(column), -1), info)
        elif pa.types.is_floating(kind) or pa.types.is_integer(kind):
            yield name, np.asarray(column.to_numpy(zero_copy_only=False), dtype=float)


def _named(
    feature: str, values: Float[np.ndarray, "frame number"], info: Mapping[str, Any]
) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the numbers of a feature by their names in the dataset, or by their places if they have none."""
    names = info.get("features", {}).get(feature, {}).get("names")
    if isinstance(names, dict):  # Format 2 may group them: {"motors": [...]}.
        names = next((group for group in names.values() if isinstance(group, list)), None)
    if not isinstance(names, list) or len(names) != values.shape[1] or values.shape[1] == 1:
        names = range(values.shape[1])
    for name, column in zip(names, values.T, strict=True):
        yield f"{feature}.{name}", column


def _info_of(path: Path) -> Mapping[str, Any]:
    """Return the description of the dataset to which a file belongs; empty if there is none."""
    for folder in (path, *path.resolve().parents):
        file = folder / INFO
        if file.is_file():
            try:
                return json.loads(file.read_text(encoding="utf-8"))
            except ValueError as error:
                raise RecordingError(f"{file} is no JSON: {error}.") from error
    return {}
