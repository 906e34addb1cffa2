"""Weighing of an arm and of known weights on drives (`arm weigh --drives`): live identification, then the weights."""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.live.live_figures import LiveFigures
from exograv.live.live_moved import LiveMoved
from exograv.live.options import ReturningPerson
from exograv.loop.keyboard import is_line_typed
from exograv.loop.moved_machine import approach
from exograv.loop.phases import LAYING_DOWN
from exograv.loop.pilot import Progress
from exograv.model.arm import WeightPlace
from exograv.model.description import load_rig
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.weighing.arm_check import ArmCheck
from exograv.procedures.weighing.known_weight import put_down, weigh
from exograv.procedures.weighing.options import WeighOptions
from exograv.procedures.weighing.placed_weight import PlacedWeight
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.results import json_value

from .arm_files import stored_arm
from .connection import Say
from .float_command import Procedure, fly_on_drives
from .support_level import live_options

WEIGHING_MAX_S = 900.0
"""Longest time for each weight [s], after which the arm is let down: four times the time in the twin."""

Interval = list[float]


@dataclass(frozen=True)
class WeightOnDrives:
    """Estimate of a weight on the arm."""

    place: WeightPlace
    estimated_kg: float
    ci95_kg: Interval
    stated_kg: float | None
    """Weight by the command line [kg]; None if it gives none."""


@dataclass(frozen=True)
class WeighOnDrivesResult:
    """Result of `exograv arm weigh` on drives."""

    rig: str
    is_simulated: bool
    arm_mass_kg: float | None
    """Mass of the arm by the check of the form [kg]; None for a stored arm, and after a motion of less than 20 s."""
    ci95_kg: Interval | None
    why: str
    """Verdict about the form."""
    weights: list[WeightOnDrives]
    recording: Path
    live: LiveFigures


class WeightAtPerson:
    """`Operator` who puts a weight into the hand of a person, or fastens it at the forearm."""

    lowers_s = 4.0

    def __init__(self, say: Say, is_typed: Callable[[], bool] = lambda: is_line_typed(sys.stdin, 0.0)):
        """Ask on the screen, by `say`; `is_typed` returns True if Enter was pressed."""
        self._say, self._is_typed, self._asked = say, is_typed, ""

    def is_ready(self, mount: str, mass_kg: float) -> bool:
        """Ask once to prepare the weight; True if Enter has been pressed since then."""
        where = "in the hand" if mount == "hand" else "at the middle of the forearm"
        what = f"put the weight {where}" if mass_kg else f"take away the weight {where}"
        if self._asked != what:
            self._asked = what
            self._say(f"The person stays relaxed. Press Enter, then {what} within {self.lowers_s:g} s, gently.")
        if not self._is_typed():
            return False
        self._asked = ""
        return True

    def lower(self, mount: str, mass_kg: float) -> None:
        """Do nothing: the person lowers the weight by hand."""


def run_weighing_on_drives(
    options: WeighOptions,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> WeighOnDrivesResult:
    """Identify the arm of a person in a machine on drives, or check a stored arm, and weigh what the person holds.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
        IdentificationError: The arm contradicts the form, or the person's file.
        RigError: The machine cannot carry a weight, or was stopped before the end.
    """
    description, files = load_rig(options.rig, options.side), stored_arm(person, options, folder)
    found: list[Weighing] = []

    def move(machine: LiveMoved, hands: Hands, _shown: Progress) -> None:
        operator = hands.weights if options.simulate else WeightAtPerson(say)
        placed: dict[WeightPlace, PlacedWeight] = {
            place: PlacedWeight(machine, operator, place, mass) for place, mass in options.weights.items()
        }
        for place, weight in placed.items():
            found.append(weigh(machine, machine.model, machine.estimate, weight.put, place))
        task = {"weights": [{"place": one.place, "estimated_kg": one.mass, "sd_kg": one.sd} for one in found]}
        machine.floating.write("/result", machine.floating.t, {"task": json_value(task), "rig": options.rig})
        for place, weight in reversed(placed.items()):
            put_down(machine, machine.model, machine.estimate, weight.put, place)
        if placed:
            approach(machine, LAYING_DOWN, np.array(description.donning_posture), "Bringing the arm back")

    procedure = Procedure("arm weigh", files=files, recording_name="weigh.mcap", moves=move)
    seconds = WEIGHING_MAX_S * max(len(options.weights), 1)
    live = live_options(options, options.identify_s, seconds)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    check: ArmCheck | None = None if run.flown.learned is None else run.flown.learned.check
    is_stated = options.simulate or options.hand_weight_kg is not None
    return WeighOnDrivesResult(
        rig=description.name,
        is_simulated=options.simulate,
        arm_mass_kg=None if check is None else round(check.arm_mass, 4),
        ci95_kg=None if check is None else _rounded(check.ci95),
        why=_unchecked(run.from_file, files) if check is None else check.why,
        weights=[
            WeightOnDrives(
                one.place,
                round(one.mass, 4),
                _rounded(one.ci95),
                options.weights[one.place] if is_stated or one.place == "forearm" else None,
            )
            for one in found
        ],
        recording=run.flown.path,
        live=run.figures,
    )


def _unchecked(from_file: bool, files: ParticipantOptions) -> str:
    if from_file:
        return f"The arm agrees with {files.participant}, so it was not compared with the form."
    return "The motion was too short for a check of the form."


def _rounded(interval: tuple[float, float]) -> Interval:
    return [round(end, 4) for end in interval]
