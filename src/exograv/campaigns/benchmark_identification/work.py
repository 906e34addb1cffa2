"""Runs of one machine: it is calibrated once, then each wearer runs with every method."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from exograv.errors import ExogravError
from exograv.procedures.identification.estimator_session import build_method
from exograv.procedures.identification.method_names import MethodName

from .cases import Case
from .closed_loop import fly
from .rest_run import take_method_rests
from .runs import MethodRun, Setting
from .stream_replay import is_offline, replay
from .streams import Calibrated, RecordedStream, calibrate, record_stream
from .wearer_judge import WearerJudge

BREAKDOWNS = (ExogravError, np.linalg.LinAlgError, FloatingPointError, ValueError)
"""Exceptions that make a run fail. The failure is counted, and the other runs continue. Linear algebra raises
`ValueError` for non-finite values."""

Tell = Callable[[str], object]
"""Callback for progress sentences."""


@dataclass(frozen=True)
class WearerTask:
    """Runs of one wearer."""

    case: Case
    open_loop: tuple[MethodName, ...]
    closed_loop: tuple[MethodName, ...]

    @property
    def keys(self) -> list[tuple[Setting, MethodName, Case]]:
        """Keys of the runs."""
        opened: list[tuple[Setting, MethodName, Case]] = [("open_loop", name, self.case) for name in self.open_loop]
        return [*opened, *(("closed_loop", name, self.case) for name in self.closed_loop)]

    def left(self, done: Collection[object]) -> "WearerTask":
        """Return the task without the runs whose keys are in `done`."""
        return replace(
            self,
            open_loop=tuple(name for name in self.open_loop if ("open_loop", name, self.case) not in done),
            closed_loop=tuple(name for name in self.closed_loop if ("closed_loop", name, self.case) not in done),
        )


def run_machine(
    tasks: Sequence[WearerTask], tell: Tell, seconds: float, calibrated: Calibrated | None = None
) -> Iterator[MethodRun]:
    """Yield all runs of one machine as they are finished; a failed run is a result too.

    The machine is calibrated first, unless it is `calibrated`.
    """
    case = tasks[0].case
    try:
        calibrated = calibrated or calibrate(case, _spoken(tell, f"machine {case.machine_seed}"))
    except ExogravError as error:
        yield from (_failed(key, f"Stage 0: {error}") for task in tasks for key in task.keys)
        return
    for task in tasks:
        yield from _run_wearer(task, calibrated, seconds, tell)


def _run_wearer(task: WearerTask, calibrated: Calibrated, seconds: float, tell: Tell) -> Iterator[MethodRun]:
    case = task.case
    who = f"level {case.level}, {case.profile}, wearer {case.wearer_seed}"
    try:
        laboratory = case.laboratory()
        judge = WearerJudge(case, laboratory.assembly(), calibrated.machine, laboratory)
    except ExogravError as error:
        yield from (_failed(key, str(error)) for key in task.keys)
        return
    if task.open_loop:
        yield from _replays(task, judge, calibrated, seconds, _spoken(tell, who))
    for name in task.closed_loop:
        tell(f"{who}: closed loop with '{name}'")
        try:
            trace, verdict = fly(judge, calibrated, name, seconds, _silent)
            yield judge.judge_run("closed_loop", name, trace, verdict)
        except BREAKDOWNS as error:
            yield _failed(("closed_loop", name, case), str(error))


def _replays(
    task: WearerTask,
    judge: WearerJudge,
    calibrated: Calibrated,
    seconds: float,
    tell: Callable[[str, float], None],
) -> Iterator[MethodRun]:
    try:
        recorded = record_stream(task.case, calibrated, tell, seconds)
    except ExogravError as error:
        yield from (_failed(("open_loop", name, task.case), str(error)) for name in task.open_loop)
        return
    for name in task.open_loop:
        tell(f"'{name}'", 0.0)
        try:
            yield _replayed(name, judge, recorded, calibrated)
        except BREAKDOWNS as error:
            yield _failed(("open_loop", name, task.case), str(error))


def _replayed(name: MethodName, judge: WearerJudge, recorded: RecordedStream, calibrated: Calibrated) -> MethodRun:
    stream = recorded.stream
    method = build_method(name, stream.assembly, stream.machine, judge.model.again())
    before = take_method_rests(method, judge, calibrated, _silent)
    # Overflow inside a method is the method's own result; the examiner counts non-finite values.
    with np.errstate(all="ignore"):
        trace = replay(method, stream.samples, stream.check)
        end = float(stream.samples.t[-1])
        after = [estimate for estimate in trace.estimates if estimate.t <= end + 1e-9]
        trace = replace(trace, estimates=[*before, *after])
        return replace(judge.judge_run("open_loop", name, trace), offline=is_offline(method))


def _failed(key: tuple[Setting, str, Case], why: str) -> MethodRun:
    setting, name, case = key
    return MethodRun(setting, name, case, list(case.description.places), failed=why)


def _spoken(tell: Tell, who: str) -> Callable[[str, float], None]:
    """Turn a session's progress into sentences, without repetitions."""
    last = ""

    def note(text: str, _share: float) -> None:
        nonlocal last
        if text != last:
            last = text
            tell(f"{who}: {text}")

    return note


def _silent(_text: str, _share: float) -> None:
    """Ignore progress, because the run has been announced."""
