"""Flights of an acceptance: identification with verification, a known weight, and stops on purpose."""

import contextlib
import os
import signal
import sys
import time
from dataclasses import dataclass, field, fields, replace
from pathlib import Path

import numpy as np

from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.live.learned_person import learned_person
from exograv.live.live_control import MODES
from exograv.live.live_processes import Running
from exograv.live.options import AcceptOptions, LiveOptions, PersonForm
from exograv.loop.keyboard import is_line_typed
from exograv.loop.pilot import Progress
from exograv.options import WornOptions
from exograv.procedures.acceptance.dummy import SHIPPED, Dummy
from exograv.procedures.acceptance.known_torque import known_left_over
from exograv.procedures.acceptance.stops import STILL_RAD_S, PurposeStop, Standing, stop_figures, stop_steps
from exograv.procedures.bring_up.bench_machine import BenchMachine, BenchSample, positions
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.procedures.self_test.motion_steps import DRIFT_MAX_DEG, HOLD_S
from exograv.procedures.verification.verification import evaluate_passes
from exograv.recording import read_recording
from exograv.rig.drives.opening import open_drives
from exograv.rig.drives.settings import Drives
from exograv.runtime.control_loop.guard_commands import ENDS
from exograv.safety.guard import SafeState
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason
from exograv.storage.machine_readiness import MachineReadiness
from exograv.storage.participant_file import write_participant
from exograv.storage.self_test_step import Step, within

from .acceptance_weighing import IdentifiedDummy, weigh_on_drives
from .connection import Say
from .float_command import FlownOnDrives, Procedure, fly_on_drives

CODE = "dummy-0"
FLOATS_S = 10.0
"""Time for which the identified dummy floats [s]."""

WAITS_S = {True: 10.0, False: 60.0}
"""Time after the motion in which a stop may still come [s], with simulated drives and with an operator."""

RAISED_S = 6.0
"""Time of motion after which a stop is caused: the dummy is then raised and moving [s]."""

WATCHED_S, REST_S = 20.0, 0.3
"""Longest time for which the machine is watched after a stop, and time without motion that ends the watch [s]."""

PUSHES_S = (0.05, 0.1, 0.2)
"""Durations of simulated pushes, each longer than the one before, until the machine stops [s]."""

READY = (
    "Nobody is in the machine. Check that the dummy lies in its cuffs and its shoulder joint on the stand. Hold the "
    "dummy's forearm at the posture in which the cuffs were fastened, press Enter, and let go when the machine carries "
    "it, after six seconds. Then stay out of its reach. "
)

OF_TORQUE = (
    "The machine carries another torque than the dummy's file says. Check the dummy's masses and places, its shoulder "
    "joint on the stand, then the torque constants in rig.toml (`exograv rig calibrate`)."
)
OF_VERIFICATION = "The motors' torque at unseen postures disagrees with the identified arm. Identify again."
SINKS = "The floating dummy drifts: friction or an encoder has changed. Calibrate again."


class AcceptanceStoppedError(RigError):
    """The operator has ended a flight that was not to be stopped."""


@dataclass
class CausedStop:
    """Stop that is caused once, when the dummy is raised and moves."""

    stop: PurposeStop
    joint: str
    """Joint of the cable and of the push."""
    push_Nm: float
    is_by_person: bool
    say: Say
    acted_s: float | None = None
    """Time of the act on CLOCK_MONOTONIC [s]; None before it, and if a person acts."""
    is_done: bool = False
    _moves_since: float | None = field(default=None, init=False)
    _hung_pid: int | None = field(default=None, init=False)

    def __call__(self, running: Running, hands: Hands) -> None:
        """Cause the stop when it is time; called several times a second."""
        if self.is_done or not self._is_time(running):
            return
        self.is_done = True
        if self.stop.name == "control":
            self.acted_s, self._hung_pid = time.monotonic(), running.control.pid
            os.kill(self._hung_pid, signal.SIGSTOP)
        elif self.is_by_person:
            self.say(self.stop.asks)
        else:
            self._simulate(running, hands)

    def release(self) -> None:
        """Let a control process that hangs end."""
        if self._hung_pid is not None:
            with contextlib.suppress(ProcessLookupError):
                os.kill(self._hung_pid, signal.SIGCONT)

    def _simulate(self, running: Running, hands: Hands) -> None:
        self.acted_s = time.monotonic()
        match self.stop.name:
            case "operator":
                running.line.send(ENDS)  # as Ctrl-C does
            case "hardware":
                hands.press_stop()
            case "cable":
                hands.pull_cable(self.joint)
            case _:
                self._push(running, hands)

    def _push(self, running: Running, hands: Hands) -> None:
        for seconds in PUSHES_S:
            if _is_stopped(running):
                return
            hands.push(self.joint, self.push_Nm)
            time.sleep(seconds)
            hands.push(self.joint, 0.0)

    def _is_time(self, running: Running) -> bool:
        answer, state = running.answers.read(), running.states.read()
        if answer is None or state is None or MODES[int(answer[1]["mode"])] is not Mode.MOVING:
            return False
        now = float(state[1]["now"])
        if self._moves_since is None:
            self._moves_since = now
        return now - self._moves_since >= RAISED_S


