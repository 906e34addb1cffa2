"""Storage of a sweep's rows as Parquet: parts during the sweep, one table of results and one of times at the end."""

import contextlib
import secrets
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from exograv.errors import RecordingError
from exograv.loop.replay_log import versions
from exograv.study.dataset.tables import schema, write_parquet
from exograv.study.folder.columns import Column, columns_of

from .study_file import Study
from .task import Result, TaskKind

SCHEMA_VERSION = 1
"""Version of the tables; raised whenever a column's name, type or meaning changes."""

KEY = (
    Column("key", "string", "-", "key of the task: hash of its kind and settings"),
    Column("task_seed", "int64", "-", "the task's own seed, from its key"),
)
*OUTCOME, WALL, WORKER, RETRIES = columns_of(Result)
TIMES = (WALL, WORKER, RETRIES)


def table_columns(kind: TaskKind) -> tuple[Column, ...]:
    """Columns that depend neither on the computer nor on the time of the run."""
    named = [Column(f"version_{name}", "string", "-", "version on the worker") for name in versions()]
    return (*KEY, *columns_of(kind.settings), *OUTCOME, *columns_of(kind.results), *named)


class Store:
    """Part files in a folder. Each task counts once."""

    def __init__(self, folder: Path, kind: TaskKind):
        """Open the folder.

        Raises:
            RecordingError: A part cannot be read, or another state of exograv made it.
        """
        self.folder, self._kind = folder, kind
        self.parts = folder / "sweep_parts" / kind.name
        self._whole = schema((*table_columns(kind), *TIMES))
        self.done: dict[str, str] = {}
        """Outcome by key of all tasks that need not run again."""
        for path in self._paths():
            self._refuse_other(path)
            rows = self._read(path).select(["key", "outcome"]).to_pydict()
            self._note(zip(rows["key"], rows["outcome"], strict=True))

    def add(self, results: Sequence[Result], name: str) -> None:
        """Write results as a part of this name, atomically.

        Raises:
            RecordingError: The disk is full.
        """
        ours = {f"version_{name}": value for name, value in versions().items()}
        rows = [
            {
                **asdict(result.task.settings),
                "key": result.task.key,
                "task_seed": result.task.seed,
                **{column.name: getattr(result, column.name) for column in (*OUTCOME, *TIMES)},
                **(asdict(result.values) if result.values is not None else {}),
                **ours,
                "wall_s": round(result.wall_s, 4),
            }
            for result in results
        ]
        write_parquet(self.parts / f"{name}.parquet", pa.Table.from_pylist(rows, schema=self._whole))
        self._note((result.task.key, result.outcome) for result in results)

    def compact(self) -> None:
        """Merge all parts into one. After an interruption some rows exist twice; they count once."""
        paths = self._paths()
        if len(paths) > 1:
            rows = self._rows(paths)
            name = f"all-{secrets.token_hex(8)}"
            write_parquet(self.parts / f"{name}.parquet", rows)
            for path in paths:
                if path.stem != name:
                    path.unlink(missing_ok=True)

    def write_tables(self, study: Study, keys: Collection[str]) -> tuple[Path, Path]:
        """Write results and times of these tasks, by settings. The bytes of the results depend only on the tasks.

        Raises:
            RecordingError: The disk is full.
        """
        rows = self._rows(self._paths())
        rows = rows.filter(_mask(key in keys for key in rows["key"].to_pylist()))
        order = [field.name for field in fields(self._kind.settings)]
        rows = rows.sort_by([(name, "ascending") for name in (*order, "key")])
        told = {
            b"exograv_sweep": f"schema {SCHEMA_VERSION}".encode(),
            b"exograv_sweep_study": study.text.encode(),
            b"exograv_sweep_kind": study.kind.name.encode(),
        }
        named = [column.name for column in table_columns(self._kind)]
        table, times = self.folder / "sweep.parquet", self.folder / "sweep_times.parquet"
        write_parquet(table, rows.select(named).combine_chunks().replace_schema_metadata(told))
        keyed = rows.select(["key", *self._kind.person, *(column.name for column in TIMES)])
        write_parquet(times, keyed.combine_chunks().replace_schema_metadata(told))
        return table, times

    def _note(self, rows: Iterable[tuple[str, str]]) -> None:
        # Tasks that were lost with their worker run again when the sweep is resumed.
        self.done.update((key, outcome) for key, outcome in rows if outcome != "lost")

    def _rows(self, paths: Sequence[Path]) -> pa.Table:
        """Read each task once, and prefer a finished row to a lost one."""
        if not paths:
            return self._whole.empty_table()
        rows = pa.concat_tables([self._read(path) for path in paths])
        outcomes = rows["outcome"].to_pylist()
        kept, lost = (_mask((one == "lost") is is_lost for one in outcomes) for is_lost in (False, True))
        rows = pa.concat_tables([rows.filter(kept), rows.filter(lost)])
        numbered = pa.table({"key": rows["key"], "number": pa.array(range(len(rows)), pa.int64())})
        first = numbered.group_by("key").aggregate([("number", "min")])["number_min"]
        return rows.take(first)

    def _paths(self) -> list[Path]:
        return sorted(self.parts.glob("[!.]*.parquet"))

    def _read(self, path: Path) -> pa.Table:
        with _readable(path):
            return _whole(path)

    def _refuse_other(self, path: Path) -> None:
        with _readable(path):
            found = pq.read_schema(path)
            table = None if found.names != self._whole.names else _whole(path).slice(0, 1)
        if table is not None:
            row = table.to_pylist()[0]
            if all(row[f"version_{name}"] == value for name, value in versions().items()):
                return
        raise RecordingError(
            f"{path} was made by another state of exograv or of its packages: its rows and new ones do not fit into "
            "one table. Give another folder with --out, or return to that state."
        )


@contextlib.contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, pa.ArrowException) as error:
        raise RecordingError(f"{path} cannot be read: {error}. Delete it; its tasks run again.") from error


def _whole(path: Path) -> pa.Table:
    # A single file is read, not a data set: a data set would turn a user's folder named a=b into a column.
    with pq.ParquetFile(path) as file:
        return file.read()


def _mask(rows: Iterable[bool]) -> pa.Array:
    return pa.array(list(rows), pa.bool_())
