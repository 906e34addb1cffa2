"""The small study that is flown again and again with other constants: the same people, an hour of each at most."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from .careers import Career, careers
from .checkpoint import CareerJob, lived_of
from .flight import VirtualFlight
from .options import StudyOptions

SESSIONS, WINDOWS, FLIGHT_WINDOWS = 1, 3, 1
"""All that transfer takes."""

SIZE = (
    f"{SESSIONS} training or {SESSIONS} familiarisation of {WINDOWS} windows before a flight of {FLIGHT_WINDOWS}: "
    "sizes are those of this small study, not of the one above"
)


@dataclass(frozen=True)
class Variant:
    """All people with some of their constants changed; nothing changed is how they are."""

    name: str
    constants: Mapping[str, float] = field(default_factory=dict)

    @property
    def folder(self) -> str:
        """That keeps it: the same constants are the same variant, whatever its name."""
        return "+".join(f"{name}={value:g}" for name, value in sorted(self.constants.items())) or "usual"


@dataclass(frozen=True)
class FlightResources:
    """Where and how it is flown."""

    kept: Path
    """A file a career goes in here."""

    processes: int
    tell: Callable[[float], None]
    """Told the share that is done."""


def fly_variants(
    options: StudyOptions, conditions: tuple[str, ...], variants: Sequence[Variant], means: FlightResources
) -> list[list[VirtualFlight]]:
    """Flights of each variant: the trained people of the study, in each condition and after familiarisation only.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full; careers that were done are kept.
    """
    people = options.participants[0]
    small = replace(
        options, participants=(people, 0), sessions=(SESSIONS, SESSIONS), compared=(SESSIONS, SESSIONS),
        conditions=conditions, windows=WINDOWS, flight_windows=FLIGHT_WINDOWS,
    )  # fmt: skip
    changed = [replace(small, constants={**options.constants, **one.constants}) for one in variants]
    # One person in one condition after the other: a machine is calibrated and an arm identified once for all variants.
    jobs = [
        (k, CareerJob(career, changed[k], means.kept / one.folder / f"{career.name}.json"))
        for career in _unrecorded(small)
        for k, one in enumerate(variants)
    ]
    found = [list[VirtualFlight]() for _ in variants]
    lived = lived_of([job for _, job in jobs], Path(), means.processes, means.tell)
    for (k, _), one in zip(jobs, lived, strict=True):
        found[k] += one.flights
    return found


def _unrecorded(options: StudyOptions) -> list[Career]:
    return [replace(career, code=None) for career in careers(options, ("",) * sum(options.participants))]
