"""`exograv live`: the arm floats in real time, guard, control and recorder in processes of their own, on the twin."""

import contextlib
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from exograv.errors import RigError
from exograv.laboratory.cooperative_wearer import held_machine
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.truth_score import ScoredWearer
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, driven_laboratory
from exograv.live.live_control import SKIPPED, LivePlan
from exograv.live.live_figures import flown_figures, learned_figures
from exograv.live.live_flight import LiveOptions, fly_plan, lesson_plan
from exograv.live.live_identification import unknown_person
from exograv.live.live_processes import Running
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.recording.disk import refuse_small_disk
from exograv.rig.twin.twin import PERIOD
from exograv.runtime.lsl.library import require_lsl
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.ros2.bridging import Bridging
from exograv.runtime.ros2.streaming import Streaming


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
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed)
    refuse_small_disk(folder / "live.mcap", len(laboratory.description.joints), options.loop_s)
    preparation = Preparation(laboratory, options.seed, progress)
    prepared = preparation.calibrated() if options.identify_s else preparation.identified()
    self_test = _tested(preparation, prepared, progress) if options.self_test else SKIPPED
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
    return flown_figures(options.rig, flown) | told | learned_figures(flown, ScoredWearer(laboratory), prepared)


def _plan(
    options: LiveOptions,
    laboratory: VirtualLaboratory,
    prepared: ControllerKnowledge,
    progress: Progress,
    stack: contextlib.ExitStack,
) -> tuple[LivePlan, float]:
    """And how long it takes [s]."""
    assembly, machine = prepared.assembly, prepared.machine
    if not options.identify_s:
        person = person_limits(assembly, machine, prepared.x)
        plan = LivePlan(
            laboratory.description,
            laboratory.form,
            prepared,
            person,
            options.gravity_level,
            held_machine(laboratory, options.seed, prepared.t),
        )
        return plan, options.loop_s
    progress("Preparing for anybody's arm", 0.0)
    person = unknown_person(assembly, machine)
    lesson = lesson_plan(prepared, options.identify_s, PERIOD, stack)
    plan = LivePlan(
        laboratory.description,
        laboratory.form,
        prepared,
        person,
        0.0,
        held_machine(laboratory, options.seed, prepared.t),
        lesson=lesson,
    )
    return plan, options.loop_s


def _tested(preparation: Preparation, prepared: ControllerKnowledge, progress: Progress) -> str:
    """Self-test the machine without its wearer.

    Raises:
        RigError: It has not passed.
    """
    from exograv.procedures.self_test.unworn import test_machine

    steps, busy_s = test_machine(preparation.under_test(prepared), progress)
    for step in steps:
        if not step.passed:
            raise RigError(f"The self-test has failed ({step.name}). {step.what_to_do}")
    return f"passed: {len(steps)} steps, {busy_s:.0f} s of the machine"
