"""Complete runs of teaching and repeating: prepare, run, store, and report."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.preparation import Preparation, prepare
from exograv.laboratory.provenance import run_settings
from exograv.laboratory.virtual_laboratory import VirtualLaboratory, driven_laboratory
from exograv.loop.floating_machine import PilotedMachine
from exograv.loop.pilot import Progress
from exograv.loop.tick_sample import Joints
from exograv.model.description import ArmSide
from exograv.options import TwinOptions, WorldName
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.rehabilitation.guided.floating_arm import FloatingArm, GuardRecord, rms_deg
from exograv.procedures.rehabilitation.guided.grip import GripOutcome
from exograv.procedures.rehabilitation.guided.options import GuidedOptions, PersonKind, RepeatOptions
from exograv.procedures.rehabilitation.guided.path_guide import PathGuide
from exograv.procedures.rehabilitation.guided.repeat import RepeatFigures, repeat
from exograv.procedures.rehabilitation.guided.taught_path import make_taught_path, read_taught, write_taught
from exograv.procedures.rehabilitation.guided.teach import teach
from exograv.recording import RecordingWriter
from exograv.results import MERGED, OPTIONAL, json_value
from exograv.rig.twin import Twin

from .therapist_and_wearer import Holding, Therapist, drawn_movement

AFTER_S = 1.0
"""Time for which a simulated therapist holds the arm at the end of the path, so that it does not float on."""

ACTS_S, PAUSE_S = 8.0, 2.0
"""Time before a simulated person acts, and duration of a pause [s]."""

Preparing = Callable[[VirtualLaboratory, int, Progress], ControllerKnowledge]
"""Function that prepares a laboratory with a seed. A caller with several runs of one laboratory prepares it once."""


@dataclass(frozen=True)
class TaughtFigures:
    """Path that a therapist taught."""

    path: Path
    seconds: float
    stretched: float
    """Ratio of the path's duration to that of the therapist's movement [-]."""
    hash: str
    guard: GuardRecord


@dataclass(frozen=True)
class RepeatedFigures:
    """Repetitions of a path, with the wearer's truth."""

    session: RepeatFigures = field(metadata=MERGED)
    true_rms_deg: list[float]
    muscles_max_Nm: np.ndarray
    path: Path
    guard: GuardRecord


Found = TypeVar("Found")


@dataclass(frozen=True)
class GuidedResult(Generic[Found]):
    """Result of `exograv run teach`, `repeat` or `mirror`."""

    found: Found = field(metadata=MERGED)
    lead: ArmSide | None = field(metadata=OPTIONAL)
    """Side of the leading arm."""
    rig: str
    joints: tuple[str, ...]
    disturbance_level: int
    world: WorldName
    seed: int
    is_simulated: bool
    recording: Path


def run_teach(
    options: GuidedOptions, path: Path, code: str, folder: Path, progress: Progress, preparing: Preparing = prepare
) -> GuidedResult[TaughtFigures]:
    """Let a simulated therapist move the arm, and write the path to a file.

    Raises:
        ConfigError: The path is not valid or leaves the allowed range, or an option is not valid.
        RigError: The envelope stopped the run.
    """
    laboratory = _of_one_arm(options)
    recorded = folder / "teach.mcap"
    with writer_of(recorded, options, laboratory, "exograv run teach") as recording:
        known = preparing(laboratory, options.seed, progress)
        arm = floating_twin(laboratory, known, options.seed, recording, progress)
        start = laboratory.description.donning_posture
        movement = drawn_movement(laboratory.description, options.seed, start, arm.rig.period_s)
        therapist = Therapist(arm.rig, movement)
        # The pilot flies in slices without a text of their own.
        arm.pilot.progress = lambda _text, _share: None
        machine = PilotedMachine(arm.pilot, arm.controller, therapist.act)
        begun, longest_s = machine.t, movement.seconds + AFTER_S

        def show(t: float, _q: Joints) -> bool:
            progress("The arm floats; lead it", min((t - begun) / longest_s, 1.0))
            return False

        path_found = teach(machine, arm.controller.assembly, longest_s, show)
        whole = make_taught_path(
            path_found, laboratory.description, code, datetime.now(UTC).replace(microsecond=0), True
        )
        seconds = round((len(whole.q_rad) - 1) * whole.period_s, 2)
        found = TaughtFigures(path, seconds, round(whole.stretched, 3), whole.content_sha256, arm.guard_record)
        recording.write("/result", arm.rig.t, {"task": json_value(found), "rig": options.rig})
    write_taught(path, whole)
    return guided_result(found, options, laboratory, recorded)


