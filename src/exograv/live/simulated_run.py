"""Live run on a simulated machine (`exograv run live`): the arm floats in real time, each part in its own process."""

import contextlib
from collections.abc import Callable
from pathlib import Path

from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.person_limits import person_limits
from exograv.loop.pilot import Progress
from exograv.model.description import load_rig
from exograv.procedures.identification.live_machine import LiveMachine
from exograv.recording.disk import refuse_small_disk
from exograv.runtime.lsl.library import require_lsl
from exograv.runtime.lsl.listening import Listening

from .live_control import SKIPPED, LivePlan
from .live_figures import LiveFigures, live_figures
from .live_flight import fly_plan, lesson_plan, streaming_of
from .live_identification import unknown_person
from .live_processes import Running
from .options import LiveOptions


def run_live_simulated(
    options: LiveOptions,
    prepare: Callable[[], LiveMachine],
    folder: Path,
    progress: Progress,
    started: Callable[[Running], object] = lambda *_: None,
) -> LiveFigures:
    """Prepare the machine in lock-step, then float the arm live.

    Args:
        options: Options of the command.
        prepare: Function that calibrates the machine, and identifies the arm unless that is done live.
        folder: Folder of the recording.
        progress: Function that shows the progress.
        started: Function that is called with the running processes when the loop begins.

    Raises:
        ConfigError: An option cannot be used.
        RigError: A process died before the loop began, the guard died during the loop, or the self-test failed.
        RecordingError: There is no room for the recording.
    """
    if options.lsl:
        require_lsl()
    with contextlib.ExitStack() as stack:
        listening = stack.enter_context(Listening(options.record_streams)) if options.record_streams else None
        description = load_rig(options.rig, options.side)
        refuse_motorless(description)
        path = folder / "live.mcap"
        refuse_small_disk(path, len(description.joints), options.loop_s)
        machine = prepare()
        said = {
            "disturbance_level": options.level, "world": options.world, "seed": options.seed,
            "settings": {"options": options.recorded()},
        }  # fmt: skip
        plan = _plan(options, machine, progress, stack)
        lsl = streaming_of(options, description, machine.period_s, listening)
        flown = fly_plan(plan, options.loop_s, path, said, progress, started, machine.self_test is not None, lsl)
    tested = machine.self_test or SKIPPED
    return live_figures(options.rig, flown, machine.wearer, machine.known, tested, lsl, listening)


def _plan(options: LiveOptions, machine: LiveMachine, progress: Progress, stack: contextlib.ExitStack) -> LivePlan:
    known = machine.known
    description, lesson, level = known.assembly.description, None, options.gravity_level
    if not options.identify_s:
        person = person_limits(known.assembly, known.machine, known.x)
    else:
        progress("Computing limits for an unknown arm", 0.0)
        person, level = unknown_person(known.assembly, known.machine), 0.0
        lesson = lesson_plan(known, options.identify_s, machine.period_s, stack)
    return LivePlan(description, machine.form, known, person, level, machine.connect, lesson=lesson)
