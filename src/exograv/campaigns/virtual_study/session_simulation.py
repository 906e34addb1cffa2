"""Fast simulation of one session of a virtual person: the twin runs while the person moves, and rests are skipped.

Control step, guard, task, screen and aircraft are those of `exograv run train`. A machine without motors takes no
control step: it gets no torque, so there is nothing to limit.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.laboratory.participant.aircraft_feed import AircraftFeed
from exograv.laboratory.participant.screen_session import LEVEL_S, TASK_S, ScreenSession
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.twin_seat import TwinSeat
from exograv.laboratory.participant.virtual_participant import Activity, PointingPerson
from exograv.loop.arm_controller import ArmController
from exograv.loop.control_step import ControlStep
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import OutputFeedback
from exograv.procedures.identification.identify import SKELETON_TICKS
from exograv.recording import RecordingWriter
from exograv.rig.twin.twin import PERIOD
from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, Guard
from exograv.safety.limits import PersonLimits
from exograv.safety.person import GuardedPerson
from exograv.signals import Command, JointState, Reference
from exograv.task.aircraft_line import AircraftSample
from exograv.task.events import Start
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import aircraft_sink, recording_sink
from exograv.task.records import Record, TouchRecord
from exograv.task.run import TaskRun

from .flight import FlownTouch
from .rows import TickRows
from .session_setup import SessionSetup

TASK_TICKS, LEVEL_TICKS = round(TASK_S / PERIOD), round(LEVEL_S / PERIOD)

ACT_TICKS = 2
"""Ticks between two acts of the person, because muscles are far slower than the loop."""

LEAD_S = {"clock": 3.0, "aircraft": 7.0}
"""Time before a window in which the twin runs [s]. The arm gets ready; a flight has 2 s of 1.8 g and the descent."""

TAIL_S = 2.0
"""Shortest time after a window in which the twin runs [s]: the arm returns and comes to rest."""

PASSED_S, PASSED_IN_FLIGHT_S = 0.5, 0.1
"""Steps in which a rest is skipped, on the ground and in flight [s]; an aircraft sends ten samples per second."""

LANDED_S = 60.0
"""Time after the planned end of a flight at which the session ends [s]. A window that is then incomplete stays
incomplete."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class WindowTimes:
    """Planned opening and closing times of windows on the twin's clock [s]."""

    windows: tuple[tuple[float, float], ...]
    lead_s: float

    def is_awake(self, t: float) -> bool:
        """Return True if the person moves, or is about to move."""
        return any(opens - self.lead_s <= t <= closes + TAIL_S for opens, closes in self.windows)

    def until_awake(self, t: float) -> float:
        """Time until the person moves [s]; infinite after the last window."""
        return min((opens - self.lead_s - t for opens, _ in self.windows if opens - self.lead_s > t), default=math.inf)


