"""Sensitivity of transfer to each unverified constant of the virtual person, at both ends of its plausible range."""

from collections.abc import Sequence

from exograv.laboratory.participant.habits import swept

from .figure_sensitivity import SensitivityPoint
from .flight import VirtualFlight
from .options import StudyOptions
from .small_study import FlightResources, Variant, fly_variants
from .transfer import transfers

USUAL = "as they are"


def sensitivity(options: StudyOptions, means: FlightResources) -> list[SensitivityPoint]:
    """Compute transfer of an ideal machine with one constant changed at a time; the first row has all usual values.

    The machine knows itself and the arm exactly, so nothing has to be identified. A person's constants do not change
    the machine's left over. Drives and constants come from the study's options.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full. Finished careers are kept.
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
