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
    """Options of `exograv study simulate` that its figures depend on."""

    participants: Annotated[tuple[int, int], pair("--participants")] = (3, 3)
    """Numbers of trained and of untrained people."""

    sessions: Annotated[tuple[int, int], pair("--sessions")] = (16, 4)
    """Sessions of each person before the flight: trainings, familiarisations."""

    conditions: Annotated[tuple[str, ...], words(_names)] = ("dam",)
    """Conditions by commas; the trained group has the first. table, gcm, gradient, dam, ideal, water, parabolic; with a
    machine also @quasi-direct, +left=0.2 (share of the weight left on purpose), +friction=2 (relative to the machine's
    own)."""

    compared: Annotated[tuple[int, int], pair("--compared")] = (4, 1)
    """Most sessions before flights that only compare conditions: trainings, familiarisations."""

    seed: AnySeed = 0
    level: Level = 2

    windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Number of windows to run of each protocol, for a quick trial; all if absent."""

    flight_windows: Annotated[int | None, tyro.conf.arg(metavar="N")] = None
    """Number of windows to run of the flight; 1 is enough for transfer. The default is --windows."""

    constants: NamedNumbers = field(default_factory=dict)
    """Changed constants of the virtual participants as NAME=VALUE (docs/explanation/virtual_participant.md), such as
    width=0.1."""

    def __post_init__(self):
        """Check the options.

        Raises:
            ConfigError: Names the option.
        """
        from exograv.task.protocol import load_protocol

        from .conditions import condition_of

        ExampleOptions(self.participants, self.sessions, self.seed)  # It checks the same two pairs.
        super().__post_init__()
        if self.participants[0] == 0:
            raise ConfigError("--participants begins with 0; a study needs trained people. Give 1 or more: 3,3.")
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
                "--conditions begins with 'parabolic'. Its trainings are flights, which the study's report counts. "
                "Put another condition first; 'parabolic' is compared all the same."
            )
        names = [condition_of(text).name for text in self.conditions]
        if twice := [name for name in names if names.count(name) > 1]:
            raise ConfigError(f"--conditions names '{twice[0]}' twice. Give each once.")
        _ = self.habits

    @property
    def main(self) -> "Condition":
        """Condition of the trained group."""
        from .conditions import condition_of

        return condition_of(self.conditions[0])

    @property
    def habits(self) -> "Habits":
        """Constants of all virtual participants."""
        from exograv.laboratory.participant.habits import with_constants

        return with_constants(self.constants)


@dataclass(frozen=True)
class WorkOptions(Options):
    """Options of `exograv study simulate` that do not affect its figures."""

    processes: Processes = 2
    """Number of parallel processes; figures do not depend on it."""

    resume: bool = False
    """Continue the study in the folder of `--out`."""

    sensitivity: bool = False
    """Sweep each constant of the virtual people without a verified source too: transfer at its low and high end."""

    ablate: bool = False
    """Fly all conditions with one mechanism of the virtual people off at a time too, to find the origin of transfer."""