class Rest:
    """Test of samples that is True when no joint has moved for `REST_S`."""

    def __init__(self) -> None:
        self._since_s: float | None = None
        self._q = np.zeros(0)

    def __call__(self, seen: BenchSample) -> bool:
        """Return True if no joint has moved for `REST_S` up to this sample."""
        q = seen.state.q
        if self._since_s is None or np.abs(q - self._q).max() > STILL_RAD_S * REST_S:
            self._since_s, self._q = seen.at_s, q.copy()
        return seen.at_s - self._since_s >= REST_S


@dataclass
class StandingWatch:
    """Look at the machine after a stop, until it stands still."""

    caused: CausedStop
    waits: bool
    """True if simulated drives wait for this computer."""
    standing: Standing | None = None

    def __call__(self, drives: Drives, hands: Hands) -> None:
        """Undo the operator's part of the stop where the drives would not answer, and watch them.

        Raises:
            RigError: A drive does not answer.
        """
        caused = self.caused
        if caused.is_done and caused.stop.name == "cable":
            if caused.is_by_person:
                caused.say("Plug the bus cable in again, then press Enter.")
                while not is_line_typed(sys.stdin, 0.5):
                    pass
            else:
                hands.plug_cable(caused.joint)
        with open_drives(drives, self.waits) as rig:
            seen, _ = BenchMachine(rig, drives, self.waits).watch(WATCHED_S, Rest(), commands=False)
        on = tuple(joint for joint, status in zip(drives.joints, seen[-1].status, strict=True) if status.is_enabled)
        self.standing = Standing(np.array([one.at_s for one in seen]), positions(seen), on)
        if caused.is_done and caused.stop.name == "hardware":
            hands.release_stop()


