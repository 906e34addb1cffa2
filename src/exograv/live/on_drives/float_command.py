"""Live run on drives (`exograv run live --drives`): the machine learns the wearer's arm live, then the arm floats."""

import contextlib
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.live.live_control import LivePlan
from exograv.live.live_figures import LiveFigures, live_figures
from exograv.live.live_flight import fly_plan, lesson_plan, streaming_of
from exograv.live.live_identification import lesson_passes, unknown_person
from exograv.live.live_processes import LiveResult
from exograv.live.options import LiveOptions, PersonForm
from exograv.loop.keyboard import is_line_typed
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.pilot import Progress
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.verification.postures import Verification, unseen_postures
from exograv.recording.disk import refuse_small_disk
from exograv.rig.drives.opening import open_drives
from exograv.runtime.lsl.listening import Listening

from .connection import CONNECTING, Say, drawn_by, drives_with_hands, not_ready, readiness_of
from .fault_lock import lock_after_fault
from .wearer_form import form_of_wearer

SEEN_EVERY_S = 0.05
"""Sampling period of the identification motion, to find postures that the motion has not visited [s]."""

READY = (
    "Check that the arm lies in its cuffs, supported and relaxed. Then press Enter: the motors switch on, carry the "
    "machine for a second, then take the arm. Ctrl-C lowers the arm softly at any time."
)


@dataclass(frozen=True)
class FlownOnDrives:
    """Result of a live run on drives, with the knowledge of the controller."""

    flown: LiveResult
    figures: LiveFigures
    prepared: ControllerKnowledge
    wearer: SimulatedWearer | None
    """Simulated wearer; None if machine and person are real."""
    verification: Verification | None
    """Verification that followed the identification; None without one."""


def fly_on_drives(
    options: LiveOptions,
    person: PersonForm,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
    is_verified: bool = False,
) -> FlownOnDrives:
    """Learn the arm live, verify it if `is_verified`, and let it float.

    Raises:
        ConfigError: An option or a file cannot be used.
        ModelError: The task workspace has no room for a verification's postures.
        RigError: The machine is locked, a drive does not answer, or a process died before the loop began.
        RecordingError: There is no room for the recording.
    """
    if not options.identify_s:
        raise ConfigError(
            "--identify is 0: the arm of a wearer in a machine on drives is learned live. Give --identify 60, or at "
            "least 10."
        )
    description = load_rig(options.rig, options.side)
    refuse_motorless(description)
    told = form_of_wearer(description, person, options.simulate, wearer)
    refuse_small_disk(folder / "live.mcap", len(description.joints), options.loop_s)
    progress(CONNECTING, 0.0)
    with contextlib.ExitStack() as stack:
        refuse = not_ready(options, folder, description, "run live", say)
        worn = drives_with_hands(options, description, say, "A live run", ("--worn",), True, refuse)
        drives, _ = stack.enter_context(worn)
        readiness = readiness_of(options, folder, description, drives)
        serial, period_s = readiness.serial, drives.period_s
        known, key = readiness.calibration().whole, readiness.key
        assembly, machine = assemble(description, told.body), known.calibration().machine
        prepared = ControllerKnowledge(assembly, machine, table_guess(assembly, machine), 0.0, known.calibration())
        progress("Computing limits for an unknown arm", 0.0)
        verification = _verification(prepared, options, options.seed) if is_verified else None
        passes = lesson_passes(assembly, options.identify_s, period_s, verification)
        passes_s = 0.0 if passes is None else period_s * len(passes.path)
        lesson = lesson_plan(prepared, options.identify_s, period_s, stack, verification, passes_s)
        plan = LivePlan(
            description, told, prepared, unknown_person(assembly, machine), 0.0, partial(open_drives, drives),
            round(1e9 * period_s), lesson, key,
        )  # fmt: skip
        listening = stack.enter_context(Listening(options.record_streams)) if options.record_streams else None
        lsl = streaming_of(options, description, period_s, listening)
        if not options.simulate:
            _await_enter(say)
        said = {**drawn_by(options), "settings": {"options": options.recorded(), "machine": serial}}
        seconds = options.loop_s + passes_s
        flown = fly_plan(plan, seconds, folder, said, progress, lambda _: None, is_tested=True, lsl=lsl)
    lock_after_fault(key, flown.report)
    figures = live_figures(
        options.rig, flown, wearer, prepared, f"passed: {key.file}", lsl, listening, machine=serial
    )  # fmt: skip
    return FlownOnDrives(flown, figures, prepared, wearer, verification)


def _verification(prepared: ControllerKnowledge, options: LiveOptions, seed: int) -> Verification:
    """Plan postures that the identification does not visit, with the arm of the table: this arm is not known yet."""
    model = ArmModel(prepared.assembly, prepared.machine)
    seen = identification_motion(prepared.assembly, options.identify_s, SEEN_EVERY_S).q
    return Verification(unseen_postures(model, prepared.x, seen, seed), seed)


def _await_enter(say: Say) -> None:
    say(READY)
    while not is_line_typed(sys.stdin, 0.5):
        pass
