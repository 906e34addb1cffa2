"""A flight of real processes: guard, control, recorder and worker, begun anew for everybody who is put in."""

import contextlib
import itertools
import threading
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from exograv.dynamics.parameters import names_and_units
from exograv.errors import ConfigError, ExogravError
from exograv.model.description import Side
from exograv.runtime.exchange import FeltLevel
from exograv.runtime.recorder import Recorder
from exograv.runtime.recorder import Report as RecorderReport
from exograv.runtime.steering import Asked, Heard, Leased, Loss, Pressed
from exograv.safety.modes import Event, Mode
from exograv.session.arm_controller import ArmController
from exograv.session.calibration_run import twin_identity
from exograv.session.learner import table_guess
from exograv.session.lesson import Judged
from exograv.session.live import parts_of, settings_of
from exograv.session.live_control import Plan
from exograv.session.live_processes import Running, fly
from exograv.session.prepare import Prepared, machine_of
from exograv.session.virtual import draw_laboratory, limits, refuse_motorless
from exograv.signals import Reference

from .flight import Moment
from .people import Don, People
from .shown import LearnedParameter, Learning, Recorded, Skeleton, Trace
from .watching import Watching

LOOKS_EVERY_S = 0.02
ANSWER_WITHIN_S = 0.4
"""A guard that is there answers in some milliseconds; its line is looked at by a thread of an ordinary process."""

WARNED_S, ENDED_S = 300.0, 15.0
"""Before the end of a recording: told so, and the arm let down, which takes 3 s [s]."""

CLOSED_WITHIN_S = 20.0
INTERVAL = 1.96
"""Standard deviations of half a 95 % interval."""

SHOWN_UNITS = ("kg", "kg·m")
"""Of the parameters that are shown: what carries weight."""

NOT_RECORDED = ("/console/trail",)
"""Topics that are too many for the recording's messages; the console keeps them itself."""


@dataclass(frozen=True)
class SteeredOptions:
    """What a steered session on the twin is begun with."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    donning: int = 0
    """Number of the day on which the virtual person is in the machine."""
    calibration: Path | None = None
    """Of the machine; it is calibrated at the beginning where absent."""
    participants: Path | None = None
    """Folder of files that `exograv identify --keep` has written."""
    participant: str | None = None
    """Code of whoever is in it at the beginning; absent for somebody who is to be identified."""
    identify_s: float = 60.0
    """Of motion, if so [s]."""
    session_s: float = 3600.0
    """Longest recording [s]."""
    on_loss: Loss = "finish"
    """What becomes of a window that runs when nobody steers any more."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 60.0 <= self.session_s <= 7200.0:
            raise ConfigError(f"--session is {self.session_s:g} s; allowed: 60 to 7200.")


@dataclass
class _State:
    """What the flight's own thread has said last."""

    doing: str = "The machine is calibrated."
    who: Don = field(default_factory=lambda: Don(None, 60.0))
    plan: Plan | None = None
    running: Running | None = None
    watching: Watching | None = None
    path: Path | None = None
    recording: RecorderReport | None = None
    begun_s: float = 0.0
    level_asked: float = 0.0
    failure: str = ""
    warnings: tuple[str, ...] = ()