class SimulatedSession:
    """Session of one person for one protocol."""

    def __init__(
        self,
        stage: SessionSetup,
        plan: TaskPlan,
        room: SimulatedRoom,
        person: PointingPerson,
        seed: int,
        person_limits: PersonLimits | None = None,
    ):
        """Begin before the first tick.

        Args:
            stage: Setup of the session, with the controller that carries the arm.
            plan: Protocol, machine and screen.
            room: Room of that screen.
            person: Virtual person, who acts every `ACT_TICKS` periods of the twin.
            seed: Seed of the panel's delays and of the flight.
            person_limits: Guard limits of the wearer; with None only the machine's own limits act.
        """
        self.stage, self.person, self.run = stage, person, TaskRun(plan, sinks=(self._note,))
        self.touches = list[FlownTouch]()
        """Accepted touches so far."""
        self._twin, self._seed = stage.twin, seed
        self._seat = TwinSeat(stage.twin, person, room, plan.protocol.target, seed, "simulated")
        period_s, n = self._twin.period_s, len(self._twin.joints)
        envelope = Envelope(limits(stage.laboratory.description), period_s)
        if person_limits is not None:
            envelope.person = GuardedPerson(person_limits, 1.0)
        self._guard = Guard.of_machine(envelope, period_s, stage.actuators.gain.tolist())
        self._step = ControlStep(self._guard, stage.actuators.gain)
        self.stops = 0
        """Number of stops by the guard."""
        self._feedback = OutputFeedback(n, period_s, stage.controller)
        self._feedback.reference = Reference(self._twin.read().q.copy(), *np.zeros((2, n)))
        self._idle = np.zeros(n)
        self._unknown = np.full(n, np.nan)
        self._recording: RecordingWriter | None = None
        self._is_driven = isinstance(stage.controller, ArmController)
        self._rows = TickRows(len(self._twin.joints))
        self._ticks = 0
        self._progress: Callable[[float], None] = lambda _share: None

    @property
    def simulated_s(self) -> float:
        """Time that the twin simulated, without the skipped rests [s]."""
        return self._ticks * self._twin.period_s

    def fly(self, recording: RecordingWriter | None, progress: Callable[[float], None]) -> None:
        """Run to the end of the protocol.

        Args:
            recording: Receives task, aircraft and every 20th tick; None to record nothing.
            progress: Receives the finished share from time to time.

        Raises:
            RigError: The twin diverged.
            RecordingError: The disk is full.
        """
        self._recording, self._progress, self._begun = recording, progress, self._twin.t
        if recording is not None:
            recording.phase(self._begun, "task")
            self.run.sinks = (recording_sink(recording), *self.run.sinks)
        self._begin().fly(self)
        if recording is not None:
            self._rows.write(recording)

    @property
    def t(self) -> float:
        """Time on the twin's clock [s]."""
        return self._twin.t

    @property
    def is_settling(self) -> bool:
        """Always false: an arm that is carried at the end need not be put down."""
        return False

    def advance(self, session: ScreenSession) -> None:
        """Run the twin for one step of the task, or skip a part of a rest."""
        t = self._twin.t
        if self._times.is_awake(t) or self.person.doing is not Activity.LYING:
            self._act(TASK_TICKS)
        else:
            self._pass(self._times.until_awake(t))
        session.tell(self._twin.t)
        self._progress(min((self._twin.t - self._begun) / self._duration_s, 1.0))

    def why_over(self, run: TaskRun) -> str:
        """Reason to end a flight: all windows are complete, or the aircraft has landed."""
        landed = self._twin.t > self._begun + self._duration_s + run.plan.protocol.after_last_s + LANDED_S
        return "the flight is over" if landed or run.is_over(self._twin.t) else ""

    @property
    def _duration_s(self) -> float:
        return max(closes for _, closes in self._times.windows) - self._begun

    def _begin(self) -> ScreenSession:
        feed = None
        if not self.run.plan.is_clocked:
            heard = self._ignore if self._recording is None else aircraft_sink(self._recording)
            feed = AircraftFeed(self.run.plan.protocol, self._twin, self._seed, heard)
        self._times = self._planned(feed)
        return self._seat.session(self.run, *(() if feed is None else (feed,)))

    def _planned(self, feed: AircraftFeed | None) -> WindowTimes:
        twin, plan, begun = self._twin, self.run.plan, self._twin.t
        self.run.feed(Start(t=begun))
        self._set_level(plan.protocol.windows.level_of(plan.protocol.windows.first_number).start)
        if feed is not None:
            flown = tuple((begun + opens, begun + closes) for opens, closes in feed.profile.windows_s)
            return WindowTimes(flown, LEAD_S["aircraft"])
        if self._is_driven:
            # The twin begins in equilibrium, with the torque that carries the arm.
            state = twin.read()
            carrying = self.stage.controller.step(state.q, np.zeros_like(state.q), self._feedback.reference)
            self._guard.envelope.begin(carrying)
        origin, windows = self.run.state.origin, plan.timeline.windows.values()
        return WindowTimes(tuple((origin + w.start_s, origin + w.end_s) for w in windows), LEAD_S["clock"])

    def _act(self, ticks: int) -> None:
        """Run the twin for some ticks, with a person in it who may move."""
        twin = self._twin
        for k in range(ticks):
            state = twin.read()
            tau_desired, command = self._decided(state) if self._is_driven else self._let_go(state)
            if k == 0:
                gained = self.stage.actuators.torque(state.current)
                tau = tau_desired, command.tau
                self._rows.add(state, self._feedback.v, gained, self.stage.controller, tau)
            twin.write(command)
            if k % ACT_TICKS == 0:
                self._seat.touch(twin.t)
                self._seat.act()
            if k % LEVEL_TICKS == 0 and self.run.state.window is not None:
                self._set_level(self.run.made_level(twin.t))
        self._ticks += ticks
        self._draw_skeleton()

    def _decided(self, state: JointState) -> tuple[Joints, Command]:
        """Take a control step. After a stop the machine descends softly, and the operator's reset follows."""
        guard, was_stopped = self._guard, self._guard.envelope.stop is not None
        decision = self._step.take(state, self._twin.t, self._feedback)
        if guard.envelope.stop is not None:
            self.stops += not was_stopped
            guard.reset()
        submitted = decision.submitted
        return self._unknown if submitted is None else submitted.tau, decision.command

    def _let_go(self, state: JointState) -> tuple[Joints, Command]:
        """Command zero torque, because the motors are off or absent."""
        t, none = self._twin.t, self._idle
        return self._feedback.step(state.q), Command(t, state.sequence, t + COMMAND_LIFE_S, none, none)

    def _pass(self, until_s: float) -> None:
        """Skip a part of a rest: clock, task and aircraft advance without the twin's dynamics."""
        step = PASSED_S if self.run.plan.is_clocked else PASSED_IN_FLIGHT_S
        step = min(step, until_s)
        state = self._twin.read()
        gained = self.stage.actuators.torque(state.current)
        self._rows.add(state, np.zeros_like(state.q), gained, self.stage.controller, None)
        self._twin.pass_time(max(step, self._twin.period_s))

    def _note(self, _t: float, records: tuple[Record, ...]) -> None:
        for record in records:
            if isinstance(record, TouchRecord) and record.is_accepted and record.window is not None:
                number = 1 + sum(one.window == record.window for one in self.touches)
                self.touches.append(FlownTouch.of(record, number))

    def _ignore(self, _t: float, _sample: AircraftSample) -> None:
        """Ignore a sample of the aircraft if nothing is recorded."""

    def _set_level(self, level: float) -> None:
        """Set the gravity level at once. It stays between windows: a ramp over the skipped rest would take too long."""
        controller = self.stage.controller
        if isinstance(controller, ArmController) and self.run.plan.exo == "active":
            controller.mode.gravity_level = level
            if (person := self._guard.envelope.person) is not None:
                person.gravity_level = level

    def _draw_skeleton(self) -> None:
        controller, is_drawn = self.stage.controller, self._ticks % (SKELETON_TICKS // TASK_TICKS * TASK_TICKS) == 0
        if self._recording is None or not is_drawn or not isinstance(controller, ArmController):
            return
        if self.run.state.window is not None:
            exo, arm = controller.skeleton(self._feedback.q)
            self._recording.write("/skeleton", self._twin.t, {"exo": exo, "arm": arm})