def run_repeat(
    options: RepeatOptions,
    path: Path,
    code: str | None,
    folder: Path,
    progress: Progress,
    preparing: Preparing = prepare,
) -> GuidedResult[RepeatedFigures]:
    """Repeat a taught path with a simulated person.

    Raises:
        ConfigError: The file is damaged, or of another machine or person; or an option is not valid.
        RigError: The envelope stopped the run.
    """
    laboratory = _of_one_arm(options)
    whole = read_taught(path, laboratory.description, code)
    recorded = folder / "repeat.mcap"
    with writer_of(recorded, options, laboratory, "exograv run repeat") as recording:
        known = preparing(laboratory, options.seed, progress)
        arm = floating_twin(laboratory, known, options.seed, recording, progress)
        true_errors: list[np.ndarray] = []
        muscles = np.zeros_like(arm.rig.tau_voluntary)

        def watch(guide: PathGuide) -> None:
            np.maximum(muscles, np.abs(arm.rig.tau_voluntary), out=muscles)
            if guide.state is GripOutcome.LED:
                true_errors.append(guide.target - arm.rig.truth.q)

        path_driven, act = whole.trajectory(arm.rig.period_s), _person(options.person, arm)
        done = repeat(arm, path_driven, options.speed, options.repetitions, act, watch)
        found = RepeatedFigures(done.figures, rms_deg(true_errors), muscles.round(2), path, arm.guard_record)
        recording.write("/result", arm.rig.t, {"task": json_value(found), "rig": options.rig})
    return guided_result(found, options, laboratory, recorded)


def floating_twin(
    laboratory: VirtualLaboratory,
    known: ControllerKnowledge,
    seed: int,
    recording: RecordingWriter | None,
    progress: Progress,
) -> FloatingArm[Twin]:
    """Put the twin with an identified arm behind the guard. It floats from the first tick on.

    `seed` draws the noise of the run.
    """
    worn = Preparation(laboratory, seed, progress, recording).worn(known)
    worn.limit_to_person()
    return FloatingArm(worn.twin, worn.pilot, worn.controller)


def _of_one_arm(options: TwinOptions) -> VirtualLaboratory:
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    if len(laboratory.description.arm_sides) > 1:
        raise ConfigError(
            f"{options.rig} holds both arms, but a path is for one arm: no check prevents a collision of the hands. "
            "Choose a machine for one arm, or let one arm follow the other (exograv run mirror)."
        )
    return laboratory


def _person(kind: PersonKind, arm: FloatingArm[Twin]) -> Callable[[], bool]:
    """Return the action of the person, which starts `ACTS_S` after the arm floats. It returns True to be let go."""
    begins_s = arm.rig.t + ACTS_S
    lasts_s = {"relaxed": 0.0, "pauses": PAUSE_S, "overrules": math.inf, "lets-go": 0.0}[kind]
    holding = Holding(arm.rig, begins_s, begins_s + lasts_s)

    def act() -> bool:
        holding.act()
        return kind == "lets-go" and arm.rig.t >= begins_s

    return act


def writer_of(path: Path, options: TwinOptions, laboratory: VirtualLaboratory, command: str) -> RecordingWriter:
    """Create the recording of this run, to be used in a `with` statement."""
    settings = run_settings(laboratory, command, options.level, options.seed, {"options": options})
    return RecordingWriter(path, laboratory.description.joints, json_value(settings))


def guided_result(
    found: Found,
    options: TwinOptions,
    laboratory: VirtualLaboratory,
    recorded: Path,
    lead: ArmSide | None = None,
) -> GuidedResult[Found]:
    """Add the common figures of all guided runs to the findings."""
    description = laboratory.description
    return GuidedResult(
        found, lead, description.name, description.joints, options.level, options.world, options.seed,
        is_simulated=True, recording=recorded,
    )  # fmt: skip