class LiveFlight:
    """A `Flight` on the twin, at the machine's own clock."""

    def __init__(self, options: SteeredOptions, folder: Path):
        """Begin, in a thread of its own: the machine is calibrated, then guard and control start.

        Raises:
            ConfigError: The rig or an option cannot be used.
        """
        self._options, self._folder = options, folder
        self._laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed,
                                           donning=options.donning)  # fmt: skip
        refuse_motorless(self._laboratory.description)
        identity = twin_identity(options.level, options.seed)
        self._people = People(self._laboratory, identity, options.participants)
        self._participants = tuple(self._people.files())
        self._next = Don(options.participant, options.identify_s)
        self._state, self._numbers = _State(who=self._next), itertools.count(1)
        self._answers: dict[int, str] = {}
        self._answered, self._drawing = threading.Condition(), threading.Lock()
        self._controller: ArmController | None = None
        self._is_closing = self._is_ending = False
        self._is_asked = threading.Event()
        self._is_asked.set()
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._live, self._watch)]
        for thread in self._threads:
            thread.start()

    def now(self) -> float:
        """CLOCK_MONOTONIC [s]."""
        return time.monotonic()

    def moment(self) -> Moment:
        """By what the guard has recorded last."""
        state, description = self._state, self._laboratory.description
        watching = None if self._is_ending or state.running is None else state.watching
        row, nothing = (None if watching is None else watching.newest), (0.0,) * len(description.joints)
        told = _told(row, nothing)
        mode = None if watching is None or row is None else watching.mode
        return Moment(
            Mode.OFF if state.failure else mode,
            None if watching is None else watching.latch,
            "none" if watching is None else watching.safe_state,
            description.name,
            description.settings.title,
            description.side,
            True,
            state.who.participant,
            self._participants,
            self._is_known(state),
            tuple(description.joints),
            *told[:4],
            tuple(limits(description).torque_max_Nm.tolist()),
            state.level_asked,
            *told[4:],
            None if watching is None else watching.lateness(),
            self._recorded(state),
            self._learning(state),
            state.failure,
            state.warnings,
            state.doing,
        )

    def trace(self, since: int) -> Trace:
        """By the recorded ticks."""
        watching = self._state.watching
        if watching is None:
            return Trace(first=0, next=0, t=(), q_rad=(), tau_desired_Nm=(), tau_commanded_Nm=(), tau_measured_Nm=())
        return watching.trace(since)

    def skeleton(self) -> Skeleton:
        """By control's model, at the posture that was measured last."""
        state, controller = self._state, self._controller
        row = None if state.watching is None else state.watching.newest
        if controller is None or row is None or not np.isfinite(row["q_measured"]).all():
            return Skeleton(exo=(), arm=())
        with self._drawing:
            q, still = row["q_measured"].copy(), np.zeros(len(row["q_measured"]))
            controller.step(q, still, Reference(q, still, still))
            exo, arm = controller.skeleton(q)
        return Skeleton(exo=(_points(exo),), arm=(_points(arm),))

    def ask(self, event: Event) -> str:
        """By the guard's word."""
        number = next(self._numbers)
        return self._said(Asked(number, event), number)

    def stop(self) -> None:
        """Heard in the guard's next tick."""
        running = self._state.running
        if running is not None:
            with contextlib.suppress(OSError):
                running.line.send(Pressed(next(self._numbers)))

    def feel(self, gravity_level: float, ramp_s: float) -> str:
        """By the guard's word; recorded before it, as a replay needs it."""
        state, number = self._state, next(self._numbers)
        row = None if state.watching is None else state.watching.newest
        if state.running is not None and row is not None:
            message = {"act": "level", "gravity_level": gravity_level, "ramp_s": ramp_s}
            state.running.recorder.write("/control", float(row["now"]), message)
        why = self._said(FeltLevel(gravity_level, ramp_s, number), number)
        if not why:
            state.level_asked = gravity_level
        return why

    def don(self, participant: str | None, identify_s: float) -> str:
        """All processes end, and others begin."""
        self._next = Don(participant, identify_s)
        self._end()
        self._is_asked.set()
        return ""

    def lease(self, until_s: float, window_left_s: float | None) -> None:
        """To the guard, on the clock that both have."""
        running = self._state.running
        if running is None or self._is_ending:
            return
        window = None if window_left_s is None else round(1e9 * (self.now() + window_left_s))
        with contextlib.suppress(OSError):
            running.line.send(Leased(round(1e9 * until_s), window, self._options.on_loss))

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """To the recording, on the rig's clock."""
        state = self._state
        row = None if state.watching is None else state.watching.newest
        if state.running is None or row is None or topic in NOT_RECORDED:
            return
        rig_t = t + float(row["now"]) - float(row["monotonic"])
        state.running.recorder.write("/page", rig_t, {"topic": topic, "message": dict(message)})

    def close(self) -> None:
        """The arm comes down, all ends."""
        self._is_closing = True
        self._end()
        self._is_asked.set()
        for thread in self._threads:
            thread.join(CLOSED_WITHIN_S)

    def _end(self) -> None:
        self._is_ending = True
        running = self._state.running
        if running is not None:
            with contextlib.suppress(OSError):
                running.stop()

    def _said(self, word: object, number: int) -> str:
        """What the guard answers to a word of this number."""
        running = self._state.running
        if running is None or self._is_ending:
            return "There is no guard. Wait until the machine is off."
        try:
            running.line.send(word)
        except OSError:
            return "The guard's process has ended."
        with self._answered:
            if not self._answered.wait_for(lambda: number in self._answers, ANSWER_WITHIN_S):
                return "The guard did not answer in time. Look at what is shown before you ask again."
            return self._answers.pop(number)

    def _hear(self, word: object) -> None:
        if isinstance(word, Heard):
            with self._answered:
                self._answers[word.number] = word.why
                self._answered.notify_all()

    def _live(self) -> None:
        """The thread that calibrates, and then is the parent of one set of processes after the other."""
        try:
            prepared = self._prepared()
        except ExogravError as error:
            self._state = _State(failure=str(error))
            return
        for number in itertools.count(1):
            self._is_asked.wait()
            self._is_asked.clear()
            if self._is_closing:
                return
            self._is_ending, who = False, self._next
            self._state = state = _State("Guard and control are starting.", who)
            try:
                self._fly(state, prepared, self._folder / f"steered-{number}.mcap")
                if not self._is_ending:
                    state.failure = "The recording has come to its end. Put the person in anew to go on."
            except ExogravError as error:
                state.failure = str(error)
            state.running = None

    def _prepared(self) -> Prepared:
        options, laboratory = self._options, self._laboratory
        machine, t = machine_of(laboratory, options.level, options.seed, options.calibration, lambda *_: None)
        assembly = laboratory.assembly()
        return Prepared(assembly, machine, table_guess(assembly, machine), t)

    def _fly(self, state: _State, prepared: Prepared, path: Path) -> None:
        options = self._options
        with contextlib.ExitStack() as stack:
            plan = self._people.plan(state.who, prepared, options.seed, stack)
            said = {"disturbance_level": options.level, "seed": options.seed,
                    "settings": {"options": _written(options)}}  # fmt: skip
            self._controller = ArmController(
                prepared.assembly, prepared.machine, plan.prepared.x, 1e-9 * plan.period_ns
            )
            recorder = stack.enter_context(
                Recorder(path, plan.description.joints, settings_of(plan, said), options.session_s)
            )
            state.plan, state.path = plan, path

            def started(running: Running) -> None:
                state.watching = stack.enter_context(contextlib.closing(Watching(recorder.inlet)))
                state.begun_s, state.running = self.now(), running
                if self._is_ending:
                    running.stop()

            def progress(_phase: str, _share: float) -> None:
                if state.running is not None:
                    self._look_after(state, state.running)

            fly(parts_of(plan, is_tested=False), options.session_s, recorder, progress, started, hears=self._hear)

    def _look_after(self, state: _State, running: Running) -> None:
        """Some times a second, in the thread that is the processes' parent."""
        state.recording = running.recorder.check()
        left, warnings = self._options.session_s - (self.now() - state.begun_s), []
        if left < WARNED_S:
            warnings.append("The recording ends in less than five minutes; the arm is let down then.")
        if running.control.restarts:
            warnings.append("Control has died or did not answer, and was started anew.")
        state.warnings = tuple(warnings)
        if left < ENDED_S:
            running.stop()

    def _watch(self) -> None:
        while not self._is_closing:
            state = self._state
            if state.watching is not None and state.running is not None:
                state.watching.look()
            time.sleep(LOOKS_EVERY_S)

    def _is_known(self, state: _State) -> bool:
        worker = None if state.running is None else state.running.worker
        return state.who.participant is not None or (worker is not None and worker.learned is not None)

    def _recorded(self, state: _State) -> Recorded | None:
        report = state.recording
        if report is None or state.path is None:
            return None
        return Recorded(
            path=str(state.path), samples=report.acknowledged, lost=report.lost, is_ok=report.recording_ok,
            why=report.why
        )  # fmt: skip

    def _learning(self, state: _State) -> Learning | None:
        worker = None if state.running is None else state.running.worker
        if worker is None or worker.judged is None or state.plan is None:
            return None
        learned = worker.learned
        outcome = "The identification is still running." if learned is None else learned.outcome.value
        return Learning(
            share_done=1.0 if learned is not None else min(worker.judged.motion_s / state.who.identify_s, 1.0),
            parameters=_parameters(worker.judged, state.plan),
            left_over_Nm=tuple(worker.judged.left_over.tolist()),
            left_over_prior_Nm=tuple(worker.judged.left_over_prior.tolist()),
            outcome=outcome,
            is_over=learned is not None,
        )


