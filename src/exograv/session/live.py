"""`exograv live`: the arm floats in real time, guard, control and recorder in processes of their own, on the twin."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from exograv import __version__
from exograv.control.observer import Observer
from exograv.errors import ConfigError
from exograv.model.description import Side
from exograv.rig.twin import Twin
from exograv.runtime.live import GuardedRig
from exograv.runtime.recorder import Recorder
from exograv.runtime.timing import PERIOD_NS, Timing
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard, SafeState
from exograv.safety.modes import Event, Mode, ModeMachine
from exograv.safety.person import Person, PersonLimits
from exograv.signals import Reference

from .arm_controller import ArmController
from .live_processes import Flown, Parts, Running, fly
from .person_limits import person_limits
from .pilot import CLOSURE_SLOPE_MAX, Progress
from .prepare import Prepared, prepare
from .virtual import VirtualLaboratory, draw_laboratory, limits, refuse_motorless

STALL_BEFORE_S = 0.05
"""A latch is put down to the longest gap so long before it."""

REST_BEFORE_RAMP_S = 1.0


@dataclass(frozen=True)
class LiveOptions:
    """What `exograv live` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    seconds: float = 10.0
    gravity_level: float = 0.0

    def __post_init__(self):
        if not 1.0 <= self.seconds <= 7200.0:
            raise ConfigError(f"--seconds is {self.seconds:g}; allowed: 1 to 7200.")
        if not 0.0 <= self.gravity_level <= 1.0:
            raise ConfigError(
                f"--gravity-level is {self.gravity_level:g}; allowed: 0 (weightless) to 1 (Earth). Above 1 the arm is "
                "pushed down: a mode of its own, later."
            )
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not sys.platform.startswith("linux"):
            raise ConfigError(f"exograv live needs Linux, and this is {sys.platform}.")


@dataclass(frozen=True)
class Plan:
    """What each process builds its part from."""

    laboratory: VirtualLaboratory
    prepared: Prepared
    person: PersonLimits
    seed: int
    gravity_level: float


def guarded_rig(plan: Plan) -> GuardedRig:
    """The twin, held in its donning posture, and the guard in front of it."""
    laboratory, prepared = plan.laboratory, plan.prepared
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, plan.seed, t0=prepared.t)
    envelope = Envelope(limits(laboratory.description), twin.period_s)
    envelope.person = Person(plan.person, plan.gravity_level)
    state = twin.read()
    gain = prepared.machine.actuators
    envelope.begin(gain.torque(state.current))
    guard = Guard.of_machine(envelope, twin.period_s, gain.gain.tolist())
    return GuardedRig(twin, guard, gain.gain, CLOSURE_SLOPE_MAX)


MODES = tuple(Mode)


class LiveControl:
    """`Answering`: the arm's controller, and the mode that says how much of the arm is carried."""

    mode_names = tuple(mode.name.lower() for mode in MODES)

    def __init__(self, plan: Plan, is_first: bool = True):
        """The arm is held from the first tick on, as the twin begins; one that comes later finds it let down."""
        prepared, period_s = plan.prepared, 1e-9 * PERIOD_NS
        self._controller = ArmController(prepared.assembly, prepared.machine, prepared.x, period_s)
        self._controller.mode.gravity_level = plan.gravity_level
        self._observer = Observer(prepared.assembly.n, period_s)
        self._still, self._period_s = np.zeros(prepared.assembly.n), period_s
        self._modes = ModeMachine(Mode.FLOATING, 1.0) if is_first else ModeMachine(Mode.SAFE)
        self._rested_s = 0.0
        self._q_ramp = self._still
        # The first step finds the loops' posture from cold, which takes longer than a tick.
        self._controller.step(plan.laboratory.description.donning_posture, self._still, self._hold(self._still))
        self._controller = self._controller.again(prepared.x)
        self._controller.mode.gravity_level = plan.gravity_level

    def answer(self, state: np.void, row: np.ndarray) -> None:
        """One tick."""
        self._observer.update(state["q"])
        q, v = self._observer.q, self._observer.v
        self._follow(SafeState(int(state["safe_state"])), q, v)
        self._controller.mode.arm_share = self._modes.arm_share
        row["tau"] = self._controller.step(q, v, self._hold(q))
        row["tau_feedforward"], row["v"] = self._controller.tau_feedforward, v
        row["slope"], row["mode"] = self._controller.closure_slope, MODES.index(self._modes.mode)

    def _hold(self, q: np.ndarray) -> Reference:
        return Reference(q, self._still, self._still)

    def _follow(self, safe_state: SafeState, q: np.ndarray, v: np.ndarray) -> None:
        """What the guard says decides; after its reset the arm is taken again by a ramp."""
        modes = self._modes
        if safe_state >= SafeState.DESCENT:
            modes.take(Event.FAULT)
            self._rested_s = 0.0
            return
        if modes.mode is Mode.SAFE:
            for event in (Event.RESET, Event.TEST, Event.PASSED):
                modes.take(event)
        if modes.mode is Mode.EXO_ONLY:
            self._rested_s += self._period_s
            if self._rested_s >= REST_BEFORE_RAMP_S:
                self._rested_s, self._q_ramp = 0.0, q.copy()
                modes.take(Event.TAKE_ARM)
        modes.step(self._period_s, float(np.abs(q - self._q_ramp).max()), float(np.abs(v).max()))


