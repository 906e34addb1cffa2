"""State of one set of processes, as their parent's thread reports it, in the form of the pages."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from exograv.dynamics.parameters import names_and_units
from exograv.identification.core.interface import Outcome
from exograv.live.arm_worker import EstimateReport
from exograv.live.live_control import LivePlan
from exograv.live.live_processes import Running
from exograv.model.scene import SceneDescription, describe_scene
from exograv.model.wearer_form import WearerForm
from exograv.runtime.lsl.listening import Listening, StreamState
from exograv.runtime.lsl.quality import StreamCondition
from exograv.runtime.recorder.recorder import RecorderReport as RecorderReport

from .learning_help import learning_help
from .memory_view import FlightMemoryView
from .participant_keeping import EstimateKeeper
from .participants import RequestedParticipant
from .sentences import say
from .view_models import LearnedParameter, Learning, Point, RecordingStatus, StreamView, WorkProgress
from .work_progress import identification_progress

if TYPE_CHECKING:
    from .flight_rests import FlightRests
    from .steered_machine import SteeredMachine

INTERVAL = 1.96
"""Number of standard deviations in half of a 95 % interval."""

SHOWN_UNITS = ("kg", "kg·m")
"""Units of the parameters on the page: those that determine weight."""


@dataclass
class ProcessState:
    """State of one set of processes, as last reported by their parent's thread."""

    who: RequestedParticipant
    place: "SteeredMachine"
    doing: str = say("flight.calibrates")
    plan: LivePlan | None = None
    running: Running | None = None
    watching: FlightMemoryView | None = None
    path: Path | None = None
    recording: RecorderReport | None = None
    listening: Listening | None = None
    begun_s: float = 0.0
    level_asked: float = 0.0
    failure: str = ""
    is_waiting: bool = False
    """True while the machine waits for an operator who makes it ready; its motors are off."""
    asked_s: float | None = None
    """Time of this request, until it is carried out [s]."""
    has_begun: bool = False
    """True if a machine that waited has left mode off."""
    is_switched_off: bool = False
    """True if an operator has switched a machine on drives off, which ends the run."""
    warnings: tuple[str, ...] = ()
    keeping: EstimateKeeper = field(init=False)
    rests: "FlightRests | None" = None
    """Learning in the rests; None before the processes start."""
    _scene: tuple[WearerForm, SceneDescription] | None = None

    def __post_init__(self):
        self.keeping = EstimateKeeper(self.who)

    @property
    def scene(self) -> SceneDescription:
        """Picture of the machine with the person of the plan in it; before there is a plan, with the next person."""
        who = self.place.form if self.plan is None else self.plan.told
        if self._scene is None or self._scene[0] is not who:
            self._scene = who, describe_scene(self.place.description, who.body, who.lengths)
        return self._scene[1]

    @property
    def is_known(self) -> bool:
        """True if the arm may be taken without an identification."""
        if self.keeping.is_contradicted:
            return False
        return self.who.participant is not None or self.is_learned

    @property
    def is_learned(self) -> bool:
        """True if no further identification is needed."""
        worker = None if self.running is None else self.running.worker
        return worker is not None and worker.learned is not None

    def recorded(self) -> RecordingStatus | None:
        """Status of the recording."""
        report = self.recording
        if report is None or self.path is None:
            return None
        return RecordingStatus(
            path=str(self.path), samples=report.acknowledged, lost=report.lost, is_ok=report.recording_ok,
            why=report.why
        )  # fmt: skip

    def streams(self) -> tuple[StreamView, ...]:
        """Streams of other devices that the session records, with their quality."""
        return () if self.listening is None else tuple(_stream_view(state) for state in self.listening.states())

    def lost_streams(self) -> tuple[str, ...]:
        """Sentences about the streams that send nothing."""
        return tuple(
            say(f"flight.stream_{stream.condition}", stream=stream.name)
            for stream in self.streams()
            if stream.condition in (StreamCondition.LOST.value, StreamCondition.SILENT.value)
        )

    def work(self, shown: Mapping[str, Any], is_moving: bool) -> WorkProgress | None:
        """Work in progress; `shown` has the values of the newest tick."""
        if (calibrating := self.place.calibrating) is not None:
            return calibrating.work
        if self.rests is not None and (work := self.rests.work(shown["v_rad_s"])) is not None:
            return work
        joints = self.place.description.joints
        return identification_progress(self.learning(), is_moving, self.who.identify_s, joints, shown["v_rad_s"])

    def learning(self) -> Learning | None:
        """Progress of an identification."""
        worker = None if self.running is None else self.running.worker
        if worker is None or worker.judged is None or self.plan is None:
            return None
        judged, learned = worker.judged, worker.learned
        description, left_over = self.place.description, judged.left_over.tolist()
        farthest, advice = learning_help(description.joints, description.places, left_over, learned is not None)
        return Learning(
            share_done=1.0 if learned is not None else min(judged.motion_s / self.who.identify_s, 1.0),
            parameters=_parameters(judged, self.plan),
            left_over_Nm=tuple(left_over),
            left_over_prior_Nm=tuple(judged.left_over_prior.tolist()),
            outcome=(Outcome.RUNNING if learned is None else learned.outcome).sentence,
            is_over=learned is not None,
            farthest=farthest,
            help=advice,
        )


def _stream_view(state: StreamState) -> StreamView:
    quality = state.quality
    return StreamView(
        name=state.name,
        type=state.type,
        condition=state.condition.value,
        nominal_rate_Hz=state.nominal_rate_Hz,
        rate_Hz=None if quality is None else quality.rate_Hz,
        gaps=0 if quality is None else quality.gaps,
        offset_s=None if quality is None else quality.offset_s,
        uncertainty_s=None if quality is None else quality.uncertainty_s,
    )


PER_JOINT = {
    "q_rad": "q_measured",
    "v_rad_s": "v",
    "tau_desired_Nm": "tau_desired",
    "tau_commanded_Nm": "tau_commanded",
}
"""Fields of a tick, by their names on the pages."""


def told(row: np.void | None, joints: int) -> dict[str, Any]:
    """Values of the newest tick by field of a snapshot. Unknown values are 0."""
    if row is None:
        return dict.fromkeys(PER_JOINT, (0.0,) * joints) | {"gravity_level": 0.0, "arm_share": 0.0}
    shown = {name: tuple(np.nan_to_num(row[field]).tolist()) for name, field in PER_JOINT.items()}
    return shown | {name: float(np.nan_to_num(row[name])) for name in ("gravity_level", "arm_share")}


def _parameters(judged: EstimateReport, plan: LivePlan) -> tuple[LearnedParameter, ...]:
    rows = zip(names_and_units(plan.prepared.assembly), judged.x, judged.sd, judged.prior, judged.prior_sd, strict=True)
    return tuple(
        LearnedParameter(
            name=name, unit=unit, mean=float(x), half_width=INTERVAL * float(sd), prior=float(before),
            prior_half_width=INTERVAL * float(before_sd)
        )
        for (name, unit), x, sd, before, before_sd in rows
        if unit in SHOWN_UNITS
    )  # fmt: skip


def points(rows: list[list[float]]) -> tuple[Point, ...]:
    """Points of a skeleton."""
    return tuple((x, y, z) for x, y, z in rows)
