"""Options of a fault campaign."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro

from exograv.options import Acts, Level, Options, Seed, TwinSource, Within, World

STRIKES_MAX = 60
"""Largest number of strikes of each kind. The limit follows from the two hours that a live run may last."""


STRUCK = Acts(
    lambda all_: all_.through is None and all_.replay is None and all_.healthy_hours is None,
    "without --through, --replay and --healthy-hours",
)
FAULTY = Acts(
    lambda all_: all_.replay is None and all_.healthy_hours is None,
    "without --replay and --healthy-hours, which say what is simulated",
)
ONLY_TWIN = Acts(lambda all_: all_.through is None, "without --through")
MANY = Acts(lambda all_: all_.replay is None, "without --replay, which simulates one scenario")


@dataclass(frozen=True)
class FaultOptions(Options):
    """Options of `exograv dev faults`."""

    scenarios: Annotated[int, Within(1), FAULTY] = 200
    """Number of scenarios; each takes half a second of processor time."""

    seed: Seed = 0
    level: Level = 2
    world: World = "home"

    rig: str | None = None
    """Machine of all participants, by its name or its folder; two shipped machines by turns if none is named."""

    twin: TwinSource = "drawn"

    only: Annotated[str | None, tyro.conf.arg(metavar="FAULT,FAULT"), FAULTY] = None
    """Faults to fly, each alone and equally often with each participant, in place of the whole table."""

    persons: Annotated[int, Within(1)] = 2
    """Number of participants, each calibrated and identified first; every second one has quasi-direct drives
    unless --rig names a machine."""

    processes: Annotated[int | None, Within(1), MANY] = None
    """Number of parallel processes; one per processor if absent. The result does not depend on it."""

    healthy_hours: Annotated[float | None, Within(0.0), ONLY_TWIN] = None
    """Hours of healthy use to simulate in place of faults: quiet, lively and with tremor, in flights of 3 and 60
    minutes. Each stop is a false trip. An hour takes about four minutes of processor time."""

    strikes: Annotated[int, Within(0, STRIKES_MAX, f"0 (none) to {STRIKES_MAX}."), STRUCK] = 1
    """Number of times that each process of a live run is killed, stopped and starved afterwards; 0 for none."""

    replay: Annotated[str | None, tyro.conf.arg(metavar="NUMBER:FAULT")] = None
    """Scenario to simulate again, as printed by a campaign."""

    through: Literal["udp", "canopen"] | None = None
    """Bus of a driver with simulated drives in another process, in place of the twin; ten times
    as slow, without strikes."""

    resume: Annotated[bool, MANY] = False
    """Continue an interrupted campaign with the verdicts in the folder of `--out`."""
