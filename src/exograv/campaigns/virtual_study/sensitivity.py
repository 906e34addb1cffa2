"""What transfer depends on: every constant of the virtual person that nobody has verified, at both plausible ends."""

from collections.abc import Sequence

from exograv.laboratory.participant.habits import swept

from .figure_sensitivity import SensitivityPoint
from .flight import VirtualFlight
from .options import StudyOptions
from .small_study import FlightResources, Variant, fly_variants
from .transfer import transfers

USUAL = "as they are"


def sensitivity(options: StudyOptions, means: FlightResources) -> list[SensitivityPoint]:
    """Transfer of an ideal machine with one constant changed at a time; the first row has all as they are.

    The machine knows itself and the arm exactly, so that nothing has to be identified: constants of a person do not
    change what a machine leaves over. The options are those of the study, whose drives and constants are taken.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full; careers that were done are kept.
    """
    condition = "ideal" if options.main.drives == "harmonic" else f"ideal@{options.main.drives}"
    rows: list[tuple[str, float | None, Variant]] = [(USUAL, None, Variant(USUAL))]
    rows += [
        (one.name, value, Variant(one.name, {one.name: value}))
        for one in swept()
        if one.standing != "source"
        for value in (one.low, one.high)
        if value != one.value
    ]
    flown = fly_variants(options, (condition,), [variant for _, _, variant in rows], means)
    return [_row(name, value, flights, condition) for (name, value, _), flights in zip(rows, flown, strict=True)]


def _row(name: str, value: float | None, flights: Sequence[VirtualFlight], condition: str) -> SensitivityPoint:
    one = transfers(flights)[condition]
    interval = one.ci95
    return SensitivityPoint(name, value, one.transfer, None if interval is None else (interval[0], interval[1]))
