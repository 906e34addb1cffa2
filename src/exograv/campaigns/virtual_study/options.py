"""Options of a virtual study."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.campaigns.study_example.options import ExampleOptions
from exograv.errors import ConfigError
from exograv.options import AnySeed, Level, NamedNumbers, Options, Processes, pair, words

if TYPE_CHECKING:
    from exograv.laboratory.participant.habits import Habits

    from .conditions import Condition

PROTOCOLS = ("training", "familiarisation", "flight")


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


@dataclass(frozen=True)
class StudyOptions(Options):
    """Options of `exograv simulate-study` that its figures depend on."""

    participants: Annotated[tuple[int, int], pair("--participants")] = (3, 3)
    """Trained and untrained."""

    sessions: Annotated[tuple[int, int], pair("--sessions")] = (16, 4)
    """Of each before the flight: trainings, familiarisations."""

    conditions: Annotated[tuple[str, ...], words(_names)] = ("dam",)
    """By commas; the trained group has the first. table, gcm, gradient, dam, ideal, water, parabolic; with a machine
    also @quasi-direct, +left=0.2 (share of the weight left on purpose), +friction=2 (over the machine's own)."""

    compared: Annotated[tuple[int, int], pair("--compared")] = (4, 1)
    """Sessions before flights that only compare conditions, at most."""

    seed: AnySeed = 0
    level: Level = 2

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many of each protocol, to try it."""

    flight_windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Only so many of the flight's: one is enough for transfer. As --windows where absent."""

    constants: NamedNumbers = field(default_factory=dict)
    """NAME=VALUE of the virtual participants (docs/virtual_participant.md), such as width=0.1."""

    def __post_init__(self):
        """Check the study.

        Raises:
            ConfigError: Names the option.
        """
        from exograv.task.protocol import load_protocol

        from .conditions import condition_of

        ExampleOptions(self.participants, self.sessions, self.seed)  # the same two pairs
        super().__post_init__()
        if self.participants[0] == 0:
            raise ConfigError("--participants begins with 0; somebody has to train. Give 1 or more, as in 3,3.")
        if len(self.compared) != 2 or not all(0 <= value <= 99 for value in self.compared):
            raise ConfigError("--compared takes two numbers of 0 to 99, trainings and familiarisations, as 4,1.")
        for option, count in (("--windows", self.windows), ("--flight-windows", self.flight_windows)):
            most = min(load_protocol(name).settings.windows.count for name in PROTOCOLS)
            if count is not None and not 1 <= count <= most:
                raise ConfigError(f"{option} is {count}; the protocols have 1 to {most}.")
        if not self.conditions:
            raise ConfigError("--conditions names none; the trained group trains in the first. Give one, such as dam.")
        if self.main.training == "parabolic":
            raise ConfigError(
                "--conditions begins with 'parabolic', whose trainings are flights, which the study's report would "
                "count. Put another one first, and it is compared all the same."
            )
        names = [condition_of(text).name for text in self.conditions]
        if twice := [name for name in names if names.count(name) > 1]:
            raise ConfigError(f"--conditions names '{twice[0]}' twice. Give each once.")
        _ = self.habits

    @property
    def main(self) -> "Condition":
        """Of the trained group."""
        from .conditions import condition_of

        return condition_of(self.conditions[0])

    @property
    def habits(self) -> "Habits":
        """Of everybody."""
        from exograv.laboratory.participant.habits import with_constants

        return with_constants(self.constants)


@dataclass(frozen=True)
class WorkOptions(Options):
    """Options of `exograv simulate-study` that say how it is computed."""

    processes: Processes = 2
    """At the same time; figures do not depend on it."""

    resume: bool = False
    """Go on with the study in the folder of `--out`."""

    sensitivity: bool = False
    """Sweep every constant of the virtual people that no source was read for, too: transfer at its low and high end."""

    ablate: bool = False
    """Fly all conditions with one mechanism of the virtual people off at a time, too: from which transfer comes."""
