"""Flight without a machine: mode table, checks of the guard and moving joints, for pages and their tests."""

import math
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from exograv.identification.core.interface import Outcome
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.rig_settings import Place
from exograv.model.scene import SceneDescription, describe_scene
from exograv.options import Side
from exograv.procedures.calibration.phase_texts import say as calibration
from exograv.runtime.control_loop.steering import CommandDecisions, LeaseCommand
from exograv.safety.guard import CONSENT_S, GRAVITY_LEVEL_S
from exograv.safety.modes import WORN, Event, Mode, ModeMachine
from exograv.safety.stops import StopReason

from .interface import FlightMoment
from .learning_help import learning_help
from .rehearsed_rest import RehearsedRest
from .requests import DonRequest
from .sentences import say
from .view_models import LearnedParameter, Learning, PlotTrace, SkeletonLines, WorkProgress
from .work_progress import CalibrationProgress, identification_progress

JOINTS = ("shoulder_abduction", "shoulder_rotation", "shoulder_flexion", "elbow_flexion")
PLACES: tuple[Place, ...] = ("shoulder", "shoulder", "shoulder", "elbow")
PLOT_HZ, PLOTTED_S = 50, 10.0
STEP_S = 0.05
SWUNG_S = PLOTTED_S + 2 * STEP_S
"""Duration of the kept motion [s]: the plots, and the steps at both ends."""
DESCENT_S = 3.0
CALIBRATED_S = 8.0
"""Duration of a rehearsed calibration [s]. Another side is another machine, which a real session calibrates first."""

WRITTEN_MAX = 10_000
"""Upper limit of stored messages. A rehearsal may run for a day, and has no recording."""

PICTURED = "recupera_like"
"""Machine in the picture of a rehearsal."""

PARAMETERS = (("upper_arm.mass", "kg", 2.0, 0.4), ("forearm.mass", "kg", 1.6, 0.3))
"""Name, unit, mean and half width of the parameters that a rehearsal pretends to identify."""


