"""How soon and how well a method knows an arm: the identification benchmark's run of one method on one wearer."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
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
from exograv.study.folder.columns import Column

from .task import SweepTask, TaskKind, Values
from .wearers import Several, WearerGrid, refuse_other_rig

CASE_COLUMNS = (
    Column("profile", "string", "-", "kind of drive"),
    Column("level", "int64", "-", "of the disturbances"),
    Column("wearer_seed", "int64", "-", "draws the wearer"),
    Column("machine_seed", "int64", "-", "draws the machine"),
    Column("turn", "int64", "-", "wearers whom the machine had since it was calibrated"),
    Column("arm", "string", "-", "`drawn`, or whose"),
    Column("only", "string", "-", "the one disturbance at the level", is_nullable=True),
    Column("without", "string", "-", "a disturbance switched off", is_nullable=True),
    Column("restless", "bool", "-", "the wearer never lets go"),
    Column("rig", "string", "-", "machine"),
    Column("rig_sha256", "string", "-", "of its rig.toml and URDF"),
)
"""Fields of `CaseTask`."""


@dataclass(frozen=True)
class CaseTask:
    """A wearer in a machine, flat."""

    profile: Any
    level: int
    wearer_seed: int
    machine_seed: int
    turn: int
    arm: Any
    only: str | None
    without: str | None
    restless: bool
    rig: str
    rig_sha256: str

    @property
    def case(self) -> Case:
        """As the benchmark has it."""
        fields = {column.name: getattr(self, column.name) for column in CASE_COLUMNS}
        del fields["rig_sha256"]
        return Case(**fields)


@dataclass(frozen=True)
class IdentifyTask(CaseTask):
    """One method on one wearer."""

    method: MethodName
    setting: Setting
    motion_s: float


class IdentifyGrid(WearerGrid):
    """Methods on wearers."""

    methods: Annotated[list[MethodName], Several] = Field(default=["recursive"])
    settings: Annotated[list[Setting], Several] = Field(default=["open_loop"])
    """A recorded stream that every method meets alike, or the method drives the arm."""

    motion_s: Annotated[list[Annotated[float, Field(ge=5.0, le=600.0)]], Several] = Field(default=[60.0])
    """Seconds of motion; each is a motion of its own."""

    def __len__(self) -> int:
        return self.cases_count * len(self.methods) * len(self.settings) * len(self.motion_s)

    def groups(self) -> Iterator[Sequence[IdentifyTask]]:
        """One machine, calibrated once, with its wearers and all methods."""
        for sha256, cases in self.cases():
            for motion_s in self.motion_s:
                yield [
                    IdentifyTask(**asdict(case), rig_sha256=sha256, method=method, setting=setting, motion_s=motion_s)
                    for case in cases
                    for setting in self.settings
                    for method in self.methods
                ]


def _run(tasks: Sequence[SweepTask], /) -> Iterator[tuple[SweepTask, Values | str]]:
    by_key = {(task.settings.setting, task.settings.method, task.settings.case): task for task in tasks}
    cases = {case: None for _, _, case in by_key}
    refuse_other_rig(next(iter(cases)), tasks[0].settings.rig_sha256)
    wearers = [
        WearerTask(case, _methods(by_key, "open_loop", case), _methods(by_key, "closed_loop", case)) for case in cases
    ]
    for run in run_machine(wearers, lambda _text: None, tasks[0].settings.motion_s):
        yield by_key[run.key], run.failed if run.failed is not None else _values(run)


def _methods(by_key: dict[Any, SweepTask], setting: Setting, case: Case) -> tuple[MethodName, ...]:
    return tuple(method for where, method, who in by_key if (where, who) == (setting, case))


def _values(run: MethodRun) -> Values:
    end = run.t[-1]
    held = {
        "parameters": coverage([run], f"{DURATIONS_S[-1]:g}"),
        "torque": torque_coverage([run], f"{DURATIONS_S[-1]:g}"),
    }
    values: dict[str, Any] = {
        "time_to_target_s": rounded(time_to(run)),
        "time_to_coarse_s": rounded(time_to(run, COARSE)),
        "left_over_shoulder_Nm": rounded(left_over(run, end, "shoulder")),
        "left_over_elbow_Nm": rounded(left_over(run, end, "elbow")),
        "possible_share": float(run.possible_share),
        "verdict": run.outcome,
        "stop_s": run.stop_s,
        "restless_s": run.restless_s,
        "rejected_share": float(run.rejected_share),
        "noise_scale": float(run.noise_scale) if np.isfinite(run.noise_scale) else None,
    }
    for name, count in held.items():
        values |= {f"{name}_covered": count["covered"], f"{name}_intervals": count["of"]}
    return values


IDENTIFY = TaskKind(
    "identify",
    "One method identifies one wearer, as in `exograv benchmark-identification`.",
    IdentifyGrid,
    (
        *CASE_COLUMNS,
        Column("method", "string", "-", "identification method"),
        Column("setting", "string", "-", "`open_loop` or `closed_loop`"),
        Column("motion_s", "float64", "s", "of motion"),
    ),
    (
        Column("time_to_target_s", "float64", "s", "until within the target to the end; NA if never", is_nullable=True),
        Column("time_to_coarse_s", "float64", "s", "the same of 2.5 times the target", is_nullable=True),
        Column("left_over_shoulder_Nm", "float64", "N·m", "worst axis, RMS over held-out postures", is_nullable=True),
        Column("left_over_elbow_Nm", "float64", "N·m", "the same at the elbow", is_nullable=True),
        Column("possible_share", "float64", "-", "of the estimates, physically possible", is_nullable=True),
        Column("verdict", "string", "-", "of the stop rule", is_nullable=True),
        Column("stop_s", "float64", "s", "when it would have ended the motion", is_nullable=True),
        Column("restless_s", "float64", "s", "when the wearer was seen not to relax", is_nullable=True),
        Column("rejected_share", "float64", "-", "of the samples", is_nullable=True),
        Column("noise_scale", "float64", "-", "noise against the calibration's", is_nullable=True),
        Column("parameters_covered", "int64", "-", "95 % intervals that hold the truth, after at most 120 s", True),
        Column("parameters_intervals", "int64", "-", "of so many", is_nullable=True),
        Column("torque_covered", "int64", "-", "the same of torque at held-out postures", is_nullable=True),
        Column("torque_intervals", "int64", "-", "of so many", is_nullable=True),
    ),
    ("wearer_seed",),
    _run,
)
