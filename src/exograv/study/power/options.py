"""Options of a power analysis."""

import math
from dataclasses import dataclass

from exograv.errors import ConfigError
from exograv.options import AnySeed

N_MIN, N_LIMIT = 2, 200


@dataclass(frozen=True)
class CurveOptions:
    """Resolution of the power curve."""

    n_max: int = 40
    """Largest number of people per group on the curve."""

    studies: int = 10_000
    """Number of simulated studies for each number of people."""

    seed: AnySeed = 0

    def __post_init__(self):
        """Reject impossible values.

        Raises:
            ConfigError: An option is out of its range; the message names the option.
        """
        if not N_MIN <= self.n_max <= N_LIMIT:
            raise ConfigError(f"--n-max is {self.n_max}; give {N_MIN} to {N_LIMIT} people per group.")
        if not 100 <= self.studies <= 1_000_000:
            raise ConfigError(f"--studies is {self.studies}; give 100 to 1000000 for each number of people.")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; give 0 or more.")


@dataclass(frozen=True)
class Price:
    """Price of seats on the aircraft."""

    seat_cost: float | None = None
    """Price of one seat on one flight, in any currency."""

    seats_per_flight: int | None = None
    """Seats for participants on one flight."""

    def __post_init__(self):
        """Reject impossible values.

        Raises:
            ConfigError: An option is out of its range; the message names the option.
        """
        if self.seat_cost is not None and not 0.0 <= self.seat_cost < math.inf:
            raise ConfigError(f"--seat-cost is {self.seat_cost:g}; give the price of one seat, 0 or more.")
        if self.seats_per_flight is not None and self.seats_per_flight < 1:
            raise ConfigError(f"--seats-per-flight is {self.seats_per_flight}; give at least 1.")
