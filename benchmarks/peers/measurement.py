"""Measurement of one task by all implementations: build, check agreement, then time in turns; reports rows and gaps."""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError
from typing import Any

from peers.opponents import OPPONENTS
from peers.tasks.arm_tasks import stacked
from peers.tasks.interface import BatchShape, Call, Missing, Opponent, State, Task

from .agreement import Reference
from .rounds import Effort, timed
from .statistics import percentiles_per_s, percentiles_us

Report = Callable[[dict[str, Any]], None]
"""Receiver of reports: `{"row": …}`, `{"missing": …}`, or `{"at": …}` before a step that may crash the process."""


@dataclass(frozen=True)
class Measurement:
    """Name and task of one row, and the effort spent on it."""

    task: Callable[[], Task]
    """Function that draws the task when the row is measured."""

    name: str
    """Name of the row."""

    batch: BatchShape | None
    effort: Effort
    left_out: Mapping[str, str]
    """Reason by implementation that is left out."""

    asked: tuple[str, ...] = ()
    """Names of the implementations that are asked; empty for all."""


def hold(measurement: Measurement, report: Report) -> None:
    """Measure one row of all implementations."""
    task = measurement.task()
    calls, errors = _agreeing(task, measurement, report)
    report({"at": [measurement.name, None]})
    for name, times in timed(calls, _states(task, measurement.batch), measurement.effort).items():
        batch = measurement.batch
        figures = percentiles_us(times) if batch is None else percentiles_per_s(times, batch.size)
        report({"row": row(measurement.name, name, batch is None, figures, len(times), errors[name])})


def versions(report: Report) -> dict[str, str]:
    """Return the version of every installed implementation."""
    found = {}
    for opponent in OPPONENTS:
        report({"at": ["versions", opponent.name]})
        with contextlib.suppress(Missing, PackageNotFoundError):
            found[opponent.name] = opponent.version()
    return found


def row(
    name: str, implementation: str, is_single: bool, figures: Mapping[str, float], n: int, error: float
) -> dict[str, Any]:
    """Return a row of the result file: µs per call of a single state, or evaluations per second of a batch."""
    return {
        "name": name,
        "implementation": implementation,
        "unit": "us" if is_single else "evaluations/s",
        **{key: float(f"{value:.4g}") for key, value in figures.items()},
        "n": n,
        "error_vs_reference": float(f"{error:.2g}"),
    }


def _agreeing(task: Task, measurement: Measurement, report: Report) -> tuple[dict[str, Call], dict[str, float]]:
    reference, calls, errors = Reference(task), {}, {}
    for opponent in OPPONENTS:
        name = opponent.name
        if measurement.asked and name not in measurement.asked:
            continue
        report({"at": [measurement.name, name]})
        try:
            if name in measurement.left_out:
                raise Missing(measurement.left_out[name])
            calls[name], errors[name] = _built(opponent, task, measurement.batch, reference)
        except Missing as missing:
            report({"missing": {"implementation": name, "row": measurement.name, "reason": str(missing)}})
    return calls, errors


def _built(opponent: Opponent, task: Task, batch: BatchShape | None, reference: Reference) -> tuple[Call, float]:
    try:
        call = opponent.build(task, batch)
        return call, reference.error_of(call, batch)
    except Missing:
        raise
    except Exception as error:  # no error of an opponent may end the run
        first = (str(error).strip().splitlines() or [""])[0]
        raise Missing(f"failed: {type(error).__name__}: {first}"[:200]) from error


def _states(task: Task, batch: BatchShape | None) -> Callable[[int], State]:
    if batch is None:
        return lambda turn: task.states[turn % len(task.states)]
    return lambda turn: stacked(task, batch.size, turn)
