"""What a virtual study is asked for, and who does what in it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from exograv.campaigns.study_example.example_study import ExampleOptions
from exograv.errors import ConfigError
from exograv.laboratory.participant.habits import Habits, with_constants
from exograv.task.protocol import load_protocol

from .conditions import Condition, condition_of
from .flight import FAMILIARISED, Group

LEVEL_MAX = 4
COMPARED = (4, 1)
"""Sessions before flights that only compare conditions: trainings, familiarisations; so many suffice."""

PROTOCOLS = ("training", "familiarisation", "flight")


@dataclass(frozen=True)
class Career:
    """One person from the first session to the last flight, in one condition."""

    person: int
    seed: int
    condition: Condition | None
    """None: familiarisation only."""

    sessions: int
    flights: tuple[tuple[int, Group], ...]
    """After which sessions it flies, and for what; each flight from what was learned until then."""

    code: str | None = None
    """In the study's folder, where its recordings go; nothing is recorded without."""

    @property
    def condition_name(self) -> str:
        """As flights have it."""
        return FAMILIARISED if self.condition is None else self.condition.name

    @property
    def name(self) -> str:
        """Of the file that keeps what came out."""
        group = "" if self.code is None else "-study"
        return re.sub(r"[^A-Za-z0-9.]+", "-", f"V{self.person:02d}-{self.condition_name}{group}")


@dataclass(frozen=True)
class StudyOptions:
    """What `exograv simulate-study` is asked for."""

    participants: tuple[int, int] = (3, 3)
    """Trained, untrained."""

    sessions: tuple[int, int] = (16, 4)
    """Before the flight, of each."""

    conditions: tuple[str, ...] = ("dam",)
    """The trained group trains in the first; all are compared in the same people."""

    compared: tuple[int, int] = COMPARED
    """Sessions before flights that compare conditions; never more than `sessions`."""

    seed: int = 0
    level: int = 2
    """Of the twin's disturbances."""

    windows: int | None = None
    """So many of each protocol's, to try it; all where absent."""

    flight_windows: int | None = None
    """So many of the flight's, which is long enough for what is left in the first; as `windows` where absent."""

    constants: Mapping[str, float] = field(default_factory=dict)
    """Of the virtual participants, changed."""

    def __post_init__(self):
        """Refuse what cannot be.

        Raises:
            ConfigError: Names the option.
        """
        ExampleOptions(self.participants, self.sessions, self.seed)  # the same two pairs
        if self.participants[0] == 0:
            raise ConfigError("--participants begins with 0; somebody has to train. Give 1 or more, as in 3,3.")
        if len(self.compared) != 2 or not all(0 <= value <= 99 for value in self.compared):
            raise ConfigError("--compared takes two numbers of 0 to 99, trainings and familiarisations, as 4,1.")
        if not 0 <= self.level <= LEVEL_MAX:
            raise ConfigError(f"--level is {self.level}; allowed: 0 to {LEVEL_MAX}.")
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
    def main(self) -> Condition:
        """Of the trained group."""
        return condition_of(self.conditions[0])

    @property
    def habits(self) -> Habits:
        """Of everybody."""
        return with_constants(self.constants)


def careers(options: StudyOptions, codes: tuple[str, ...]) -> list[Career]:
    """Everybody's, longest first: the main study, then the same trained people in every other way."""
    trained, untrained = options.participants
    seeds = np.random.default_rng([options.seed, 43]).integers(1000, 2**31, trained + untrained).tolist()
    sessions, familiarisations = options.sessions
    few, fewer = (min(a, b) for a, b in zip(options.compared, options.sessions, strict=True))
    found = list[Career]()
    for person in range(trained + untrained):
        is_trained = person < trained
        last = sessions if is_trained else familiarisations
        flights: list[tuple[int, Group]] = [(last, "trained" if is_trained else "untrained")]
        if is_trained and few != last:
            flights.insert(0, (few, "comparison"))
        condition = options.main if is_trained else None
        found.append(Career(person, seeds[person], condition, last, tuple(flights), codes[person]))
    for text in options.conditions[1:]:
        condition = condition_of(text)
        found += [Career(k, seeds[k], condition, few, ((few, "comparison"),)) for k in range(trained)]
    found += [Career(k, seeds[k], None, fewer, ((fewer, "comparison"),)) for k in range(trained)]
    return found