class RehearsedFlight:
    """`SteeredFlight` without a machine. A mistake on a page moves no hardware."""

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        participants: tuple[str, ...] = ("P-07",),
        side: Side = "right",
    ):
        """Start in mode off, with an unknown person."""
        self._clock, self._lock, self._t = clock, threading.RLock(), clock()
        self._begun_at, self._participants = self._t, participants
        self._modes, self._steering = ModeMachine(), CommandDecisions()
        self._participant: str | None = None
        self._side: Side = side
        self._calibrated_at, self._calibrating = -math.inf, CalibrationProgress(self.now)
        self._is_known, self._identify_s, self._moved_s = False, 60.0, 0.0
        self._latch: StopReason | None = None
        self._latched_at = 0.0
        self._level = self._level_asked = 0.0
        self._agreed_until, self._rest = -math.inf, RehearsedRest()
        self._swung = deque([(self._t, 0.0)], maxlen=round(SWUNG_S / STEP_S))
        self._scene: SceneDescription | None = None
        self.written = deque[tuple[str, float, dict[str, Any]]](maxlen=WRITTEN_MAX)
        """Newest messages that a flight would have recorded."""

    def now(self) -> float:
        """Time of the rehearsal's clock [s]."""
        return self._clock()

    def moment(self) -> FlightMoment:
        """State of the rehearsed flight."""
        with self._lock:
            self._advance()
            share, n, t = self._modes.arm_share, len(JOINTS), self._t
            tau = tuple(share * (2.0 + joint) for joint in range(n))
            return FlightMoment(
                mode=None if self._is_calibrating else self._modes.mode,
                doing=say("flight.rehearses") if self._is_calibrating else "",
                work=self._work(),
                latch=None if self._latch is None else self._latch.sentence,
                safe_state="none" if self._latch is None else "descent",
                rig="rehearsal",
                title="A rehearsal without a machine",
                side=self._side,
                sides=("right", "left"),
                is_twin=True,
                participant=self._participant,
                participants=self._participants,
                is_known=self._is_known,
                is_learned=self._is_known,
                joints=JOINTS,
                q_rad=self._q((t,))[0],
                v_rad_s=self._v(),
                tau_desired_Nm=tau,
                tau_commanded_Nm=tau,
                tau_limit_Nm=(40.0,) * n,
                gravity_level_asked=self._level_asked,
                gravity_level=self._level,
                arm_share=share,
                learning=self._learning(),
                rests=self._rest.view(self._why_no_rest),
            )

    def trace(self, since: int) -> PlotTrace:
        """Return the samples of the last ten seconds."""
        with self._lock:
            self._advance()
            newest = int((self._t - self._begun_at) * PLOT_HZ)
            first = max(since, newest - round(PLOTTED_S * PLOT_HZ), 0)
            t = tuple(self._begun_at + number / PLOT_HZ for number in range(first, newest))
            q, tau = self._q(t), tuple((0.0,) * len(JOINTS) for _ in t)
            return PlotTrace(first=first, next=max(newest, first), t=t, q_rad=q, tau_desired_Nm=tau,
                         tau_commanded_Nm=tau, tau_measured_Nm=tau)  # fmt: skip

    def skeleton(self) -> SkeletonLines:
        """Return joint positions without lines: the arm in the picture moves with its cuffs."""
        with self._lock:
            self._advance()
            return SkeletonLines(q_rad=self._q((self._t,))[0], exo=(), arm=())

    def scene(self) -> SceneDescription:
        """Describe a nominal person in a machine whose joints have the names of the rehearsal."""
        if self._scene is None or self._scene.side != self._side:
            self._scene = describe_scene(load_rig(PICTURED, self._side), Body(1.75, 75.0, "male"))
        return self._scene

    def ask(self, event: Event) -> str:
        """Decide on an event as the guard does."""
        with self._lock:
            self._advance()
            if event is Event.RESET and self._latch is not None:
                if self._t - self._latched_at < DESCENT_S:
                    return say("rehearsal.still_down")
                self._latch = None
            is_latched, now_ns = self._latch is not None, round(1e9 * self._t)
            why = self._steering.ask(event, self._modes.mode, is_latched=is_latched, now_ns=now_ns)
            self._advance(STEP_S)
            return why

    def stop(self) -> None:
        """Stop as the guard does."""
        with self._lock:
            self._advance()
            if self._latch is None:
                self._latch, self._latched_at = StopReason.STOP_PRESSED, self._t
            self._steering.stopped()
            self._modes.take(Event.FAULT)

    def feel(self, gravity_level: float, ramp_s: float) -> str:
        """Set the level, which follows by the guard's ramp; above 1 it needs the participant's consent."""
        with self._lock:
            self._advance()
            if gravity_level > 1.0 and self._t > self._agreed_until:
                return say("rehearsal.not_agreed")
            if self._rest.is_active:
                return say("rest.runs")
            self._level_asked = gravity_level
            return ""

    def learn_in_rest(self) -> str:
        """Show a rest in which a machine would move the arm and learn it."""
        with self._lock:
            self._advance()
            if why := self._rest.view(self._why_no_rest).why_not:
                return why
            self._rest.begin(self._t)
            return ""

    @property
    def _why_no_rest(self) -> str:
        return "" if self._is_known and self._modes.mode is Mode.FLOATING else say("rest.unlearned")

    def agree(self) -> str:
        """Take the participant's consent as the guard does."""
        with self._lock:
            self._advance()
            self._agreed_until = self._t + CONSENT_S
            return ""

    def don(self, who: DonRequest) -> str:
        """Change the person immediately."""
        with self._lock:
            if who.side not in (None, self._side):
                self._calibrated_at, self._calibrating = self._t + CALIBRATED_S, CalibrationProgress(self.now)
            self._participant, self._is_known = who.participant, who.participant is not None
            self._rest = RehearsedRest()
            self._identify_s, self._moved_s, self._side = who.identify_s, 0.0, who.side or self._side
            return ""

    def lease(self, until_s: float, window_left_s: float | None) -> None:
        """Take the lease as the guard does."""
        with self._lock:
            self._advance()
            window = None if window_left_s is None else round(1e9 * (self._t + window_left_s))
            self._steering.lease(LeaseCommand(round(1e9 * until_s), window), round(1e9 * self._t))

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Append a message to `written`; a rehearsal has no recording."""
        self.written.append((topic, t, dict(message)))

    def close(self) -> None:
        """Do nothing; there are no processes."""

    def _advance(self, at_least_s: float = 0.0) -> None:
        """Advance the simulation to the present time."""
        until = max(self._clock(), self._t + at_least_s)
        while self._t + STEP_S <= until:
            self._t += STEP_S
            self._step()

    def _step(self) -> None:
        modes = self._modes
        if self._steering.watch(modes.mode, round(1e9 * self._t)) and self._steering.is_to_stop:
            self.stop()
        if (event := self._steering.next()) is not None:
            modes.take(event)
        if modes.mode is Mode.FLOATING and not self._is_known:
            modes.take(Event.MOVE)
        is_led = self._rest.step(self._t, modes.mode)
        if self._is_known and is_led != (modes.mode is Mode.MOVING):
            modes.take(Event.MOVE if is_led else Event.FLOAT)
        elif modes.mode is Mode.MOVING and not is_led:
            self._moved_s += STEP_S
            self._is_known = self._moved_s >= self._identify_s
            if self._is_known:
                modes.take(Event.FLOAT)
        if modes.mode in WORN or modes.mode is Mode.OFF:
            way = (0.0 if self._rest.is_active else self._level_asked) - self._level
            self._level += math.copysign(min(abs(way), STEP_S / GRAVITY_LEVEL_S), way)
        modes.step(STEP_S, 0.0, 0.0)
        # Only an arm that the machine carries moves: a machine that is off must not seem to move.
        self._swung.append((self._t, self._swung[-1][1] + STEP_S * modes.arm_share))

    def _q(self, t: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        times, phases = zip(*self._swung, strict=True)
        at_t = np.interp(t, times, phases).tolist()
        return tuple(tuple(0.4 + 0.1 * math.sin(phase + joint) for joint in range(len(JOINTS))) for phase in at_t)

    def _v(self) -> tuple[float, ...]:
        phase, share = self._swung[-1][1], self._modes.arm_share
        return tuple(0.1 * share * math.cos(phase + joint) for joint in range(len(JOINTS)))

    @property
    def _is_calibrating(self) -> bool:
        return self._t < self._calibrated_at

    def _work(self) -> WorkProgress | None:
        if self._is_calibrating:
            done = 1.0 - (self._calibrated_at - self._t) / CALIBRATED_S
            joint = min(int(done * len(JOINTS)), len(JOINTS) - 1)
            text = calibration("calibration.sweep", joint=JOINTS[joint], number=joint + 1, of=len(JOINTS))
            self._calibrating(text, done * len(JOINTS) - joint)
            return self._calibrating.work
        if (work := self._rest.work()) is not None:
            return work
        is_moving = self._modes.mode is Mode.MOVING
        return identification_progress(self._learning(), is_moving, self._identify_s, JOINTS, self._v())

    def _learning(self) -> Learning | None:
        if not self._moved_s:
            return None
        left = 1.0 / math.sqrt(1.0 + self._moved_s)
        parameters = tuple(
            LearnedParameter(name=name, unit=unit, prior=mean, prior_half_width=width, mean=mean + 0.2 * (1.0 - left),
                             half_width=width * left)
            for name, unit, mean, width in PARAMETERS
        )  # fmt: skip
        over, share = self._is_known, min(self._moved_s / self._identify_s, 1.0)
        left_over = (2.0 * left,) * len(JOINTS)
        farthest, advice = learning_help(JOINTS, PLACES, left_over, over)
        return Learning(
            share_done=share,
            parameters=parameters,
            left_over_Nm=left_over,
            left_over_prior_Nm=(2.0,) * len(JOINTS),
            outcome=say("rehearsal.identified") if over else Outcome.RUNNING.sentence,
            is_over=over,
            farthest=farthest,
            help=advice,
        )
