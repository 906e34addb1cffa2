"""The windows of a run in lock-step: what the participant does becomes touches, what the run says becomes levels."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from exograv import motion
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot, TickSample
from exograv.procedures.identification.identify import SKELETON_TICKS, record_skeleton
from exograv.rig.twin import Twin
from exograv.task.events import Distance, Event, Pause, Resume, Stop, Tick
from exograv.task.picture import participant_picture
from exograv.task.records import Record, marker
from exograv.task.run import TaskRun

from .interface import Participant
from .touch_panel import Panel
from .touch_screen import SimulatedRoom

TASK_TICKS = 20
"""Ticks between two at which the run is told the time and the participant looks at the page."""

LEVEL_TICKS = 10
"""Between two at which the level follows; a hundredth of a second of a ramp moves no arm by what can be felt."""

CHUNK_S = 1.0
KEPT_EVERY_S = 10.0
"""At least, whatever happens."""

Told = Callable[[float, Record], None]


def silence(_t: float) -> Iterable[Event]:
    """On the ground nothing comes."""
    return ()


@dataclass
class TaskCourse:
    """Flies a run from where it is to its end."""

    run: TaskRun
    pilot: Pilot
    twin: Twin
    controller: Controller
    participant: Participant
    room: SimulatedRoom
    told: Told
    """Hears every record."""

    keep: Callable[[float], None]
    """Keeps the run as it is now [s]."""

    seed: int
    page: str = "simulated"
    feed_from: Callable[[float], Iterable[Event]] = silence
    """What has come from outside until then [s]."""

    verify: Callable[[], None] | None = None
    verify_every: int = 0
    """Windows."""

    def __post_init__(self):
        """The participant's page is open; nothing has been touched."""
        self._panel = Panel(self.room, self.run.plan.protocol.target, self.seed, self.page)
        self._ticks = 0
        self._q_rest, self._kept_at = self.pilot.q.copy(), -np.inf
        self._verified_after = len(self.run.state.complete)

    def fly(self) -> None:
        """Until the run has ended.

        Raises:
            RigError: The envelope stopped the machine.
            KeyboardInterrupt: Ctrl-C.
        """
        run, pilot, tell = self.run, self.pilot, self.pilot.progress
        pilot.progress = lambda text, _share: tell(text, self._share())
        still = motion.hold(pilot.q, CHUNK_S, self.twin.period_s)
        while run.state.status in ("running", "paused") or self._level_is_changing():
            pilot.run(self.controller, still, self._where(), self._listen)
            if self.verify is not None and self.verify_every and self._is_time_to_verify():
                self._pause_and_verify(self.verify)
            if self._is_over():
                self.feed(Stop(t=self.twin.t, why="all windows are complete"))

    def feed(self, event: Event) -> None:
        """Tell the run something and pass on what it says."""
        records = self.run.feed(event)
        for record in records:
            self.told(record.t, record)
        t = self.twin.t
        if records or t - self._kept_at > KEPT_EVERY_S:
            self._kept_at = t
            self.keep(t)

    def _is_time_to_verify(self) -> bool:
        """In the rest after every so many windows, once, and as soon as the arm lies."""
        state = self.run.state
        complete = len(state.complete)
        is_due = complete > self._verified_after and complete % self.verify_every == 0
        is_last = complete == self.run.plan.protocol.windows.count
        is_rest = state.status == "running" and state.window is None and not self._level_is_changing()
        return is_due and is_rest and not is_last and not self.twin.tau_voluntary.any()

    def _pause_and_verify(self, verify: Callable[[], None]) -> None:
        self._verified_after = len(self.run.state.complete)
        self.feed(Pause(t=self.twin.t, why="verification"))
        verify()
        self.pilot.begin("task")
        self.feed(Resume(t=self.twin.t))

    def _is_over(self) -> bool:
        """Whether a run that no clock ends has nothing to come."""
        run = self.run
        if run.plan.is_clocked or not run.state.complete >= set(run.plan.protocol.windows.numbers):
            return False
        closed = run.state.windows[-1].closed
        return closed is not None and self.twin.t >= closed + run.plan.protocol.after_last_s

    def _level_is_changing(self) -> bool:
        """An arm that is still carried at the end must not be dropped."""
        return isinstance(self.controller, ArmController) and self.controller.mode.gravity_level < 1.0

    def _share(self) -> float:
        """Of the run that is done [-]."""
        run = self.run
        if run.plan.is_clocked:
            return min(max((self.twin.t - run.state.origin) / run.plan.timeline.duration_s, 0.0), 1.0)
        return len(run.state.complete) / run.plan.protocol.windows.count

    def _where(self) -> str:
        run = self.run
        complete, count = len(run.state.complete), run.plan.protocol.windows.count
        return f"Window {complete + 1 if complete < count else count} of {count}"

    def _listen(self, moment: TickSample) -> None:
        twin, t = self.twin, moment.state.t
        self._ticks += 1
        self._feel_screen(t)
        if self._ticks % TASK_TICKS == 0:
            self._tell(t, moment)
        if self._ticks % LEVEL_TICKS == 0:
            self._follow_level(t)
        truth = twin.truth
        twin.tau_voluntary[:] = self.participant.act(twin.t, truth.q_arm, truth.v_arm)
        is_drawn = self._ticks % SKELETON_TICKS == 0 and self.run.state.window is not None
        if is_drawn and isinstance(self.controller, ArmController):
            record_skeleton(self.pilot, self.controller, moment)

    def _feel_screen(self, t: float) -> None:
        off = self._panel.feel(t, self.twin.finger_on_screen())
        if off is not None:
            self.participant.touched(t, off)

    def _tell(self, t: float, moment: TickSample) -> None:
        for touch in self._panel.reported(t):
            self.feed(touch)
        for event in self.feed_from(t):
            self.feed(event)
        if self.run.plan.protocol.pointing.return_check in ("joints", "fingertip"):
            self._tell_distance(t, moment)
        self.feed(Tick(t=t))
        self.participant.see(t, participant_picture(self.run.plan, self.run.state, t))

    def _tell_distance(self, t: float, moment: TickSample) -> None:
        joints = float(np.abs(moment.state.q - self._q_rest).max())
        fingertip = None
        if isinstance(self.controller, ArmController):
            tip, rest = (np.array(self.controller.skeleton(q)[1][-1]) for q in (moment.q, self._q_rest))
            fingertip = float(np.linalg.norm(tip - rest))
        self.feed(Distance(t=t, fingertip_m=fingertip, joints_rad=min(joints, 10.0)))

    def _follow_level(self, t: float) -> None:
        """Control and guard go along the same ramp."""
        controller, person = self.controller, self.pilot.envelope.person
        if not isinstance(controller, ArmController):
            return
        level = self.run.made_level(t)
        controller.mode.gravity_level = level
        if person is not None:
            person.gravity_level = level


def task_message(record: Record) -> dict[str, object]:
    """As it goes into the recording."""
    return {"kind": record.kind, "record": json.loads(marker(record))}
