"""`exograv live`: the arm floats in real time, guard, control and recorder in processes of their own, on the twin."""

import contextlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError, RigError
from exograv.laboratory.preparation import Prepared, prepare, prepare_machine
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, draw_laboratory, refuse_motorless
from exograv.live.live_control import SKIPPED, LiveControl, Plan, guarded_rig, notes
from exograv.live.live_figures import flown_figures, learned_figures
from exograv.live.live_identification import LessonPlan, unknown_person
from exograv.live.live_processes import Flown, Parts, Running, fly
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import versions, written_person, written_rig, written_told
from exograv.model.description import Side
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.verification.postures import Verification
from exograv.recording.disk import refuse_small_disk
from exograv.rig.twin.twin import PERIOD
from exograv.runtime.control_loop.worker import WorkerJob, WorkerMemory
from exograv.runtime.lsl.library import require_lsl
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.ros2.bridging import Bridging, Ros2
from exograv.runtime.ros2.streaming import NO_STREAMING, Streaming

LESSON_S = (10.0, 600.0)
"""Of motion, at least and at most [s]."""

AROUND_LESSON_S = 16.0
"""Rest, ramp, the way to the motion's beginning, and what the worker takes at its end [s]."""


@dataclass(frozen=True)
class LiveOptions:
    """What `exograv live` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    seconds: float = 10.0
    identify_s: float = 0.0
    """Of motion in which the arm is learned live, before all else; 0 learns it in lock-step before the loop [s]."""
    gravity_level: float = 0.0
    self_test: bool = False
    """Whether the empty twin is tested before; no wearer of it could come to harm without."""
    lsl: bool = False
    """Whether joint state, torque and markers are published."""
    record_streams: tuple[str, ...] = ()
    """Names or types of streams of other devices that are recorded besides."""
    ros2: Ros2 | None = None
    """The bridge to ROS 2, if there is to be one."""

    def __post_init__(self):
        if not 1.0 <= self.seconds <= 7200.0:
            raise ConfigError(f"--seconds is {self.seconds:g}; allowed: 1 to 7200.")
        if self.identify_s and not LESSON_S[0] <= self.identify_s <= LESSON_S[1]:
            raise ConfigError(
                f"--identify is {self.identify_s:g}; allowed: {LESSON_S[0]:g} to {LESSON_S[1]:g}, or 0 to identify "
                "the arm before the live run."
            )
        if self.identify_s and self.gravity_level:
            raise ConfigError(
                f"--gravity-level is {self.gravity_level:g}; with --identify allowed: 0, because an arm is learned "
                "while all of its weight is carried. Leave out one of the two."
            )
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

    @property
    def loop_s(self) -> float:
        """How long the loop runs [s]."""
        return self.seconds + (self.identify_s + AROUND_LESSON_S if self.identify_s else 0.0)


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
        RigError: A process died before the loop began, or the guard in it; or the self-test has failed.
        RecordingError: There is no room for the recording.
    """
    if options.lsl:
        require_lsl()
    with contextlib.ExitStack() as stack:
        listening = stack.enter_context(Listening(options.record_streams)) if options.record_streams else None
        return _run(options, folder, progress, started, listening)


def _run(
    options: LiveOptions,
    folder: Path,
    progress: Progress,
    started: Callable[[Running], object],
    listening: Listening | None,
) -> dict[str, Any]:
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    refuse_motorless(laboratory.description)
    refuse_small_disk(folder / "live.mcap", len(laboratory.description.joints), options.loop_s)
    prepare_all = prepare_machine if options.identify_s else prepare
    prepared = prepare_all(laboratory, options.seed, progress)
    self_test = _tested(laboratory, prepared, options.seed, progress) if options.self_test else SKIPPED
    said = {"disturbance_level": options.level, "seed": options.seed, "settings": {"options": asdict(options)}}
    with contextlib.ExitStack() as stack:
        plan, seconds = _plan(options, laboratory, prepared, progress, stack)
        description = laboratory.description
        outlets = OutletsJob(description.name, description.joints, PERIOD) if options.lsl else None
        ros2 = None if options.ros2 is None else Bridging(options.ros2, description.joints)
        lsl = Streaming(outlets, listening, ros2)
        flown = fly_plan(plan, seconds, folder, said, progress, started, options.self_test, lsl)
    streams = [] if listening is None else listening.figures()
    told = {"self_test": self_test, "streams": streams, "ros2": None if ros2 is None else ros2.figures()}
    return flown_figures(options.rig, flown) | told | learned_figures(flown, laboratory, prepared)


