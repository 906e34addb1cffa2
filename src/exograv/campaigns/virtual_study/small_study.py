"""Small study that is flown repeatedly with other constants: the same people, at most an hour of each."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from .careers import Career, careers
from .checkpoint import CareerJob, lived_of
from .flight import VirtualFlight
from .options import StudyOptions

SESSIONS, WINDOWS, FLIGHT_WINDOWS = 1, 3, 1
"""Smallest numbers from which transfer can be computed."""

SIZE = (
    f"{SESSIONS} training or {SESSIONS} familiarisation of {WINDOWS} windows before a flight of {FLIGHT_WINDOWS}: "
    "sizes refer to this small study, not to the one above"
)


@dataclass(frozen=True)
class Variant:
    """Variant of all people with some constants changed; without changes they have the usual constants."""

    name: str
    constants: Mapping[str, float] = field(default_factory=dict)

    @property
    def folder(self) -> str:
        """Name of the folder. It depends only on the constants, not on the name of the variant."""
        return "+".join(f"{name}={value:g}" for name, value in sorted(self.constants.items())) or "usual"


@dataclass(frozen=True)
class FlightResources:
    """Folder, processes and progress of the flights."""

    kept: Path
    """Folder for one file per career."""

    processes: int
    tell: Callable[[float], None]
    """Callback that receives the finished share of the work [-]."""


def fly_variants(
    options: StudyOptions, conditions: tuple[str, ...], variants: Sequence[Variant], means: FlightResources
) -> list[list[VirtualFlight]]:
    """Fly each variant: the trained people of the study in each condition, and after familiarisation only.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full. Finished careers are kept.
    """
    people = options.participants[0]
    small = replace(
        options, participants=(people, 0), sessions=(SESSIONS, SESSIONS), compared=(SESSIONS, SESSIONS),
        conditions=conditions, windows=WINDOWS, flight_windows=FLIGHT_WINDOWS,
    )  # fmt: skip
    changed = [replace(small, constants={**options.constants, **one.constants}) for one in variants]
    # Jobs are ordered by person and condition, so that calibration and identification run once for all variants.
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
