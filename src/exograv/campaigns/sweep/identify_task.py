"""Task kind `identify`: the benchmark's run of one identification method on one wearer."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from exograv.campaigns.benchmark_identification.cases import Case
from exograv.campaigns.benchmark_identification.measures import (
    COARSE,
    coverage,
    left_over,
    rounded,
    time_to,
    torque_coverage,
)
from exograv.campaigns.benchmark_identification.runs import MethodRun, Setting
from exograv.campaigns.benchmark_identification.stream_replay import DURATIONS_S
from exograv.campaigns.benchmark_identification.work import WearerTask as WearerTask
from exograv.campaigns.benchmark_identification.work import run_machine
from exograv.procedures.identification.method_names import MethodName

from .task import SweepTask, TaskKind
from .wearers import Several, WearerGrid, refuse_other_rig


@dataclass(frozen=True, kw_only=True)
class CaseTask(Case):
    """Case of the benchmark with a machine whose files are known."""

    rig: Annotated[str, "machine"] = ""
    """Machine by name or folder; a sweep always names it."""

    rig_sha256: Annotated[str, "SHA-256 of the machine's rig.toml and URDF"]

    @property
    def case(self) -> Case:
        """Case of the benchmark that this task runs."""
        return Case(**{one.name: getattr(self, one.name) for one in fields(Case)})


@dataclass(frozen=True, kw_only=True)
class IdentifyTask(CaseTask):
    """Settings of one run of a method on one wearer."""

    method: Annotated[MethodName, "identification method"]
    setting: Annotated[Setting, "`open_loop` or `closed_loop`"]
    motion_s: Annotated[float, "duration of the motion"]


@dataclass(frozen=True)
class IdentifyResult:
    """Result of one method on one wearer."""

    time_to_target_s: Annotated[float | None, "time until within the target to the end; NA if never"]
    time_to_coarse_s: Annotated[float | None, "time until within 2.5 times the target to the end"]
    left_over_shoulder_Nm: Annotated[float | None, "worst axis, RMS over held-out postures"]
    left_over_elbow_Nm: Annotated[float | None, "elbow, RMS over held-out postures"]
    possible_share: Annotated[float | None, "share of physically possible estimates"]
    verdict: Annotated[str | None, "verdict of the stop rule"]
    stop_s: Annotated[float | None, "time at which the stop rule would have ended the motion"]
    restless_s: Annotated[float | None, "time at which the wearer was found not to relax"]
    rejected_share: Annotated[float | None, "share of rejected samples"]
    noise_scale: Annotated[float | None, "noise relative to that of the calibration"]
    parameters_covered: Annotated[int | None, "95 % intervals that hold the truth, after at most 120 s"]
    parameters_intervals: Annotated[int | None, "number of these intervals"]
    torque_covered: Annotated[int | None, "95 % intervals of torque at held-out postures that hold the truth"]
    torque_intervals: Annotated[int | None, "number of these intervals"]


class IdentifyGrid(WearerGrid):
    """Grid of methods and wearers."""

    methods: Annotated[list[MethodName], Several] = Field(default=["recursive"])
    settings: Annotated[list[Setting], Several] = Field(default=["open_loop"])
    """Settings: a recorded stream that every method processes alike, or the method drives the arm."""

    motion_s: Annotated[list[Annotated[float, Field(ge=5.0, le=600.0)]], Several] = Field(default=[60.0])
    """Durations of motion [s]; each is a separate motion."""

    def __len__(self) -> int:
        return self.cases_count * len(self.methods) * len(self.settings) * len(self.motion_s)

    def groups(self) -> Iterator[Sequence[IdentifyTask]]:
        """Yield the tasks of one machine together; it is calibrated once for its wearers and all methods."""
        for sha256, cases in self.cases():
            for motion_s in self.motion_s:
                yield [
                    IdentifyTask(**asdict(case), rig_sha256=sha256, method=method, setting=setting, motion_s=motion_s)
                    for case in cases
                    for setting in self.settings
                    for method in self.methods
                ]


def _run(tasks: Sequence[SweepTask], /) -> Iterator[tuple[SweepTask, IdentifyResult | str]]:
    by_key = {(task.settings.setting, task.settings.method, task.settings.case): task for task in tasks}
    cases = {case: None for _, _, case in by_key}
    refuse_other_rig(next(iter(cases)), tasks[0].settings.rig_sha256)
    wearers = [
        WearerTask(case, _methods(by_key, "open_loop", case), _methods(by_key, "closed_loop", case)) for case in cases
    ]
    for run in run_machine(wearers, lambda _text: None, tasks[0].settings.motion_s):
        yield by_key[run.key], run.failed if run.failed is not None else _result(run)


def _methods(by_key: dict[Any, SweepTask], setting: Setting, case: Case) -> tuple[MethodName, ...]:
    return tuple(method for where, method, who in by_key if (where, who) == (setting, case))


def _result(run: MethodRun) -> IdentifyResult:
    end = run.t[-1]
    parameters, torque = (count([run], f"{DURATIONS_S[-1]:g}") for count in (coverage, torque_coverage))
    return IdentifyResult(
        time_to_target_s=rounded(time_to(run)),
        time_to_coarse_s=rounded(time_to(run, COARSE)),
        left_over_shoulder_Nm=rounded(left_over(run, end, "shoulder")),
        left_over_elbow_Nm=rounded(left_over(run, end, "elbow")),
        possible_share=float(run.possible_share),
        verdict=run.outcome,
        stop_s=run.stop_s,
        restless_s=run.restless_s,
        rejected_share=float(run.rejected_share),
        noise_scale=float(run.noise_scale) if np.isfinite(run.noise_scale) else None,
        parameters_covered=parameters.covered,
        parameters_intervals=parameters.of,
        torque_covered=torque.covered,
        torque_intervals=torque.of,
    )


IDENTIFY = TaskKind(
    "identify",
    "One method identifies one wearer, as in `exograv dev benchmark-identification`.",
    IdentifyGrid,
    IdentifyTask,
    IdentifyResult,
    ("wearer_seed",),
    _run,
)
