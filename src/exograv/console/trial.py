"""Run of a protocol in the console: input are touches and the operator's commands, output are pictures and levels."""

import math
from dataclasses import replace

from exograv.errors import ConfigError
from exograv.experiment.steered.view_models import SessionSnapshot
from exograv.options import Side
from exograv.safety.guard import CONSENT_S
from exograv.storage.rests_so_far import NO_RESTS, RestsSoFar
from exograv.storage.session_checkpoint import AFRESH
from exograv.task.events import (
    AcknowledgeAlarm,
    CloseWindow,
    Event,
    OpenWindow,
    Pause,
    Resume,
    Start,
    Stop,
    Tick,
    Touch,
)
from exograv.task.levels import EARTH
from exograv.task.picture import OperatorPicture, ParticipantPicture, operator_picture, participant_picture
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import TASK_TOPIC, checkpoint_sink
from exograv.task.records import Record, RefusedEvent, TouchRecord, extended
from exograv.task.run import TaskRun
from exograv.task.run_statement import RunStatement
from exograv.task.screen import calibrate_with_card, calibrate_with_ruler

from .event_log import EventLog
from .messages import Calibrate, PageTouch, RunCommand
from .page_clocks import PageClocks
from .run_checkpoint import RunCheckpoint, RunContext
from .sentences import say

CARRIED = frozenset({"floating", "weighing"})
"""Modes in which a protocol with an active machine can run."""

WAITS_AFTER_S, SILENT_MAX_S = 0.25, 1.0
"""Age of the machine's newest tick above which a run waits, and above which it is paused [s]."""

REST_NEEDED_S = 60.0
"""Shortest time to the next window in which the machine begins to learn in a rest [s].

The motion takes some 20 s, the computation 5 s, the ramps of the weight at both ends 10 s, and the weight of the window
is taken 7 s before it opens. The rest is for a busy computer.
"""

ASKS_BEFORE_S = 30.0
"""Time before a pull-up from which on the participant's page asks for consent [s]."""

RAW = "/console/touch"
"""Topic of raw touches in the diary."""


