"""Live run of guard, control and worker: its streams, its plan, and its settings in the recording."""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

from exograv.loop.pilot import Progress
from exograv.loop.replay_log import ToldPerson, versions, written_person, written_rig
from exograv.model.description import RigDescription
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import Belief
from exograv.procedures.verification.postures import Verification
from exograv.results import json_value
from exograv.runtime.control_loop.worker import WorkerJob, WorkerMemory
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.ros2.bridging import Bridging
from exograv.runtime.ros2.streaming import NO_STREAMING, Streaming

from .live_control import LiveControl, LivePlan, guarded_rig, notes
from .live_identification import LiveIdentificationPlan
from .live_processes import LiveResult, ProcessParts, Running, fly
from .options import AROUND_MOTION_S, LiveOptions


def streaming_of(
    options: LiveOptions, description: RigDescription, period_s: float, listening: Listening | None
) -> Streaming:
    """Streams of a live run: published streams, and streams of other devices to record."""
    outlets = OutletsJob(description.name, description.joints, period_s) if options.lsl else None
    ros2 = None if (bridge := options.bridge) is None else Bridging(bridge, description.joints)
    return Streaming(outlets, listening, ros2)


def lesson_plan(
    prepared: ControllerKnowledge,
    seconds: float,
    period_s: float,
    stack: contextlib.ExitStack,
    verification: Verification | None = None,
    passes_s: float = 0.0,
    belief: Belief | None = None,
    body_mass_kg: float | None = None,
) -> LiveIdentificationPlan:
    """Plan the live identification from `seconds` of motion, and a verification of `passes_s` [s].

    The shared memory lives as long as `stack`. The estimate begins with a belief of an earlier day, if there is one;
    otherwise the arm is compared with the form's body mass.
    """
    moved_s = seconds + AROUND_MOTION_S + passes_s
    size = WorkerMemory(prepared.assembly.n, len(prepared.x), round(2 * moved_s / period_s))
    samples = stack.enter_context(contextlib.closing(size.sample_ring()))
    findings = stack.enter_context(contextlib.closing(size.finding_ring()))
    memory = replace(size, samples=samples.name, findings=findings.name)
    return LiveIdentificationPlan(
        prepared.assembly, prepared.machine, seconds, period_s, memory, verification, belief, body_mass_kg
    )


def fly_plan(
    plan: LivePlan,
    seconds: float,
    path: Path,
    said: Mapping[str, Any],
    progress: Progress,
    started: Callable[[Running], object],
    is_tested: bool = False,
    lsl: Streaming = NO_STREAMING,
) -> LiveResult:
    """Run the plan live and record it at `path`; see `fly`."""
    joints = plan.description.joints
    settings = settings_of(plan, said)
    with Recorder(path, joints, settings, seconds, outlets=lsl.outlets, devices=lsl.devices) as recorder:
        return fly(parts_of(plan, is_tested), seconds, recorder, progress, started, lsl.listening, lsl.ros2)


def parts_of(plan: LivePlan, is_tested: bool) -> ProcessParts:
    """Parts that the processes of a live run build in themselves."""
    lesson, period_s = plan.lesson, 1e-9 * plan.period_ns
    control = partial(
        LiveControl,
        plan.prepared,
        plan.gravity_level,
        lesson=lesson,
        period_s=period_s,
        is_steered=plan.is_steered,
        orders=plan.orders,
    )
    return ProcessParts(
        partial(guarded_rig, plan),
        control,
        partial(control, is_first=False),
        LiveControl.mode_names,
        notes(is_tested),
        None if lesson is None else WorkerJob(lesson.worker, lesson.memory),
        plan.period_ns,
        plan.is_steered,
    )


def settings_of(plan: LivePlan, said: Mapping[str, Any]) -> Mapping[str, object]:
    """Return the settings of the run for its recording, which `exograv data replay` reads."""
    description, prepared = plan.description, plan.prepared
    return {
        **said,
        "rig": description.name,
        "title": description.settings.title,
        "side": description.side,
        "command": "exograv run live",
        "gravity_level": plan.gravity_level,
        "hashes": {**said.get("hashes", {}), "rig": description.sha256},
        "versions": versions(),
        "settings": {
            **said.get("settings", {}),
            "rig_files": written_rig(description),
            "told": json_value(ToldPerson(plan.told.body, plan.told.lengths)),
            "live": {
                "period_s": 1e-9 * plan.period_ns,
                "machine": asdict(prepared.machine),
                "x": prepared.x,
                "person": written_person(plan.person),
                "publishes_later": True,
                **({"is_steered": True} if plan.is_steered else {}),
                **({} if (taught := plan.taught) is None else {"taught": asdict(taught)}),
                **({} if (leading := plan.leading) is None else {"leading": leading}),
                **({} if plan.lesson is None else _written_lesson(plan.lesson)),
            },
        },
    }


def _written_lesson(lesson: LiveIdentificationPlan) -> dict[str, Any]:
    said: dict[str, Any] = {"identify_s": lesson.seconds}
    if (asked := lesson.verification) is not None:
        said["verification"] = {"postures": asked.postures.tolist(), "seed": asked.seed}
    return said
