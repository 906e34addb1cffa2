"""Options of the example of a study."""

from dataclasses import dataclass
from typing import Annotated

from exograv.errors import ConfigError
from exograv.options import SESSIONS_MAX, AnySeed, pair

PARTICIPANTS_MAX = 100


@dataclass(frozen=True)
class ExampleOptions:
    """Options of `exograv study example`."""

    participants: Annotated[tuple[int, int], pair("--participants")] = (3, 3)
    """Numbers of trained and of untrained participants."""

    sessions: Annotated[tuple[int, int], pair("--sessions")] = (16, 4)
    """Sessions of each participant before the flight: trainings, familiarisations."""

    seed: AnySeed = 0

    def __post_init__(self):
        """Check the options.

        Raises:
            ConfigError: Names the option.
        """
        for name, both, low, high in (
            ("participants", self.participants, 0, PARTICIPANTS_MAX),
            ("sessions", self.sessions, 0, SESSIONS_MAX),
        ):
            if len(both) != 2 or not all(low <= value <= high for value in both):
                given = ",".join(str(value) for value in both)
                raise ConfigError(f"--{name} is {given}; give two numbers, trained and untrained: {low} to {high}.")
        if sum(self.participants) == 0:
            raise ConfigError("--participants is 0,0; a study needs at least one participant.")