class ProtocolTrial:
    """Run of a protocol. It never moves the machine: it only requests a gravity level."""

    def __init__(
        self,
        plan: TaskPlan,
        clocks: PageClocks,
        diary: EventLog,
        kept: RunCheckpoint | None = None,
        may_be_over: bool = False,
        statement: RunStatement | None = None,
    ):
        """Prepare a new run, or the rest of a run from a checkpoint.

        Args:
            plan: Plan of the run.
            clocks: Clocks of the pages.
            diary: Log of all events.
            kept: Checkpoint of the run; None to keep none.
            may_be_over: True to accept a checkpoint of a run that is over, and to show its result.
            statement: Statement about the run, for recording, diary and checkpoint.

        Raises:
            ConfigError: The checkpoint belongs to another protocol, or its run is over.
        """
        self.clocks, self._diary, self._kept, self._statement = clocks, diary, kept, statement
        self.run = TaskRun(plan)
        if kept is not None and kept.before is not None:
            self.run = TaskRun.from_kept(replace(plan, screen=kept.circumstances.screen), kept.before.run)
            if self.run.state.status in ("stopped", "finished") and not may_be_over:
                raise ConfigError(f"The run in {kept.path} is over; there is nothing to resume. {AFRESH}")
        self._agreed_until = -math.inf
        self.side: Side | None = None if kept is None else kept.circumstances.side
        """Side of the arm with which the run began. A protocol has no side; a session has one."""

        self._rests = NO_RESTS if kept is None else kept.circumstances.rests
        """Rests that have taught so far, as the machine has last shown them."""

        self.news = list[Record]()
        """Records that the pages have not received yet; the broadcaster empties this list."""
        self.run.sinks = (
            self._write,
            lambda _t, records: self.news.extend(records),
            *(() if kept is None else (checkpoint_sink(self._keep),)),
        )

    @property
    def plan(self) -> TaskPlan:
        """Plan of the run."""
        return self.run.plan

    @property
    def is_active(self) -> bool:
        """True if the machine carries the arm in this run. In a sham run it does, at the level of Earth."""
        return self.plan.exo != "passive"

    @property
    def why_not_kept(self) -> str:
        """Error of the last checkpoint; empty without an error."""
        return say("trial.not_kept", why=self._kept.why) if self._kept is not None and self._kept.why else ""

    @property
    def is_running(self) -> bool:
        """True while the run is not paused and not over."""
        return self.run.state.status == "running"

    def _write(self, _t: float, records: tuple[Record, ...]) -> None:
        for record in records:
            self._diary.write(TASK_TOPIC, record.t, record.model_dump(mode="json"))

    def _keep(self, t: float) -> None:
        """Store a checkpoint of a run that has begun."""
        if self._kept is not None and self.run.state.status != "ready":
            name = None if self._statement is None else self._statement.run
            said = RunContext(side=self.side, screen=self.plan.screen, run=name, rests=self._rests)
            self._kept.keep(self.run.kept(), t, said)

    def tick(self, t: float, shown: SessionSnapshot) -> str:
        """Advance the run to time `t` [s]; return a sentence for an alarm if the run had to be paused.

        While the machine is silent the run waits: it may have stopped, and the clock would end a window as complete.
        """
        if shown.rests is not None and shown.rests.rests:
            self._rests = RestsSoFar(shown.rests.rests, shown.rests.left_out, shown.rests.motion_s)
        silent_s = shown.age_s if self.is_active and self.is_running and shown.mode in CARRIED else 0.0
        if silent_s > SILENT_MAX_S:
            why = f"The machine has sent no values for {SILENT_MAX_S:g} s."
            self.run.feed(Pause(t=max(t - silent_s, self.run.state.t), why=why))
            return say("trial.paused")
        if silent_s > WAITS_AFTER_S:
            return ""
        self.run.feed(Tick(t=t))
        if self._needs_consent(t):
            why = say("trial.not_agreed")
            self.run.feed(Pause(t=t, why=why))
            return why
        is_in_rest = is_learning(shown) and self.run.state.window is None
        if self.run.state.status != "running" or not self.is_active or shown.mode in CARRIED or is_in_rest:
            return ""
        self.run.feed(Pause(t=t, why=f"The machine: {shown.mode_text}"[:500]))
        return say("trial.paused")

    def why_no_rest(self, t: float) -> str:
        """Return the reason why the machine may not learn in a rest now; empty if the run allows it.

        While the run is paused, or has not begun, no window opens by itself.
        """
        if self.plan.protocol.opening == "aircraft":
            return say("console.in_flight")
        if self.run.state.window is not None:
            return say("trial.window_open")
        if not self.is_running:
            return ""
        countdown_s = self.operator(t).countdown_s
        if countdown_s is not None and countdown_s < REST_NEEDED_S:
            return say("trial.window_soon", seconds=f"{REST_NEEDED_S:.0f}", left=f"{countdown_s:.0f}")
        return ""

    def agreed(self, t: float) -> None:
        """Take note that the participant has agreed to a push, for as long as the guard accepts it."""
        self._agreed_until = t + CONSENT_S

    def _needs_consent(self, t: float) -> bool:
        """Return True if the level rises above Earth now, and the participant has not agreed."""
        level = self.level(t)
        return self.is_running and level is not None and level > EARTH and t > self._agreed_until

    def _asks_consent(self, t: float) -> bool:
        """Return True if the participant has to agree: to a push that comes within `ASKS_BEFORE_S`, or in a pause."""
        state, pushes = self.run.state, self.plan.timeline.pushes_s
        if self.plan.exo != "active" or not pushes or state.window is not None:
            return False
        if not self.is_running:
            return state.status == "paused" and self._agreed_until <= t
        ends = (end + state.origin for begin, end in pushes if t < begin + state.origin <= t + ASKS_BEFORE_S)
        return any(self._agreed_until < end for end in ends)

    def level(self, t: float) -> float | None:
        """Return the gravity level to request from the machine [-]; None if the run does not set it."""
        says = self.is_active and self.run.state.status in ("running", "paused")
        return self.run.made_level(t) if says else None

    def word(self, word: RunCommand, t: float, shown: SessionSnapshot) -> str:
        """Carry out a command of the operator; return a sentence if it is refused."""
        if word.word in ("start", "resume", "open") and is_learning(shown):
            return say("rest.runs")
        needs_arm = word.word in ("start", "resume") and self.is_active
        if needs_arm and shown.mode not in CARRIED:
            return say("trial.needs_arm")
        if word.word == "resume" and self.side not in (None, shown.side):
            return say("trial.other_side", begun=self.side, side=shown.side)
        session = None if self._statement is None else self._statement.session
        events: dict[str, Event] = {
            "start": Start(t=t, participant=shown.participant, session=session),
            "pause": Pause(t=t, why="operator"),
            "resume": Resume(t=t, window=word.window),
            "open": OpenWindow(t=t, by="hand"),
            "close": CloseWindow(t=t, by="hand"),
            "end": Stop(t=t, why="operator"),
        }
        if word.word == "start" and self.run.state.status == "ready":
            self.side = shown.side
            told = {"rig": shown.rig, "side": self.side, "participant": shown.participant}
            self._diary.write("/console/run", t, told)
        return _why_refused(self.run.feed(events[word.word]))

    def acknowledge(self, alarm: int, t: float) -> str:
        """Acknowledge an alarm of the run; return a sentence if there is none."""
        return _why_refused(self.run.feed(AcknowledgeAlarm(t=t, alarm=alarm)))

    def interrupt(self, t: float, why: str) -> None:
        """Pause the run if it is running."""
        if self.is_running:
            self.run.feed(Pause(t=t, why=why))

    def touch(self, raw: PageTouch, received: float) -> TouchRecord | None:
        """Record a touch raw, each time that the page sends it, and judge it."""
        placed = self.clocks.place(raw.page, raw.at)
        when = {"received": received, "placed": None, "bound_s": None}
        if placed is not None:
            when |= {"placed": placed.t, "bound_s": placed.bound_s}
        self._diary.write(RAW, received, {**raw.model_dump(mode="json"), **when})
        touch = extended(
            raw,
            Touch,
            t=received if placed is None else placed.t,
            received=received,
            contact_px=max(raw.width_px, raw.height_px),
        )
        judged = [record for record in self.run.feed(touch) if isinstance(record, TouchRecord)]
        return judged[-1] if judged else None

    def calibrate(self, measured: Calibrate, t: float) -> None:
        """Set the size of the panel's pixels.

        Raises:
            ConfigError: The measurement cannot be used, or the run has begun.
        """
        if self.run.state.status != "ready":
            raise ConfigError("The screen can be calibrated only before a run begins.")
        if measured.card_px is not None:
            screen = calibrate_with_card(*measured.card_px)
        else:
            screen = calibrate_with_ruler(measured.spans)
        self._diary.write("/console/screen", t, {**measured.model_dump(mode="json"), **screen.model_dump(mode="json")})
        self.run = TaskRun(replace(self.plan, screen=screen), self.run.state, self.run.sinks)

    def participant(self, t: float) -> ParticipantPicture:
        """Return the content of the participant's page."""
        picture = participant_picture(self.plan, self.run.state, t)
        return picture.model_copy(update={"asks_consent": self._asks_consent(t)})

    def operator(self, t: float) -> OperatorPicture:
        """Return the content of the operator's page."""
        return operator_picture(self.plan, self.run.state, t)


def is_learning(shown: SessionSnapshot) -> bool:
    """Return True while the machine learns in a rest."""
    return shown.rests is not None and shown.rests.is_active


def _why_refused(records: tuple[Record, ...]) -> str:
    refused = [record.why for record in records if isinstance(record, RefusedEvent)]
    return "" if not refused else say("trial.refused", why=refused[-1])
