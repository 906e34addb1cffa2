"""Ablation: the small study with one mechanism of the virtual person switched off at a time."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from exograv.laboratory.participant.habits import MOST
from exograv.report.study_report.results import number

from .conditions import condition_of
from .flight import FAMILIARISED, VirtualFlight, compared, familiarised
from .options import StudyOptions
from .small_study import SIZE, FlightResources, Variant, fly_variants
from .transfer import PairedCareers, TransferChange, change, pairs, transfer

ALL_ON = Variant("all as they are")
MECHANISMS = (
    ALL_ON,
    Variant("slow states learn nothing", {"slow_learns": 0.0}),
    Variant("the fast state learns nothing", {"fast_learns": 0.0}),
    Variant("nothing is aimed away", {"learns_aim": 0.0}),
    Variant("none of these three learns", {"slow_learns": 0.0, "fast_learns": 0.0, "learns_aim": 0.0}),
    # At this width, levels a sixteenth of g apart are separate contexts. A width of 0 would cause a division by zero.
    Variant("levels are kept apart", {"width": 0.01}),
    Variant("all levels are one context", {"width": 100.0}),
    Variant("the felt weight is not believed", {"trusts_felt": 0.0}),
    # At a value of 1, a person could not learn from anything seen.
    Variant("hardly anything but the felt weight is believed", {"trusts_felt": MOST["trusts_felt"]}),
    Variant("mass is not doubted", {"mass_doubt": 0.0}),
)
"""Variants with one mechanism off or at an end of its range."""

TEXT = (
    f"The same people in the same conditions with one mechanism of the virtual person off at a time; {SIZE}. The "
    "mechanism is off for E₀ too. The change is relative to the study with all mechanisms, person by person. Its "
    "interval is Student's t of each person's share in it; this linear approximation needs an E₀ well away from 0."
)


@dataclass(frozen=True)
class Ablated:
    """Figures of one condition with one mechanism off."""

    condition: str
    off: str
    constants: dict[str, float]
    people: int
    first_window_up_mm: float | None
    """Mean error E in the first window after the training."""

    familiarised_up_mm: float | None
    """Mean error E₀ in the first window after familiarisation only."""

    transfer: float | None
    ci95: list[float] | None
    change: float | None
    """Change of transfer that switching the mechanism off causes; None for the study with all mechanisms."""

    change_ci95: list[float] | None
    reason: str | None
    """Reason why a value is missing; None if all values exist."""


def ablation(options: StudyOptions, means: FlightResources) -> list[Ablated]:
    """Fly each compared condition of the study with each of `MECHANISMS`.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full. Finished careers are kept.
    """
    conditions = tuple(condition_of(text).name for text in options.conditions)
    flown = fly_variants(options, conditions, MECHANISMS, means)
    return [row for name in conditions for row in ablated_rows(name, flown)]


def ablated_rows(condition: str, flown: Sequence[Sequence[VirtualFlight]]) -> list[Ablated]:
    """Compute the rows of one condition from the flights of each of `MECHANISMS`, in their order."""
    found = [pairs(compared(flights).get(condition, ()), familiarised(flights)) for flights in flown]
    return [_row(condition, one, own, found[0]) for one, own in zip(MECHANISMS, found, strict=True)]


def _row(condition: str, variant: Variant, own: PairedCareers, usual: PairedCareers) -> Ablated:
    told, changed = transfer(own), TransferChange() if variant is ALL_ON else change(own, usual)
    anybody = len(own.people) > 0
    return Ablated(
        condition, variant.name, dict(variant.constants), len(own.people),
        float(own.trained.mean()) if anybody else None, float(own.familiarised.mean()) if anybody else None,
        told.transfer, told.ci95, changed.change, changed.ci95, told.reason or changed.reason,
    )  # fmt: skip


def sentences(rows: Sequence[Ablated]) -> Iterator[str]:
    """Yield sentences on the effect of each mechanism on transfer, condition by condition."""
    for condition in dict.fromkeys(row.condition for row in rows if row.condition != FAMILIARISED):
        own = [row for row in rows if row.condition == condition]
        usual = own[0].transfer
        if usual is None:
            yield f"The mechanism behind transfer of {condition} cannot be determined: {own[0].reason}."
            continue
        said = f"In the small study transfer of {condition} is {number(usual)}."
        if moved := [row for row in own if row.change_ci95 is not None and not _holds_0(row.change_ci95)]:
            said += f" It changes where {'; '.join(map(_told, moved))}."
        if open_ := [row for row in own if row.change_ci95 is not None and _holds_0(row.change_ci95)]:
            said += f" A change is not shown where {'; '.join(map(_told, open_))}."
        if untold := [row.off for row in own[1:] if row.change_ci95 is None]:
            said += f" It cannot be told where {'; '.join(untold)}."
        yield said


def _holds_0(interval: Sequence[float]) -> bool:
    return interval[0] <= 0.0 <= interval[1]


def _told(row: Ablated) -> str:
    if row.change is None or row.change_ci95 is None:
        return row.off
    low, high = (f"{end:+.2f}".replace("-", "−") for end in row.change_ci95)
    return f"{row.off} ({row.change:+.2f}, 95 % interval {low} to {high})".replace("(-", "(−")