@dataclass
class AcceptanceFlights:
    """Flights of one acceptance, each with its steps for the protocol."""

    options: AcceptOptions
    folder: Path
    readiness: MachineReadiness
    dummy: Dummy
    progress: Progress
    say: Say

    @property
    def arm_file(self) -> Path:
        """File of the identified dummy, from which the later flights start."""
        return self.folder / "acceptance" / "dummy_arm.toml"

    @property
    def simulation(self) -> tuple[str, ...]:
        """Options of the simulated drives."""
        return "--worn", "--dummy", str(self.options.simulated_dummy or self.options.dummy or SHIPPED)

    def identified(self) -> list[Step]:
        """Identify the dummy, compare it with its file, verify it, and let it float."""
        run = self._fly("identify", MOTION_S, FLOATS_S, Procedure("rig accept", is_verified=True))
        learned, passed, asked = run.flown.learned, run.flown.passed, run.verification
        if learned is None or passed is None or asked is None:
            raise RigError(f"The identification did not come to its end; {_ending(run)}")
        joints, model = run.prepared.assembly.description.joints, ArmModel(run.prepared.assembly, run.prepared.machine)
        predicted = run.flown.predicted
        whole = None
        if predicted is not None:
            whole = learned_person(CODE, run.body, run.prepared, run.serial, learned, predicted, None)
        if whole is not None:
            write_participant(self.arm_file, whole)
        steps = [
            Step("identification", whole is not None, learned.outcome.value, "a still arm", "",
                 "" if whole is not None else "The dummy was not at rest, or moved too little. Look for a loose part.")
        ]  # fmt: skip
        known = known_left_over(model, learned.carried.x, self.dummy, asked.postures)
        for joint, value, limit in zip(joints, known.rms, known.limits, strict=True):
            name = f"{joint}: left over against the known dummy"
            steps.append(within(name, float(value), round(float(limit), 3), "N·m", OF_TORQUE))
        verified = evaluate_passes(model, learned.floated, asked.postures, passed.heard, passed.seconds, self.progress)
        for joint, value, target in zip(joints, verified.rms[0], verified.targets, strict=True):
            name = f"{joint}: left over by verification"
            steps.append(within(name, float(value), float(target), "N·m", OF_VERIFICATION))
        return [*steps, self._drift(run.flown.path)]

    def weighed(self) -> list[Step]:
        """Weigh the known weight on the dummy's hook, and carry it."""
        identified = IdentifiedDummy(self.dummy, self.arm_file, self.simulation, READY)
        return weigh_on_drives(self.options, self.readiness, identified, self.progress, self.say)

    def stopped(self, stop: PurposeStop) -> list[Step]:
        """Fly the identified dummy, and cause a stop."""
        description = self.readiness.description
        joint = description.joints[-1]
        is_by_person = bool(stop.asks) and not self.options.simulate
        caused = CausedStop(stop, joint, float(description.per_actuator("torque_max_Nm")[-1]), is_by_person, self.say)
        watch = StandingWatch(caused, self.options.waits)
        procedure = Procedure(
            "rig accept",
            files=ParticipantOptions(participant=self.arm_file),
            acts=caused,
            afterwards=watch,
            on_purpose=stop.causes,
        )
        try:
            run = self._fly(stop.name, FROM_FILE_S, WAITS_S[self.options.simulate], procedure)
        finally:
            caused.release()
        latches = run.flown.report.latches
        if not caused.is_done and any(latch.cause == StopReason.STOP_PRESSED.value for latch in latches):
            raise AcceptanceStoppedError("The operator has stopped the flight before it was asked for.")
        if not caused.is_done or watch.standing is None:
            raise RigError(f"The flight ended before the stop; {_ending(run)}")
        cause = latches[0].cause if latches else ""
        ticks = read_recording(run.flown.path).ticks
        brake = np.array([drive.brake_Nms_per_rad for drive in self.readiness.drives.each])
        figures = stop_figures(stop.name, ticks, watch.standing, run.prepared.assembly, brake, caused.acted_s)
        return stop_steps(stop, figures, cause, self.readiness.drives.period_s, is_by_person)

    def _fly(self, name: str, moved_s: float, floats_s: float, procedure: Procedure) -> FlownOnDrives:
        worn = {one.name: getattr(self.options, one.name) for one in fields(WornOptions)}
        live = LiveOptions(**worn, seconds=floats_s, identify_s=moved_s)
        procedure = replace(
            procedure,
            form=self.dummy.form_for(self.readiness.description),
            simulation=self.simulation,
            recording_in=self.folder / "acceptance" / name,
            ready=READY,
        )
        (self.folder / "acceptance" / name).mkdir(parents=True, exist_ok=True)
        run = fly_on_drives(live, PersonForm(), self.folder, self.progress, self.say, None, procedure)
        pressed = any(latch.cause == StopReason.STOP_PRESSED.value for latch in run.flown.report.latches)
        if pressed and StopReason.STOP_PRESSED not in procedure.on_purpose:
            raise AcceptanceStoppedError("The operator has stopped the flight.")
        return run

    def _drift(self, recording: Path) -> Step:
        """Return the largest motion of a joint within `HOLD_S` while the dummy floated."""
        ticks = read_recording(recording).phase_ticks(Mode.FLOATING.name.lower())
        t, q = ticks["now"], ticks["q_measured"]
        # The drive fades for a second at the begin, and the tick of the stop is none of floating.
        free = (ticks["drive"] == 0.0) & (ticks["safe_state"] <= SafeState.NONE + 1)
        t, q = t[free], q[free]
        ahead = np.searchsorted(t, t + HOLD_S)
        pairs = ahead < len(t)
        way = np.abs(q[ahead[pairs]] - q[pairs]) if pairs.any() else np.full((1, 1), np.inf)
        return within(
            "drift while the dummy floats", float(np.rad2deg(way.max())), DRIFT_MAX_DEG, f"° in {HOLD_S:g} s", SINKS
        )


def _is_stopped(running: Running) -> bool:
    state = running.states.read()
    return state is not None and int(state[1]["safe_state"]) >= SafeState.DESCENT


def _ending(run: FlownOnDrives) -> str:
    latches = run.flown.report.latches
    why = f"it stopped after {latches[0].at_s:.1f} s: {latches[0].cause}" if latches else "it was not stopped."
    return f"{why} Recording: {run.flown.path}."