def _told(row: np.void | None, nothing: tuple[float, ...]) -> tuple[Any, ...]:
    """Of the newest tick: q, v, torque asked for and let out, gravity level and share of the arm."""
    if row is None:
        return nothing, nothing, nothing, nothing, 0.0, 0.0
    joints = (tuple(np.nan_to_num(row[name]).tolist()) for name in ("q_measured", "v", "tau_desired", "tau_commanded"))
    level, share = (float(np.nan_to_num(row[name])) for name in ("gravity_level", "arm_share"))
    return *joints, level, share


def _parameters(judged: Judged, plan: Plan) -> tuple[LearnedParameter, ...]:
    rows = zip(names_and_units(plan.prepared.assembly), judged.x, judged.sd, judged.prior, judged.prior_sd, strict=True)
    return tuple(
        LearnedParameter(
            name=name, unit=unit, mean=float(x), half_width=INTERVAL * float(sd), prior=float(before),
            prior_half_width=INTERVAL * float(before_sd)
        )
        for (name, unit), x, sd, before, before_sd in rows
        if unit in SHOWN_UNITS
    )  # fmt: skip


def _points(rows: list[list[float]]) -> tuple[tuple[float, float, float], ...]:
    return tuple((x, y, z) for x, y, z in rows)


def _written(options: SteeredOptions) -> dict[str, Any]:
    return {name: str(value) if isinstance(value, Path) else value for name, value in asdict(options).items()}
