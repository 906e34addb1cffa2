"""Options of a campaign of faults."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from exograv.options import Level, Options, Seed, Within

STRIKES_MAX = 60
"""Of each kind; a live run lasts at most two hours."""


@dataclass(frozen=True)
class FaultOptions(Options):
    """Options of `exograv faults`."""

    scenarios: Annotated[int, Within(1)] = 200
    """How many; one takes half a second of a processor."""

    seed: Seed = 0
    level: Level = 2

    persons: Annotated[int, Within(1)] = 2
    """Persons in machines, each calibrated and identified at first; every second one has quasi-direct drives."""

    processes: Annotated[int | None, Within(1)] = None
    """At the same time; one a processor if none is named. The result does not depend on it."""

    strikes: Annotated[int, Within(0, STRIKES_MAX, f"0 (none) to {STRIKES_MAX}.")] = 1
    """How often each process of a live run is killed, stopped and starved for real afterwards; 0 for not at all."""

    replay: Annotated[str | None, tyro.conf.arg(metavar="NUMBER:FAULT")] = None
    """One scenario, as a campaign prints it."""

    through: Literal["udp", "canopen"] | None = None
    """Our driver of this bus, before simulated drives in another process, in place of the twin; ten times as slow,
    and without strikes."""

    resume: bool = False
    """Go on with a campaign that was interrupted, by the verdicts in the folder of `--out`."""