def run_live(
    options: LiveOptions, folder: Path, progress: Progress, started: Callable[[Running], object] = lambda *_: None
) -> dict[str, Any]:
    """Calibrate and identify in lock-step, then float the arm live; the result follows the contract of the command.

    Args:
        options: What is asked for.
        folder: Of the recording.
        progress: Told now and then.
        started: Told what runs when the loop begins.

    Raises:
        ConfigError: An option cannot be used.
        RigError: A process died before the loop began, or the guard in it.
        RecordingError: There is no room for the recording.
    """
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    refuse_motorless(laboratory.description)
    prepared = prepare(laboratory, options.seed, progress)
    limits_of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    plan = Plan(laboratory, prepared, limits_of_person, options.seed, options.gravity_level)
    settings = {"disturbance_level": options.level}
    return _figures(options, fly_plan(plan, options.seconds, folder, settings, progress, started))


def fly_plan(
    plan: Plan,
    seconds: float,
    folder: Path,
    settings: Mapping[str, Any],
    progress: Progress,
    started: Callable[[Running], object],
) -> Flown:
    """Float the arm live, who is known already; as `run_live`."""
    description = plan.laboratory.description
    settings = {
        **settings,
        "rig": description.name,
        "command": "live",
        "seed": plan.seed,
        "gravity_level": plan.gravity_level,
        "versions": {"exograv": __version__},
    }
    parts = Parts(
        partial(guarded_rig, plan),
        partial(LiveControl, plan),
        partial(LiveControl, plan, is_first=False),
        LiveControl.mode_names,
    )
    with Recorder(folder / "live.mcap", description.joints, settings, seconds) as recorder:
        return fly(parts, seconds, recorder, progress, started)


def _figures(options: LiveOptions, flown: Flown) -> dict[str, Any]:
    report, recording, timing = flown.report, flown.recording, flown.report.timing
    p50, p99, p999 = (1e-3 * np.percentile(timing.lateness_ns, [50, 99, 99.9])).round(1).tolist()
    return {
        "rig": options.rig,
        "seconds": round(timing.seconds, 3),
        "outcome": timing.outcome.value,
        "rate_Hz": round(timing.effective_rate_Hz, 3),
        "late_us": {"p50": p50, "p99": p99, "p999": p999, "max": round(1e-3 * float(timing.lateness_ns.max()), 1)},
        "overruns": timing.missed,
        "unanswered": report.unanswered,
        "ticks": len(timing.period),
        "samples_recorded": recording.acknowledged,
        "samples_lost": recording.lost,
        "recording_ok": recording.recording_ok,
        "recorder_restarts": recording.restarts,
        "control_restarts": flown.control_restarts,
        "recording": str(flown.path),
        "granted": report.rights.granted,
        "refused": report.rights.refused,
        "latches": [
            {"cause": latch.cause, "at_s": round(latch.at_s, 3), "stall_ms": round(stall_ms(timing, latch.period), 3)}
            for latch in report.latches
        ],
        "wall_s": round(flown.wall_s, 2),
    }


def stall_ms(timing: Timing, period: int) -> float:
    """The longest time without a command shortly before a period: what the computer was not there for."""
    commands = 1e-6 * (timing.period * timing.period_ns + timing.command_ns)
    ended = timing.period <= period + 1
    begun = timing.period >= period - STALL_BEFORE_S * 1e9 / timing.period_ns
    return float(np.diff(commands[ended & begun]).max(initial=0.0))
