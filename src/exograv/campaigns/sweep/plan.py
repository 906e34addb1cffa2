"""Estimated cost of more wearers, from the times that a sweep has measured."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from exograv.errors import ConfigError, RecordingError

from .study_file import Study

WEARERS = (10_000, 1_000_000, 100_000_000)


@dataclass(frozen=True)
class PlanRow:
    """Cost of one number of wearers."""

    wearers: int
    core_h: float
    price: float | None
    table_bytes: float
    hours: dict[str, float]
    """Hours by number of workers."""


@dataclass(frozen=True)
class SweepPlanResult:
    """Estimated cost of a sweep of more wearers."""

    title: str
    measured: str
    """Sentence about the measured tasks."""

    wearers_measured: int
    core_s_per_wearer: float
    rows: tuple[PlanRow, ...]


def plan(study: Study, folder: Path, workers: Sequence[int], price: float | None) -> SweepPlanResult:
    """Estimate the cost for each number of wearers, with all tasks of the study for every wearer.

    Args:
        study: Study of the sweep that was run.
        folder: Folder of its tables.
        workers: Numbers of workers, one per core.
        price: Price of a core hour; None if unknown.

    Raises:
        ConfigError: An option cannot be used.
        RecordingError: The folder holds no finished sweep.
    """
    if not workers or min(workers) < 1:
        raise ConfigError(f"--plan-workers is {','.join(map(str, workers))}; allowed: 1 and above, by commas.")
    if price is not None and price < 0.0:
        raise ConfigError(f"--price-per-core-hour is {price}; allowed: 0 and above.")
    times, table = folder / "sweep_times.parquet", folder / "sweep.parquet"
    try:
        rows, size = pq.read_table(times), table.stat().st_size
    except (OSError, pa.ArrowException) as error:
        raise RecordingError(f"{times} cannot be read. Run `exograv dev sweep` with this --out first.") from error
    kind = (rows.schema.metadata or {}).get(b"exograv_sweep_kind", b"").decode()
    if kind != study.kind.name or not len(rows):
        raise RecordingError(
            f"{times} has {len(rows)} tasks of kind '{kind}', and the study's kind is '{study.kind.name}'. "
            "Give the study of that sweep, or another --out."
        )
    people = len(rows.group_by(list(study.kind.person)).aggregate([]))
    busy_s = sum(rows["wall_s"].to_pylist())
    core_h, bytes_each = busy_s / 3600 / people, size / people
    measured = (
        f"Measured: {len(rows)} tasks on {people} wearers, {busy_s:.1f} s of a core in all, "
        f"{busy_s / people:.3g} s a wearer. Waiting times of workers are not included."
    )
    costs = tuple(
        PlanRow(
            count,
            count * core_h,
            None if price is None else count * core_h * price,
            count * bytes_each,
            {str(number): count * core_h / number for number in workers},
        )
        for count in WEARERS
    )
    return SweepPlanResult(study.title, measured, people, busy_s / people, costs)
