"""Teaching and repetition of a path on drives (`run teach`, `run repeat`): live identification, then the path."""

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.errors import ConfigError
from exograv.live.live_figures import LiveFigures
from exograv.live.live_guided import LiveGuided
from exograv.live.live_moved import LiveMoved
from exograv.live.options import ReturningPerson
from exograv.live.procedure_orders import TaughtRows
from exograv.loop.keyboard import is_line_typed
from exograv.loop.moved_machine import MovedMachine, approach
from exograv.loop.phases import ON_THE_WAY
from exograv.loop.pilot import Progress
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.bring_up.hands import BenchHands, Hands
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.rehabilitation.guided.options import GuidedOptions, RepeatOptions
from exograv.procedures.rehabilitation.guided.path_shaping import allowed_range
from exograv.procedures.rehabilitation.guided.repeat import APPROACH_RAD_S, PATIENCE_S, RepeatFigures, repeat
from exograv.procedures.rehabilitation.guided.taught_path import TaughtPath, make_taught_path, read_taught, write_taught
from exograv.procedures.rehabilitation.guided.teach import STILL_S, StillAfterMotion, teach
from exograv.results import MERGED, json_value

from .arm_files import stored_arm
from .connection import Say
from .float_command import FlownOnDrives, Procedure, fly_on_drives
from .support_level import live_options

AROUND_S = 30.0
"""Time for the ramps of a session around its repetitions [s]."""

TEACH_MAX_S = 180.0
"""Longest time for a therapist to begin and lead the arm, which is more than the longest path [s]."""

LEAD = (
    f"Lead the arm along the path now. Then hold it still for {STILL_S:g} s: the machine lets it down, so support it."
)
"""Instruction to the therapist."""

ROOM_RAD = np.deg2rad(10.0)
"""Distance from the edge of the range of a path at which a therapist takes an arm that was outside [rad]."""

LOOK_S = 0.1
"""Time between two looks whether the operator has pressed Enter [s]."""

ASKED = "Press Enter to release the arm; a person who holds against the guidance is released, too."


@dataclass(frozen=True)
class GuidedFlight:
    """Machine, recording, and figures of the live run of a guided session on drives."""

    rig: str
    joints: tuple[str, ...]
    is_simulated: bool
    recording: Path
    live: LiveFigures

    @classmethod
    def of(cls, description: RigDescription, run: FlownOnDrives, is_simulated: bool) -> "GuidedFlight":
        """Return what the result of a session states about its run."""
        return cls(description.name, description.joints, is_simulated, run.flown.path, run.figures)


@dataclass(frozen=True)
class RepeatedOnDrives:
    """Result of `exograv run repeat` on drives."""

    session: RepeatFigures = field(metadata=MERGED)
    path: Path
    flight: GuidedFlight = field(metadata=MERGED)


