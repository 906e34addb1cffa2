"""Command `exograv run train` that kills itself at a moment, for tests.

    python -m tests.scenario.train_killed KIND NUMBER MOMENT WORDS

KIND is the kind of a record of the task, and NUMBER counts the records of this kind in this process. MOMENT is `before`
or `after` the checkpoint with this record. KIND `report` kills before the report, and KIND `end` after it.
"""

import os
import signal
import sys
from collections.abc import Callable

import exograv.report.of_recording.recording_report as reports
from exograv.cli import main
from exograv.experiment.train import train_command
from exograv.task.record_sinks import RecordSink, checkpoint_sink
from exograv.task.records import Record


def end_now(*_: object) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def deadly_sink(kind: str, number: int, is_after: bool) -> Callable[[Callable[[float], None]], RecordSink]:
    """Return `checkpoint_sink` whose sink kills the process at a record."""

    def sink_of(keep: Callable[[float], None]) -> RecordSink:
        whole, count = checkpoint_sink(keep), 0

        def take(t: float, records: tuple[Record, ...]) -> None:
            nonlocal count
            before, count = count, count + sum(record.kind == kind for record in records)
            is_now = before < number <= count
            if is_now and not is_after:
                end_now()
            whole(t, records)
            if is_now:
                end_now()

        return take

    return sink_of


if __name__ == "__main__":
    kind, number, moment, *words = sys.argv[1:]
    written = reports.write_report
    if kind == "report":
        reports.write_report = end_now
    elif kind == "end":
        reports.write_report = lambda *given: (written(*given), end_now())[0]
    else:
        train_command.checkpoint_sink = deadly_sink(kind, int(number), moment == "after")  # pyright: ignore[reportPrivateImportUsage]
    sys.argv[1:] = words
    main()
