"""Flight of real processes: guard, control, recorder and worker, started again for every person."""

import contextlib
import itertools
import threading
import time
import traceback
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ExogravError, RecordingError
from exograv.live.live_control import LivePlan
from exograv.live.live_flight import parts_of, settings_of
from exograv.live.live_processes import LiveResult, Running, fly
from exograv.live.live_rests import LiveRests
from exograv.live.order_line import OrderLine, order_line
from exograv.loop.arm_controller import ArmController
from exograv.model.scene import SceneDescription
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.verdict_text import carried_text
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.runtime.control_loop.exchange import Consent, FeltLevel
from exograv.runtime.control_loop.steering import DescentCommand, GuardReply, GuardRequest, LeaseCommand
from exograv.runtime.lsl.library import require_lsl
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.ros2.streaming import Streaming
from exograv.safety.modes import Event, Mode
from exograv.signals import Reference
from exograv.storage.rests_so_far import NO_RESTS

from .flight_rests import FlightRests
from .interface import FlightMoment
from .memory_view import FlightMemoryView
from .options import SteeredOptions
from .participants import RequestedParticipant
from .process_state import ProcessState, points, told
from .requests import DonRequest
from .sentences import say
from .steered_machine import MachineOf, SteeredMachine
from .view_models import PlotTrace, SkeletonLines

LOOKS_EVERY_S = 0.02
ANSWER_WITHIN_S = 0.4
"""Time-out for the guard's answer [s]. The guard answers in milliseconds; the parent looks every 20 ms."""

WARNED_S, ENDED_S = 300.0, 15.0
"""Times before the end of a recording [s]: first a warning, then the descent of the arm, which takes 3 s."""

CLOSED_WITHIN_S = 20.0
BEGUN_WITHIN_S = 2.0
"""Time after the first tick of a machine on drives within which its guard must take the operator's request [s].

Later the motors are switched off again: nobody steers any more.
"""

RECORDING = "steered-{}.mcap"
"""Name of a recording, by its number: one for each time that the motors were on."""

NOT_RECORDED = ("/console/trail",)
"""Topics with too many messages for the recording. The console stores them itself."""


def recordings_in(folder: Path) -> list[Path]:
    """Return the recordings of steered sessions in a folder, in the order of their numbers."""
    start, end = RECORDING.split("{}")
    numbered = {path: path.name.removeprefix(start).removesuffix(end) for path in folder.glob(RECORDING.format("*"))}
    return sorted((path for path, number in numbered.items() if number.isdigit()), key=lambda path: int(numbered[path]))


