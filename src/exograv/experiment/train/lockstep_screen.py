"""A participant at a screen in full lock-step: control, guard and task step by step on one machine."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from exograv import motion
from exograv.laboratory.participant.screen_session import LEVEL_S, TASK_S, EventSource, ScreenSession, Seat
from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.procedures.identification.identify import SKELETON_TICKS, record_skeleton
from exograv.recording.schema import REST_PASSED
from exograv.safety.person import GuardedPerson
from exograv.task.events import Distance, Event, Pause, Resume
from exograv.task.levels import EARTH, RATE_MAX_PER_S
from exograv.task.run import TaskRun
from exograv.task.timed_transitions import next_due

CHUNK_S = 1.0

CONSENTS_BEFORE_S = 60.0
"""Rest of a consent below which the simulated participant agrees again [s]: longer than a pull-up."""

CALM_S = 10.0
"""Time of rest after a window from which a participant whose muscles are not seen counts as relaxed, assumed [s]."""

AWAKE_S = 3.0
"""Time before a window, or before the end of the session, from which every tick is simulated again [s]. The arm then
rests as it did before the time passed."""


@dataclass
class BetweenWindows:
    """Act of the machine in the rest after every so many windows."""

    every: int
    """Number of windows between two acts; 0 for never."""
    why: str
    """Reason of the pause in the task's records."""
    act: Callable[[], Controller]
    """Function that acts while the run is paused, and returns the controller from then on."""
    after: int = 0
    """Number of complete windows at the last act."""


