"""What transfer depends on: every constant of the virtual person that nobody has verified, at both plausible ends."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from exograv.session.pilot import Progress
from exograv.session.train.habits import swept

from .crew import live_all
from .figures.sensitivity import Swept
from .flight import Flight
from .options import Career, StudyOptions, careers
from .transfer import transfers

WINDOWS, SESSIONS, USUAL = 3, 1, "as they are"
"""Of one training or one familiarisation before a flight of one window, which is all that transfer takes."""


def sensitivity(options: StudyOptions, people: int, processes: int, tell: Progress) -> list[Swept]:
    """Transfer of an ideal machine with one constant changed at a time; the first row has all as they are.

    The machine knows itself and the arm exactly, so that nothing has to be identified anew for every value: constants
    of a person do not change what a machine leaves over.

    Args:
        options: Of the study; its drives and constants.
        people: The same in every row.
        processes: At the same time.
        tell: Told what is done, and the share of all.

    Raises:
        ExogravError: A machine or run was refused.
    """
    drives = "" if options.main.drives == "harmonic" else f"@{options.main.drives}"
    usual = replace(
        options, participants=(people, 0), sessions=(SESSIONS, SESSIONS), compared=(SESSIONS, SESSIONS),
        conditions=(f"ideal{drives}",), windows=WINDOWS, flight_windows=1,
    )  # fmt: skip
    rows = [(USUAL, np.nan, usual)]
    rows += [
        (one.name, value, replace(usual, constants={**options.constants, one.name: value}))
        for one in swept()
        if one.standing != "source"
        for value in (one.low, one.high)
        if value != one.value
    ]
    work = [(k, career, each) for k, (_, _, each) in enumerate(rows) for career in _unrecorded(each, people)]
    found = [list[Flight]() for _ in rows]
    done = 0

    def told(_name: str, _share: float) -> None:
        tell("What transfer depends on", done / len(work))

    arriving = live_all([(career, each) for _, career, each in work], Path(), processes, told)
    try:
        for index, lived in arriving:
            found[work[index][0]] += lived.flights
            done += 1
    finally:
        arriving.close()
    return [
        _row(name, value, flights, usual.conditions[0]) for (name, value, _), flights in zip(rows, found, strict=True)
    ]


def _unrecorded(options: StudyOptions, people: int) -> list[Career]:
    return [replace(career, code=None) for career in careers(options, ("",) * people)]


def _row(name: str, value: float, flights: Sequence[Flight], condition: str) -> Swept:
    one = transfers(flights)[condition]
    interval = one["ci95"]
    return Swept(name, value, one["transfer"], None if interval is None else (interval[0], interval[1]))