class LiveFlight:
    """`SteeredFlight` on the twin or on drives, in real time."""

    def __init__(self, options: SteeredOptions, folder: Path, machine_of: MachineOf):
        """Start in a thread of its own: calibrate the twin, then start guard and control.

        A machine on drives waits for an operator who makes it ready. Until then its motors are off.

        Raises:
            ExogravError: The machine or an option was refused.
        """
        if options.lsl or options.record_streams:
            require_lsl()
        self._options, self._folder, self._machine_of = options, folder, machine_of
        place = machine_of(options.side)
        self._places = {place.side: place}
        self._next = self._donned(place, options.participant, options.identify_s)
        self._rests_so_far = options.rests
        """Rests of the session with the person in the machine, from before the present processes."""
        self._state, self._numbers = ProcessState(self._next, place), itertools.count(1)
        self._answers: dict[int, str] = {}
        self._levels_asked: dict[int, float] = {}
        """Gravity levels without an answer of the guard, by number of the request. A late answer counts too."""
        self._answered, self._drawing = threading.Condition(), threading.Lock()
        self._controller: ArmController | None = None
        self._is_closing = self._is_ending = False
        self._is_requested = threading.Event()
        """Set when an operator makes a waiting machine ready, and when the wait is over for another reason."""
        self._is_asked = threading.Event()
        self._is_asked.set()
        self._threads = [threading.Thread(target=target, daemon=True) for target in (self._live, self._watch)]
        for thread in self._threads:
            thread.start()

    def now(self) -> float:
        """Time of CLOCK_MONOTONIC [s]."""
        return time.monotonic()

    def moment(self) -> FlightMoment:
        """State of the flight, from the newest recorded tick of the guard."""
        state = self._state
        description = state.place.description
        watching = None if self._is_ending or state.running is None else state.watching
        row = None if watching is None else watching.newest
        mode = None if watching is None or row is None else watching.mode
        values = told(row, len(description.joints))
        return FlightMoment(
            mode=Mode.OFF if state.failure or state.is_waiting else mode,
            latch=None if watching is None or state.is_switched_off else watching.latch,
            safe_state="none" if watching is None else watching.safe_state,
            rig=description.name,
            title=description.settings.title,
            side=description.side,
            sides=description.settings.urdf.sides if state.place.is_twin else (description.side,),
            is_twin=state.place.is_twin,
            participant=state.keeping.code,
            participants=state.place.people.codes,
            is_known=state.is_known,
            is_learned=state.is_learned,
            joints=tuple(description.joints),
            tau_limit_Nm=state.place.torque_max_Nm,
            gravity_level_asked=state.level_asked,
            **values,
            work=state.work(values, mode is Mode.MOVING),
            age_s=0.0 if row is None else max(self.now() - float(row["monotonic"]), 0.0),
            lateness=None if watching is None else watching.lateness(),
            recorded=state.recorded(),
            streams=state.streams(),
            learning=state.learning(),
            rests=None if state.rests is None else state.rests.view(),
            failure=state.failure,
            warnings=state.warnings,
            doing=state.doing,
        )

    def trace(self, since: int) -> PlotTrace:
        """Return the samples to plot, from the recorded ticks."""
        watching = self._state.watching
        if watching is None:
            return PlotTrace(
                first=0, next=0, t=(), q_rad=(), tau_desired_Nm=(), tau_commanded_Nm=(), tau_measured_Nm=()
            )
        return watching.trace(since)

    def skeleton(self) -> SkeletonLines:
        """Lines of the controller's model at the last measured posture."""
        state, controller = self._state, self._controller
        row = None if state.watching is None else state.watching.newest
        if controller is None or row is None or not np.isfinite(row["q_measured"]).all():
            return SkeletonLines(exo=(), arm=())
        with self._drawing:
            q, still = row["q_measured"].copy(), np.zeros(len(row["q_measured"]))
            controller.step(q, still, Reference(q, still, still))
            exo, arm = controller.skeleton(q)
        return SkeletonLines(q_rad=tuple(q.tolist()), exo=(points(exo),), arm=(points(arm),))

    def scene(self) -> SceneDescription | None:
        """Describe the picture of this machine with this person in it; None before there is one."""
        return self._state.scene

    def ask(self, event: Event) -> str:
        """Send a request to the guard, and return its answer. The first request starts a machine that waits."""
        state = self._state
        if state.is_waiting and event is Event.TEST:
            state.asked_s, state.is_waiting, state.warnings = self.now(), False, ()
            self._is_requested.set()
            return ""
        if event is Event.TAKE_ARM and (why := self._before_take(state)):
            return why
        number = next(self._numbers)
        return self._said(GuardRequest(number, event), number)

    def learn_in_rest(self) -> str:
        """Move the floating arm, and learn it. The motion goes on in a thread."""
        rests = self._state.rests
        return say("guard.absent") if rests is None else rests.ask()

    def stop(self) -> None:
        """Let the arm down. The guard reads the command in its next tick."""
        running = self._state.running
        if running is not None:
            with contextlib.suppress(OSError):
                running.line.send(DescentCommand(next(self._numbers)))

    def feel(self, gravity_level: float, ramp_s: float) -> str:
        """Ask the guard for a gravity level, except while the machine learns in a rest."""
        state = self._state
        if state.rests is not None and state.rests.is_active:
            return say("rest.runs")
        number = next(self._numbers)
        self._levels_asked[number] = gravity_level
        return self._felt(gravity_level, ramp_s, number)

    def _felt(self, gravity_level: float, ramp_s: float = 0.0, number: int | None = None) -> str:
        """Ask the guard for a gravity level. The request is recorded before it is sent, because a replay needs it."""
        state, number = self._state, next(self._numbers) if number is None else number
        row = None if state.watching is None else state.watching.newest
        if state.running is not None and row is not None:
            message = {"act": "level", "gravity_level": gravity_level, "ramp_s": ramp_s}
            state.running.recorder.write("/control", float(row["now"]), message)
        return self._said(FeltLevel(gravity_level, ramp_s, number), number)

    def _before_take(self, state: ProcessState) -> str:
        row = None if state.watching is None else state.watching.newest
        return "" if state.rests is None or row is None else state.rests.before_take(float(row["now"]))

    def agree(self) -> str:
        """Pass the participant's consent on to the guard, and return its answer."""
        number = next(self._numbers)
        return self._said(Consent(number), number)

    def don(self, who: DonRequest) -> str:
        """End all processes and start new ones. The other side is another machine, which is calibrated first."""
        side = who.side or self._next.side
        try:
            # The machine is made in this thread, so that the pages show the side of the next arm immediately.
            place = self._places.get(side) or self._places.setdefault(side, self._machine_of(side))
        except ExogravError as error:
            return str(error)
        self._next = self._donned(place, who.participant, who.identify_s)
        self._end()
        self._is_asked.set()
        return ""

    def lease(self, until_s: float, window_left_s: float | None) -> None:
        """Send the lease to the guard, on the common clock."""
        running = self._state.running
        if running is None or self._is_ending:
            return
        window = None if window_left_s is None else round(1e9 * (self.now() + window_left_s))
        with contextlib.suppress(OSError):
            running.line.send(LeaseCommand(round(1e9 * until_s), window, self._options.on_loss))

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Write a message to the recording, on the rig's clock."""
        state = self._state
        rig_t = None if state.watching is None else state.watching.rig_time(t)
        if state.running is None or rig_t is None or topic in NOT_RECORDED:
            return
        if topic == "/task":  # The study reads this channel.
            if not isinstance(kind := message.get("kind"), str):
                raise RecordingError("A message of /task has no kind.")
            state.running.recorder.write(topic, rig_t, {"kind": kind, "record": dict(message)})
        elif topic == "/aircraft":
            state.running.recorder.write(topic, rig_t, message)
        else:
            state.running.recorder.write("/page", rig_t, {"topic": topic, "message": dict(message)})

    def close(self) -> None:
        """Let the arm down, and end all threads."""
        self._is_closing = True
        self._end()
        self._is_asked.set()
        for thread in self._threads:
            thread.join(CLOSED_WITHIN_S)
        for place in self._places.values():
            place.close()

    def _end(self) -> None:
        self._is_ending = True
        self._is_requested.set()
        running = self._state.running
        if running is not None:
            with contextlib.suppress(OSError):
                running.stop()

    def _said(self, word: object, number: int) -> str:
        """Send a message to the guard, and return the answer with this number."""
        running = self._state.running
        if running is None or self._is_ending:
            return say("guard.absent")
        try:
            running.line.send(word)
        except OSError:
            return say("guard.ended")
        with self._answered:
            if not self._answered.wait_for(lambda: number in self._answers, ANSWER_WITHIN_S):
                return say("guard.silent")
            return self._answers.pop(number)

    def _hear(self, word: object) -> None:
        if isinstance(word, GuardReply):
            level = self._levels_asked.pop(word.number, None)
            if level is not None and not word.why:
                self._state.level_asked = level
            with self._answered:
                self._answers[word.number] = word.why
                self._answered.notify_all()

    def _live(self) -> None:
        """Calibrate the machine, then run one set of processes after another as their parent."""
        while True:
            self._is_asked.wait()
            self._is_asked.clear()
            if self._is_closing:
                return
            self._is_ending, who, before = False, self._next, self._state
            is_same = who is before.who or (who.code is not None and who.code in (before.who.code, before.keeping.code))
            self._rests_so_far = self._rests_so_far if is_same else NO_RESTS
            place = self._places[who.side]
            self._levels_asked.clear()
            self._state = state = ProcessState(who, place)
            try:
                prepared = state.place.prepare()
                state.doing = say("flight.starts")
                while not (self._is_closing or self._is_ending or state.failure):
                    state = self._state = self._flown(state, prepared)
            except ExogravError as error:
                state.failure = str(error)
            except Exception as error:  # noqa: BLE001 - the pages must say of any error that the session is lost
                state.failure = say("flight.error", error=f"{type(error).__name__}: {error}")
                traceback.print_exc()
            state.running = state.rests = None

    def _donned(self, place: SteeredMachine, participant: str | None, identify_s: float) -> RequestedParticipant:
        """Request for a person. With a file that may be used the arm is only checked, otherwise it is identified."""
        is_refuted = participant in place.people.refuted
        known = participant if participant in place.people.codes and not is_refuted else None
        return RequestedParticipant(known, participant, FROM_FILE_S if known else identify_s, place.side, is_refuted)

    def _free_path(self) -> Path:
        """Path of the next recording. Existing recordings are never overwritten."""
        paths = (self._folder / RECORDING.format(number) for number in itertools.count(1))
        return next(path for path in paths if not path.exists())

    def _flown(self, state: ProcessState, prepared: ControllerKnowledge) -> ProcessState:
        """Run the processes until they end. Return the state that follows: of a failure, or of a machine that waits."""
        flown = self._fly(state, prepared, self._free_path())
        if state.rests is not None:
            self._rests_so_far = state.rests.so_far
        state.running = state.rests = None
        if flown is None or self._is_ending:
            return state
        why = state.place.ended(flown)
        if state.is_switched_off and not why:
            late = () if state.has_begun else (say("flight.late_start", seconds=f"{BEGUN_WITHIN_S:g}"),)
            who = self._donned(state.place, state.keeping.code or state.who.code, state.who.identify_s)
            return ProcessState(who, state.place, warnings=late)
        state.failure = why or say("flight.recording_over")
        return state

    def _is_to_begin(self, state: ProcessState) -> bool:
        """Wait until an operator makes the machine ready. Return False if the session ends before."""
        if state.place.starts_on_request:
            self._is_requested.clear()
            state.is_waiting = True
            if not (self._is_ending or self._is_closing):
                self._is_requested.wait()
            state.is_waiting = False
        return not (self._is_ending or self._is_closing)

    def _fly(self, state: ProcessState, prepared: ControllerKnowledge, path: Path) -> LiveResult | None:
        options, place = self._options, state.place
        with contextlib.ExitStack() as stack:
            line, memory = order_line(len(place.description.joints), stack)
            plan = place.people.plan(state.who, prepared, place.rig(prepared), stack, place.machine_key(), memory)
            streaming = self._streaming(state, plan, stack)
            if not self._is_to_begin(state):
                return None
            said = place.recorded()
            self._controller = ArmController(
                prepared.assembly, prepared.machine, plan.prepared.x, 1e-9 * plan.period_ns
            )
            state.rests = self._rests(state, plan, line, stack)
            recorder = stack.enter_context(
                Recorder(
                    path,
                    plan.description.joints,
                    settings_of(plan, said),
                    options.session_s,
                    outlets=streaming.outlets,
                    devices=streaming.devices,
                )
            )
            state.plan, state.path = plan, path

            def started(running: Running) -> None:
                state.watching = stack.enter_context(contextlib.closing(FlightMemoryView(recorder.inlet)))
                state.begun_s, state.running = self.now(), running
                if self._is_ending:
                    running.stop()

            def progress(_phase: str, _share: float) -> None:
                if state.running is not None:
                    self._look_after(state, state.running)

            parts = parts_of(plan, is_tested=place.starts_on_request)
            return fly(parts, options.session_s, recorder, progress, started, streaming.listening, hears=self._hear)

    def _rests(
        self, state: ProcessState, plan: LivePlan, line: OrderLine, stack: contextlib.ExitStack
    ) -> FlightRests | None:
        """Prepare to learn in the rests."""
        before, controller = self._rests_so_far, self._controller
        if state.who.participant is None:
            before = replace(before, motion_s=0.0)  # The arm is identified anew, from the table.
        rests = LiveRests(plan.prepared, line, 1e-9 * plan.period_ns, before)
        if controller is None:
            return None
        store = partial(state.keeping.keep_rests, keep=partial(state.place.people.keep_rests, plan.prepared.machine))
        made = FlightRests(rests, plan.description, controller, self._felt, lambda: state.level_asked, store)
        return stack.enter_context(contextlib.closing(made))

    def _streaming(self, state: ProcessState, plan: LivePlan, stack: contextlib.ExitStack) -> Streaming:
        """Find the streams of other devices to record, before the motors are on.

        Raises:
            ConfigError: A stream is missing.
        """
        options, description = self._options, plan.description
        outlets = OutletsJob(description.name, description.joints, 1e-9 * plan.period_ns) if options.lsl else None
        if options.record_streams:
            state.doing = say("flight.streams", streams=", ".join(options.record_streams))
            state.listening = stack.enter_context(Listening(options.record_streams))
            state.doing = say("flight.starts")
        return Streaming(outlets, state.listening)

    def _look_after(self, state: ProcessState, running: Running) -> None:
        """Check recorder and worker, several times per second, in the parent's thread."""
        state.recording = running.recorder.check()
        if state.rests is not None:
            state.rests.look(running)
        if state.plan is not None:
            state.keeping.look(running.worker, running.line.send, partial(state.place.people.keep, state.plan.prepared))
        left, warnings = self._options.session_s - (self.now() - state.begun_s), []
        if left < WARNED_S:
            warnings.append(say("flight.recording_ends"))
        if running.control.restarts:
            warnings.append(say("flight.control_again"))
        if state.who.is_refuted:
            warnings.append(say("flight.refuted_file", person=state.who.code))
        learned = None if running.worker is None else running.worker.learned
        if learned is not None:
            joints = state.place.description.joints
            if why := carried_text(learned.carried, joints, learned.estimate.t):
                warnings.append(say("flight.carried_in_part", why=why))
        state.warnings = (*warnings, *state.keeping.wrong, *state.lost_streams())
        self._switch(state, running)
        if left < ENDED_S:
            running.stop()

    def _switch(self, state: ProcessState, running: Running) -> None:
        """Pass on the request that started a machine on drives, and end its run when it is switched off.

        Motors that are on without torque would let the machine fall; a drive that is off brakes.
        """
        watching = state.watching
        if not state.place.starts_on_request or watching is None or watching.newest is None:
            return
        if state.asked_s is not None and watching.mode is not Mode.OFF:
            state.asked_s, state.has_begun = None, True
        elif state.asked_s is not None and self.now() - state.begun_s < BEGUN_WITHIN_S:
            with contextlib.suppress(OSError):
                running.line.send(GuardRequest(next(self._numbers), Event.TEST))
        elif state.asked_s is not None or (state.has_begun and watching.mode is Mode.OFF):
            state.is_switched_off = True
            running.stop()

    def _watch(self) -> None:
        told = None
        while not self._is_closing:
            state = self._state
            if state.watching is not None and state.running is not None:
                state.watching.look()
                if state.watching.mode is not told:
                    told = state.watching.mode
                    with contextlib.suppress(OSError, ExogravError):
                        state.place.hear(told.name.lower())
            time.sleep(LOOKS_EVERY_S)
