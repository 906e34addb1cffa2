"""One session of one virtual person, quickly: the twin runs while somebody moves, and rests are passed over.

Control, envelope, task, screen and aircraft are those of `exograv train`. The guard around the envelope is not there:
nobody can be hurt, and a test holds that it would change no torque of such a session.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.control.observer import Observer
from exograv.errors import RigError
from exograv.laboratory.participant.aircraft_feed import AircraftFeed
from exograv.laboratory.participant.task_course import TASK_TICKS, silence, task_message
from exograv.laboratory.participant.touch_panel import Panel
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import Doing, PointingPerson
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.recording import RecordingWriter
from exograv.safety.envelope import Envelope
from exograv.signals import Command, Reference
from exograv.task.aircraft_line import AircraftSample
from exograv.task.events import Event, Start, Stop, Tick
from exograv.task.picture import participant_picture
from exograv.task.plan import TaskPlan
from exograv.task.records import TouchJudged
from exograv.task.run import TaskRun

from .flight import FlownTouch
from .rows import TickRows
from .stage import Stage

ACT_TICKS = 2
"""Ticks between two acts of the person: muscles are slower by far."""

LEVEL_TICKS = 10
SKELETON_TICKS = 50
LEAD_S = {"clock": 3.0, "aircraft": 7.0}
"""Before a window from when on the twin runs: an arm gets ready; in flight two seconds of 1.8 g and the way down."""

TAIL_S = 2.0
"""After a window, at least: the arm comes back and lies down."""

PASSED_S, PASSED_IN_FLIGHT_S = 0.5, 0.1
"""Steps in which a rest is passed over; an aircraft sends ten samples a second."""

LANDED_S = 60.0
"""After the end of a flight as it was planned: a window that never became whole does not come any more."""

COMMAND_LIFE_S = 0.005

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class Times:
    """When windows open and close on the twin's clock, as planned [s]."""

    windows: tuple[tuple[float, float], ...]
    lead_s: float

    def is_awake(self, t: float) -> bool:
        """Whether somebody moves, or is about to."""
        return any(opens - self.lead_s <= t <= closes + TAIL_S for opens, closes in self.windows)

    def until_awake(self, t: float) -> float:
        """[s]; infinite after the last."""
        return min((opens - self.lead_s - t for opens, _ in self.windows if opens - self.lead_s > t), default=math.inf)


