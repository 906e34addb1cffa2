"""Reactions to faults in a hidden machine and in its fitted twin, by the scenarios of `exograv dev faults`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from exograv.campaigns.faults.fault_plant import FaultParticipant
from exograv.campaigns.faults.scenario import Scenario, ScenarioVerdict, fly
from exograv.laboratory.preparation import Preparation
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.person_limits import person_limits
from exograv.model.description import load_rig
from exograv.rig.twin.twin import PERIOD
from exograv.storage.twin_file import read_twin

from .draw import Hidden
from .effort import corrected, draws_of, fitted, hidden_machine
from .geometry import Geometry

FAULTS = ("F02", "F07", "F08", "F09", "F11", "F12", "F28", "F30", "F41", "F50")
"""Faults at the interface of the machine or at the hand, after which guard and controller act.

Drives that brake by themselves are left out: a hidden machine has none.
"""
STRANGERS = 8


def participant(preparation: Preparation) -> FaultParticipant:
    """Calibrate the machine and identify the arm, as for a campaign of faults.

    Raises:
        ExogravError: The machine, the wearer or the run was refused.
    """
    known = preparation.identified()
    controller = ArmController(known.assembly, known.machine, known.x, PERIOD)
    of_person = person_limits(known.assembly, known.machine, known.x)
    strangers = np.zeros((STRANGERS, 0))  # no fault of `FAULTS` takes another person for this one
    of_machine = limits(preparation.laboratory.description)
    return FaultParticipant(preparation.laboratory, known, controller, of_machine, of_person, strangers)


def compare_reactions(
    folder: Path,
    hidden: Hidden,
    geometry: Geometry,
    ran_s: float,
    wearer: int,
    draws: int,
    flights: int,
    faults: Sequence[str] = FAULTS,
) -> None:
    """Print times and motions after each fault, in the hidden machine and in draws from the fitted twin."""
    whole = read_twin(load_rig(str(folder), "right"))
    description = corrected(folder, whole)
    own = participant(hidden_machine(description, wearer, hidden, geometry, ran_s)())
    twins = [participant(fitted(description, whole, wearer, draw)()) for draw in draws_of(wearer, draws)]
    print("| fault | stopped | predicted | same end | time ms | predicted | way ° | predicted | hand m/s | predicted |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for fault in faults:
        number = FAULTS.index(fault)
        scenarios = [Scenario(wearer, flights * number + flight, (fault,)) for flight in range(flights)]
        true = [fly(own, scenario) for scenario in scenarios]
        predicted = [[fly(twin, scenario) for scenario in scenarios] for twin in twins]
        print(f"| {fault} | {' | '.join(row(fault, true, predicted))} |", flush=True)


def row(fault: str, true: Sequence[ScenarioVerdict], predicted: Sequence[Sequence[ScenarioVerdict]]) -> list[str]:
    """Return the cells of a fault: share of stops, same ends, and medians with the largest value in brackets."""
    each = [one for of_draw in predicted for one in of_draw]
    pairs = [(one, other) for of_draw in predicted for one, other in zip(true, of_draw, strict=True)]
    same = sum(one.course.reason is other.course.reason for one, other in pairs)
    cells = [_stops(true), _stops(each), f"{same}/{len(pairs)}"]
    for found in (true, each):
        times = [time for one in found if (time := one.found.get(fault)) is not None]
        cells.append(_spread(times, 0))
    for name, digits in (("extra_way_deg", 1), ("flight_hand_m_s", 2)):
        cells += [_spread([float(getattr(one.course, name)) for one in found], digits) for found in (true, each)]
    return cells


def _stops(found: Sequence[ScenarioVerdict]) -> str:
    return f"{sum(one.course.stopped_tick is not None for one in found)}/{len(found)}"


def _spread(values: Sequence[float], digits: int) -> str:
    return f"{np.median(values):.{digits}f} ({max(values):.{digits}f})" if values else "-"