@dataclass
class LockstepScreen:
    """Machine of a `ScreenSession` that a pilot flies in chunks of `CHUNK_S`."""

    run: TaskRun
    pilot: Pilot
    controller: Controller
    seat: Seat
    between: tuple[BetweenWindows, ...] = field(default=())
    """Acts between windows, in this order."""
    modulate: Callable[[float], float] | None = None
    """Function of the task's level that returns the level to make; None makes the task's level. It must return 1 for 1,
    or the session never ends."""
    follower: Callable[[TickSample], None] | None = None
    """Observer of every tick."""
    pass_time: Callable[[float], object] | None = None
    """Function that lets time [s] pass while nothing moves; with None every tick of a rest is simulated."""
    passed_s: float = field(default=0.0, init=False)
    """Time of rests that has passed without ticks [s]."""

    def __post_init__(self):
        """Store the resting posture and the number of complete windows."""
        self._ticks, period_s = 0, self.pilot.rig.period_s
        self._task_ticks, self._level_ticks = (max(round(each_s / period_s), 1) for each_s in (TASK_S, LEVEL_S))
        self._q_rest = self.pilot.q.copy()
        self._still = motion.hold(self.pilot.q, CHUNK_S, period_s)
        for act in self.between:
            act.after = len(self.run.state.complete)

    def fly(self, *others: EventSource) -> None:
        """Run from the present state to the end; `others` are sources beside the touch panel.

        Raises:
            RigError: The envelope stopped the machine.
            KeyboardInterrupt: Ctrl-C.
        """
        tell = self.pilot.progress
        self.pilot.progress = lambda text, _share: tell(text, self._share())
        self.seat.session(self.run, *others).fly(self)

    @property
    def t(self) -> float:
        """Clock of the machine [s]."""
        return self.pilot.rig.t

    @property
    def is_settling(self) -> bool:
        """True while an arm is still carried, because it must not fall."""
        return isinstance(self.controller, ArmController) and self.controller.mode.gravity_level < 1.0

    def advance(self, session: ScreenSession) -> None:
        """Run one chunk, and act between windows if it is due."""
        self.pilot.run(self.controller, self._still, phase_of(self.run), lambda moment: self._listen(session, moment))
        for act in self.between:
            if self._is_time_for(act):
                self._pause_and(act)
        self._pass_rest(session)

    def why_over(self, run: TaskRun) -> str:
        """Reason to stop a run that no clock ends."""
        return "all windows are complete" if run.is_over(self.t) else ""

    def _is_time_for(self, act: BetweenWindows) -> bool:
        """Return True once in the rest after every so many windows, as soon as the arm lies on its support."""
        return self._is_due(act) and self._is_rest and self._is_calm

    def _is_due(self, act: BetweenWindows) -> bool:
        complete = len(self.run.state.complete)
        is_last = complete == self.run.plan.protocol.windows.count
        return act.every > 0 and complete > act.after and complete % act.every == 0 and not is_last

    @property
    def _is_rest(self) -> bool:
        """True if no window is open and the arm lies on its support."""
        state = self.run.state
        return state.status == "running" and state.window is None and not self.is_settling

    def _pass_rest(self, session: ScreenSession) -> None:
        """Let the time pass until shortly before the next transition of a clocked run, if nothing moves until then."""
        run, due = self.run, next_due(self.run.plan, self.run.state)
        if self.pass_time is None or due is None or not run.plan.is_clocked or not self._is_rest:
            return
        left_s = round(due.t - AWAKE_S - self.t, 3)
        if not self._is_calm or left_s < 2.0 * AWAKE_S or any(self._is_due(act) for act in self.between):
            return
        if self.pilot.recording is not None:
            text = f"{left_s:.1f} s of rest pass without ticks."
            self.pilot.recording.write("/event", self.t, {"kind": REST_PASSED, "text": text})
        self.pass_time(left_s)
        self.passed_s += left_s
        session.tell(self.t)

    @property
    def _is_calm(self) -> bool:
        """True if the participant relaxes, as far as the seat sees, or has rested for long enough to do so."""
        if (relaxed := self.seat.is_relaxed) is not None:
            return relaxed
        closed = self.run.state.windows[-1].closed
        return closed is not None and self.t >= closed + CALM_S

    def _pause_and(self, act: BetweenWindows) -> None:
        act.after = len(self.run.state.complete)
        self.run.feed(Pause(t=self.t, why=act.why))
        self.controller = act.act()
        self.pilot.begin("task")
        self.run.feed(Resume(t=self.t))

    def _share(self) -> float:
        """Share of the run that is done [-]."""
        run = self.run
        if run.plan.is_clocked:
            return min(max((self.t - run.state.origin) / run.plan.timeline.duration_s, 0.0), 1.0)
        return len(run.state.complete) / run.plan.protocol.windows.count

    def _listen(self, session: ScreenSession, moment: TickSample) -> None:
        t = moment.state.t
        self._ticks += 1
        if self.follower is not None:
            self.follower(moment)
        self.seat.touch(t)
        if self._ticks % self._task_ticks == 0:
            session.tell(t, *self._distance(t, moment))
        if self._ticks % self._level_ticks == 0:
            self._follow_level(t)
        self.seat.act()
        is_drawn = self._ticks % SKELETON_TICKS == 0 and self.run.state.window is not None
        if is_drawn and isinstance(self.controller, ArmController):
            record_skeleton(self.pilot, self.controller, moment)

    def _distance(self, t: float, moment: TickSample) -> tuple[Event, ...]:
        """Distance of the hand from its resting place, for protocols that ask for it."""
        if self.run.plan.protocol.pointing.return_check not in ("joints", "fingertip"):
            return ()
        joints = float(np.abs(moment.state.q - self._q_rest).max())
        fingertip = None
        if isinstance(self.controller, ArmController):
            tip, rest = (np.array(self.controller.skeleton(q)[1][-1]) for q in (moment.q, self._q_rest))
            fingertip = float(np.linalg.norm(tip - rest))
        return (Distance(t=t, fingertip_m=fingertip, joints_rad=min(joints, 10.0)),)

    def _follow_level(self, t: float) -> None:
        """Set the ramp's level in controller and guard."""
        controller, person = self.controller, self.pilot.envelope.person
        if not isinstance(controller, ArmController):
            return
        level = self.run.made_level(t)
        if self.modulate is not None:
            level = self.modulate(level)
        if person is not None and level > EARTH:
            level = self._pushed(person, level)
        controller.mode.gravity_level = level
        if person is not None:
            person.gravity_level = level

    def _pushed(self, person: GuardedPerson, level: float) -> float:
        """Return the level above Earth that the guard allows now: where it has ended the push, a new ramp begins.

        The simulated participant agrees to each pull-up.
        """
        if self.pilot.guard.consent_s < CONSENTS_BEFORE_S:
            self.pilot.guard.consent()
        return min(level, max(person.gravity_level, EARTH) + RATE_MAX_PER_S * LEVEL_S)


def phase_of(run: TaskRun) -> str:
    """Name the phase of a run for its progress. A rest is named with its duration: it may be longer than a window."""
    state, count = run.state, run.plan.protocol.windows.count
    complete, window = len(state.complete), state.window
    if window is not None:
        return f"Window {min(complete + 1, count)} of {count}{_again(window.attempt)}"
    following = state.next_window(run.plan.protocol.windows.numbers)
    if following is None:
        return f"Rest of {run.plan.protocol.after_last_s:.0f} s after the last window"
    rest = f"Rest of {_rest_s(run, following):.0f} s" if run.plan.is_clocked else "Rest"
    return f"{rest} before window {complete + 1} of {count}{_again(state.attempts(following) + 1)}"


def _again(attempt: int) -> str:
    return f", attempt {attempt}" if attempt > 1 else ""


def _rest_s(run: TaskRun, following: int) -> float:
    """Time between the end of the last window, or the last start of the program, and the following window [s]."""
    state = run.state
    opens = state.origin + run.plan.timeline.windows[following].start_s
    last = state.windows[-1] if state.windows else None
    if last is not None and last.epoch == state.epoch and last.closed is not None:
        return opens - last.closed
    return opens - (state.left_at if state.epoch else state.origin)