def _plan(
    options: LiveOptions,
    laboratory: VirtualLaboratory,
    prepared: Prepared,
    progress: Progress,
    stack: contextlib.ExitStack,
) -> tuple[Plan, float]:
    """And how long it takes [s]."""
    assembly, machine = prepared.assembly, prepared.machine
    if not options.identify_s:
        person = person_limits(assembly, machine, prepared.x)
        plan = Plan.of_twin(laboratory, prepared, person, options.seed, options.gravity_level)
        return plan, options.loop_s
    progress("Preparing for anybody's arm", 0.0)
    person = unknown_person(assembly, machine)
    lesson = lesson_plan(prepared, options.identify_s, PERIOD, stack)
    plan = Plan.of_twin(laboratory, prepared, person, options.seed, 0.0, lesson)
    return plan, options.loop_s


def lesson_plan(
    prepared: Prepared,
    seconds: float,
    period_s: float,
    stack: contextlib.ExitStack,
    verification: Verification | None = None,
    passes_s: float = 0.0,
    belief: Belief | None = None,
) -> LessonPlan:
    """How an arm is learned by so much motion, and verified by so much [s]; its memory is there as long as `stack`.

    It begins with a belief of another day, if there is one.
    """
    moved_s = seconds + AROUND_LESSON_S + passes_s
    size = WorkerMemory(prepared.assembly.n, len(prepared.x), round(2 * moved_s / period_s))
    samples = stack.enter_context(contextlib.closing(size.sample_ring()))
    findings = stack.enter_context(contextlib.closing(size.finding_ring()))
    memory = replace(size, samples=samples.name, findings=findings.name)
    return LessonPlan(prepared.assembly, prepared.machine, seconds, period_s, memory, verification, belief)


def fly_plan(
    plan: Plan,
    seconds: float,
    folder: Path,
    said: Mapping[str, Any],
    progress: Progress,
    started: Callable[[Running], object],
    is_tested: bool = False,
    lsl: Streaming = NO_STREAMING,
) -> Flown:
    """Float the arm live, who is known already; as `run_live`."""
    path, joints = folder / "live.mcap", plan.description.joints
    settings = settings_of(plan, said)
    with Recorder(path, joints, settings, seconds, outlets=lsl.outlets, devices=lsl.devices) as recorder:
        return fly(parts_of(plan, is_tested), seconds, recorder, progress, started, lsl.listening, lsl.ros2)


def parts_of(plan: Plan, is_tested: bool) -> Parts:
    """What the processes of a flight build in themselves."""
    lesson, period_s = plan.lesson, 1e-9 * plan.period_ns
    control = partial(
        LiveControl, plan.prepared, plan.gravity_level, lesson=lesson, period_s=period_s, is_steered=plan.is_steered
    )
    return Parts(
        partial(guarded_rig, plan),
        control,
        partial(control, is_first=False),
        LiveControl.mode_names,
        notes(is_tested),
        None if lesson is None else WorkerJob(lesson.worker, lesson.memory),
        plan.period_ns,
        plan.is_steered,
    )


def settings_of(plan: Plan, said: Mapping[str, Any]) -> dict[str, Any]:
    """What the recording says of the run, for `exograv replay` too."""
    description, prepared = plan.description, plan.prepared
    return {
        **said,
        "rig": description.name,
        "title": description.settings.title,
        "side": description.side,
        "command": "exograv live",
        "gravity_level": plan.gravity_level,
        "hashes": {"rig": description.sha256},
        "versions": versions(),
        "settings": {
            **said.get("settings", {}),
            "rig_files": written_rig(description),
            "told": written_told(plan.told.body, plan.told.lengths),
            "live": {
                "period_s": 1e-9 * plan.period_ns,
                "machine": asdict(prepared.machine),
                "x": prepared.x,
                "person": written_person(plan.person),
                **({"is_steered": True} if plan.is_steered else {}),
                **({} if plan.lesson is None else _written_lesson(plan.lesson)),
            },
        },
    }


def _written_lesson(lesson: LessonPlan) -> dict[str, Any]:
    said: dict[str, Any] = {"identify_s": lesson.seconds}
    if (asked := lesson.verification) is not None:
        said["verification"] = {"postures": asked.postures.tolist(), "seed": asked.seed}
    return said


def _tested(laboratory: VirtualLaboratory, prepared: Prepared, seed: int, progress: Progress) -> str:
    """The self-test of the machine without its wearer.

    Raises:
        RigError: It has not passed.
    """
    from exograv.procedures.self_test.unworn import test_machine

    from .self_testing import virtual_subject

    if prepared.calibration is None:
        raise RigError("The machine was not calibrated, so there is nothing to test it by. Calibrate it first.")
    lengths = laboratory.wearer.lengths_given
    subject = virtual_subject(laboratory.description, laboratory.machine, prepared.calibration, lengths, seed)
    steps, busy_s = test_machine(subject, progress)
    for step in steps:
        if not step.passed:
            raise RigError(f"The self-test has failed ({step.name}). {step.what_to_do}")
    return f"passed: {len(steps)} steps, {busy_s:.0f} s of the machine"