class Sitting:
    """A person on a stage, for one protocol."""

    def __init__(self, stage: Stage, plan: TaskPlan, room: SimulatedRoom, person: PointingPerson, seed: int):
        """Nothing has begun.

        Args:
            stage: Where it is, and what carries the arm.
            plan: Protocol, machine and screen.
            room: Of that screen.
            person: Acts every `ACT_TICKS` periods of the twin.
            seed: Draws the panel's delays and the flight.
        """
        self.stage, self.person, self.run = stage, person, TaskRun(plan)
        self.touches = list[FlownTouch]()
        """Those that count, so far."""
        self._twin, self._seed = stage.twin, seed
        self._panel = Panel(room, plan.protocol.target, seed, "simulated")
        self._envelope = Envelope(limits(stage.laboratory.description), self._twin.period_s)
        self.stops = 0
        """How often the envelope brought the machine down: somebody was too fast for it."""
        self._observer = Observer(len(self._twin.joints), self._twin.period_s)
        self._reference = Reference(self._twin.read().q.copy(), *np.zeros((2, len(self._twin.joints))))
        self._recording: RecordingWriter | None = None
        self._is_driven = isinstance(stage.controller, ArmController)
        self._rows = TickRows(len(self._twin.joints))
        self._ticks = 0
        self._feed_from: Callable[[float], Iterable[Event]] = silence

    @property
    def simulated_s(self) -> float:
        """In which the twin ran, rests left out."""
        return self._ticks * self._twin.period_s

    def fly(self, recording: RecordingWriter | None, progress: Callable[[float], None]) -> None:
        """To the end of the protocol.

        Args:
            recording: Gets task, aircraft and every 20th tick; nothing is kept without.
            progress: Told the share that is done, now and then.

        Raises:
            RigError: The twin diverged.
            RecordingError: The disk is full.
        """
        twin, run, self._recording = self._twin, self.run, recording
        plan = run.plan
        if recording is not None:
            recording.phase(twin.t, "task")
        begun, times = twin.t, self._begin()
        duration_s = max(closes for _, closes in times.windows) - begun
        while run.state.status == "running":
            if times.is_awake(twin.t) or self.person.doing is not Doing.LYING:
                self._act(TASK_TICKS)
            else:
                self._pass(times.until_awake(twin.t))
            progress(min((twin.t - begun) / duration_s, 1.0))
            landed = twin.t > begun + duration_s + plan.protocol.after_last_s + LANDED_S
            if not plan.is_clocked and (self._is_over() or landed):
                self._feed(Stop(t=twin.t, why="the flight is over"))
        if recording is not None:
            self._rows.write(recording)

    def _begin(self) -> Times:
        twin, plan = self._twin, self.run.plan
        protocol, begun = plan.protocol, twin.t
        feed = None if plan.is_clocked else AircraftFeed(protocol, twin, self._seed, self._hear_aircraft)
        self._feed(Start(t=begun))
        self._set_level(protocol.windows.level_of(protocol.windows.first_number).start)
        if feed is not None:
            self._feed_from = feed
            flown = tuple((begun + opens, begun + closes) for opens, closes in feed.profile.windows_s)
            return Times(flown, LEAD_S["aircraft"])
        if self._is_driven:
            # The twin begins as if held: the torque that carries is there.
            state = twin.read()
            self._envelope.begin(self.stage.controller.step(state.q, np.zeros_like(state.q), self._reference))
        origin, windows = self.run.state.origin, plan.timeline.windows.values()
        return Times(tuple((origin + w.start_s, origin + w.end_s) for w in windows), LEAD_S["clock"])

    def _act(self, ticks: int) -> None:
        """Run the twin, with a person in it who may move."""
        twin, controller, actuators = self._twin, self.stage.controller, self.stage.actuators
        observer, person, panel = self._observer, self.person, self._panel
        for k in range(ticks):
            state = twin.read()
            observer.update(state.q)
            tau_desired = tau = controller.step(observer.q, observer.v, self._reference)
            if self._is_driven:
                tau = self._limited(tau_desired, state.q)
            current = actuators.current(tau)
            if k == 0:
                gained = actuators.torque(state.current)
                self._rows.add(state, observer.v, gained, controller, (tau_desired, tau))
            t = twin.t
            twin.write(Command(t, state.sequence, t + COMMAND_LIFE_S, tau, current))
            if k % ACT_TICKS == 0:
                off = panel.feel(twin.t, twin.finger_on_screen())
                if off is not None:
                    person.touched(twin.t, off)
                truth = twin.truth
                twin.tau_voluntary[:] = person.act(twin.t, truth.q_arm, truth.v_arm)
            if k % LEVEL_TICKS == 0 and self.run.state.window is not None:
                self._set_level(self.run.made_level(twin.t))
        self._ticks += ticks
        self._draw_skeleton()
        self._tell()

    def _limited(self, tau: Joints, q: Joints) -> Joints:
        """Within the envelope; after a stop the machine has come down softly, and an operator begins anew."""
        envelope = self._envelope
        was_stopped = envelope.stop is not None
        tau = envelope.limit(tau, q, self._observer.v)
        if envelope.stop is None:
            return tau
        self.stops += not was_stopped
        if envelope.descent_is_over:
            envelope.reset()
        return tau

    def _pass(self, until_s: float) -> None:
        """Somebody rests: the clock goes on, and with it the task and the aircraft."""
        step = PASSED_S if self.run.plan.is_clocked else PASSED_IN_FLIGHT_S
        step = min(step, until_s)
        state = self._twin.read()
        gained = self.stage.actuators.torque(state.current)
        self._rows.add(state, np.zeros_like(state.q), gained, self.stage.controller, None)
        self._twin.pass_time(max(step, self._twin.period_s))
        self._tell()

    def _tell(self) -> None:
        t = self._twin.t
        for touch in self._panel.reported(t):
            self._feed(touch)
        for event in self._feed_from(t):
            self._feed(event)
        self._feed(Tick(t=t))
        self.person.see(t, participant_picture(self.run.plan, self.run.state, t))

    def _feed(self, event: Event) -> None:
        for record in self.run.feed(event):
            if self._recording is not None:
                self._recording.write("/task", record.t, task_message(record))
            if isinstance(record, TouchJudged) and record.is_accepted and record.window is not None:
                self._note(record)

    def _note(self, touch: TouchJudged) -> None:
        right, down, off = touch.deviation_x_mm, touch.deviation_y_mm, touch.deviation_mm
        if right is None or down is None or off is None or touch.window is None:
            raise RigError("The simulated screen is not calibrated. Give the plan a room's calibration.")
        number = 1 + sum(one.window == touch.window for one in self.touches)
        self.touches.append(FlownTouch(touch.window, number, right, -down, touch.deviation_px, off))

    def _hear_aircraft(self, t: float, sample: AircraftSample) -> None:
        if self._recording is not None:
            message = {"g": list(sample.g), "parabola": sample.parabola, "announcement": sample.announcement}
            self._recording.write("/aircraft", t, message)

    def _set_level(self, level: float) -> None:
        """Between windows the machine goes on as in them: a ramp over a rest would take longer than the window."""
        controller = self.stage.controller
        if isinstance(controller, ArmController) and self.run.plan.exo == "active":
            controller.mode.gravity_level = level

    def _draw_skeleton(self) -> None:
        controller, is_drawn = self.stage.controller, self._ticks % (SKELETON_TICKS // TASK_TICKS * TASK_TICKS) == 0
        if self._recording is None or not is_drawn or not isinstance(controller, ArmController):
            return
        if self.run.state.window is not None:
            exo, arm = controller.skeleton(self._observer.q)
            self._recording.write("/skeleton", self._twin.t, {"exo": exo, "arm": arm})

    def _is_over(self) -> bool:
        """Of a run that no clock ends."""
        run, protocol = self.run, self.run.plan.protocol
        closed = run.state.windows[-1].closed if run.state.windows else None
        is_done = run.state.complete >= set(protocol.windows.numbers)
        return is_done and closed is not None and self._twin.t >= closed + protocol.after_last_s