def run_repeat_on_drives(
    options: RepeatOptions,
    path: Path,
    code: str | None,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> RepeatedOnDrives:
    """Identify the arm of a person in a machine on drives, or check a stored arm, and lead it along a taught path.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
        RigError: The machine was stopped before the end.
    """
    description = load_rig(options.rig, options.side)
    refuse_two_arms(description)
    files = stored_arm(person, options, folder)
    whole = read_taught(path, description, code)
    refuse_simulated(path, whole, options)
    rows, done = TaughtRows(whole.q_rad, whole.period_s), list[RepeatFigures]()

    def move(machine: LiveMoved, _hands: Hands, _shown: Progress) -> None:
        arm = LiveGuided(machine)
        found = repeat(
            arm, rows.trajectory(arm.period_s), options.speed, options.repetitions, released(options, machine, say)
        )
        done.append(found.figures)
        task = json_value(found.figures)
        machine.floating.write("/result", machine.floating.t, {"task": task, "rig": options.rig})

    each_s = (len(whole.q_rad) - 1) * whole.period_s / options.speed + 2.0 * PATIENCE_S + 10.0 / APPROACH_RAD_S
    live = live_options(options, options.identify_s, AROUND_S + options.repetitions * each_s)
    procedure = Procedure("run repeat", files=files, recording_name="repeat.mcap", moves=move, taught=rows)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    return RepeatedOnDrives(done[-1], path, GuidedFlight.of(description, run, options.simulate))


@dataclass(frozen=True)
class TaughtOnDrives:
    """Result of `exograv run teach` on drives."""

    path: Path
    seconds: float
    stretched: float
    """Ratio of the path's duration to that of the therapist's motion [-]."""
    hash: str
    flight: GuidedFlight = field(metadata=MERGED)


def run_teach_on_drives(
    options: GuidedOptions,
    path: Path,
    code: str,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> TaughtOnDrives:
    """Identify an arm in a machine on drives, or check a stored one, let a therapist lead it, and store the path.

    Raises:
        ConfigError: The path is not valid or leaves the allowed range, or a file or an option cannot be used.
        ExogravError: The machine is not ready.
        RigError: The machine was stopped before the end.
    """
    description = load_rig(options.rig, options.side)
    refuse_two_arms(description)
    files = stored_arm(person, options, folder)
    done: list[TaughtPath] = []

    def move(machine: LiveMoved, hands: Hands, shown: Progress) -> None:
        bring_inside(machine, description)
        machine.let_others_lead()
        shown("The arm floats; lead it", 0.0)
        if isinstance(hands, BenchHands):
            hands.tell("therapist")
        else:
            say(LEAD)
        found = teach(machine.floating, machine.model.assembly, TEACH_MAX_S, StillAfterMotion())
        now = datetime.now(UTC).replace(microsecond=0)
        done.append(make_taught_path(found, description, code, now, options.simulate))
        task = {"seconds": _seconds(done[-1]), "stretched": done[-1].stretched}
        machine.floating.write("/result", machine.floating.t, {"task": json_value(task), "rig": options.rig})

    procedure = Procedure("run teach", files=files, recording_name="teach.mcap", moves=move)
    live = live_options(options, options.identify_s, AROUND_S + TEACH_MAX_S)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    whole = done[-1]
    write_taught(path, whole)
    flight = GuidedFlight.of(description, run, options.simulate)
    return TaughtOnDrives(path, _seconds(whole), round(whole.stretched, 3), whole.content_sha256, flight)


def _seconds(whole: TaughtPath) -> float:
    return round((len(whole.q_rad) - 1) * whole.period_s, 2)


def bring_inside(machine: MovedMachine, description: RigDescription) -> None:
    """Move the arm to where a path may begin. The motion that checks a stored arm can end outside.

    Raises:
        RigError: The machine was stopped.
    """
    lower, upper = allowed_range(description, read_exoskeleton(description))
    if ((machine.q >= lower) & (machine.q <= upper)).all():
        return
    machine.lead()
    posture = np.clip(machine.q, lower + ROOM_RAD, upper - ROOM_RAD)
    approach(machine, ON_THE_WAY, posture, "Bringing the arm into the task workspace")
    machine.let_float()


def refuse_two_arms(description: RigDescription) -> None:
    """Refuse a machine for both arms.

    Raises:
        ConfigError: The machine holds both arms.
    """
    if len(description.arm_sides) > 1:
        raise ConfigError(
            f"{description.name} holds both arms, but a path is for one arm: no check prevents a collision of the "
            "hands. Choose a machine for one arm."
        )


def refuse_simulated(path: Path, whole: TaughtPath, options: RepeatOptions) -> None:
    """Refuse to lead a real person along a path of a simulated therapist.

    Raises:
        ConfigError: The path is simulated, and the drives are real.
    """
    if whole.is_simulated and not options.simulate:
        raise ConfigError(
            f"{path} was taught on the twin or on simulated drives. A person is led only along paths that were taught "
            "on the machine itself: teach the path there."
        )


def released(options: GuidedOptions, machine: LiveMoved, say: Say) -> Callable[[], bool]:
    """Return the function that is True if the operator has asked to release the arm."""
    if options.simulate:
        return lambda: False
    say(ASKED)
    looked = machine.floating.t

    def is_asked() -> bool:
        nonlocal looked
        if machine.floating.t - looked < LOOK_S:
            return False
        looked = machine.floating.t
        return is_line_typed(sys.stdin, 0.0)

    return is_asked
