"""Search for the needed support on drives (`run support-level --drives`): live identification, then attempts."""

from dataclasses import dataclass, field, fields
from pathlib import Path

from exograv.live.live_figures import LiveFigures
from exograv.live.options import LiveOptions, ReturningPerson
from exograv.loop.floating_machine import FloatingMachine
from exograv.loop.pilot import Progress
from exograv.model.description import load_rig
from exograv.options import WornOptions
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.rehabilitation.support_level.flight import SupportFlight
from exograv.procedures.rehabilitation.support_level.instructed_person import person_of
from exograv.procedures.rehabilitation.support_level.options import SupportOptions
from exograv.procedures.rehabilitation.support_level.targets import refuse_without_targets
from exograv.procedures.rehabilitation.support_level.tested_support import (
    TestedSupport,
    draw_outcome,
    search_and_test,
)
from exograv.report.figures.support_data import SupportOutcome
from exograv.results import MERGED, json_value

from .arm_files import stored_arm
from .connection import Say
from .float_command import Procedure, fly_on_drives

SEARCH_MAX_S = 1800.0
"""Longest search [s], after which the arm is let down: three times the longest search in the twin."""


@dataclass(frozen=True)
class SupportOnDrives:
    """Result of `exograv run support-level` on drives."""

    outcome: SupportOutcome = field(metadata=MERGED)
    rescues: int
    """Number of times that the arm sank and was carried again."""
    tested_s: float
    """Duration of the attempts [s]."""
    is_simulated: bool
    figure: Path
    recording: Path
    live: LiveFigures


def run_support_level_on_drives(
    options: SupportOptions,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> SupportOnDrives:
    """Identify the arm of a person in a machine on drives, or check a stored arm, and find the needed support.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
        RigError: The machine was stopped before the end of the test.
    """
    description = load_rig(options.rig, options.side)
    refuse_without_targets(description)
    done: list[tuple[TestedSupport, SupportFlight]] = []

    def test(machine: FloatingMachine, hands: Hands, shown: Progress) -> None:
        flight = SupportFlight(machine, person_of(hands, say), description.side)
        done.append((search_and_test(flight, options.seed, shown), flight))
        task = {"outcome": done[-1][0].outcome, "rescues": flight.rescues, "is_simulated": options.simulate}
        machine.write("/result", machine.t, {"task": json_value(task), "rig": options.rig})

    procedure = Procedure(
        "run support-level",
        files=stored_arm(person, options, folder),
        simulation=options.simulation,
        recording_name=f"{options.name}.mcap",
        performs=test,
    )
    run = fly_on_drives(
        live_options(options, options.identify_s, SEARCH_MAX_S), person, folder, progress, say, wearer, procedure
    )
    tested, flight = done[-1]
    outcome = tested.outcome
    figure = draw_outcome(outcome, options.simulate, folder / f"{options.name}.svg")
    return SupportOnDrives(
        outcome, flight.rescues, round(flight.seconds, 1), options.simulate, figure, run.flown.path, run.figures
    )


def live_options(options: WornOptions, identify_s: float, seconds: float) -> LiveOptions:
    """Options of a live run with an identification, and a procedure of at most `seconds` [s] afterwards.

    Raises:
        ConfigError: The duration of the identification is not allowed.
    """
    worn = {one.name: getattr(options, one.name) for one in fields(WornOptions)}
    return LiveOptions(**worn, seconds=seconds, identify_s=identify_s)
