"""Assumptions about a planned study, and their sources."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

LOG_2 = 0.6931471805599453
"""Difference of the published medians, 50 against 100 px [log units]: half the deviation."""

LARGEST = 5.0
"""Largest spread or difference [log units]: a factor of 148."""

TOUCH_SD = 0.6
"""Standard deviation between touches of a person [log units].

The length of a deviation with two equal normal components has 0.64 (Rayleigh's distribution).
"""


@dataclass(frozen=True)
class PlannedStudy:
    """Planned study. Standard deviations are those of log deviation."""

    difference: float
    """Difference between the groups [log units], of either sign; 0.69 is half the deviation."""

    person_sd: float
    """Lasting standard deviation between people of a group [log units]."""

    touch_sd: float = TOUCH_SD
    window_sd: float = 0.0
    """Standard deviation between windows of a person [log units], beyond the effect of few touches."""

    flight_sd: float = 0.0
    """Standard deviation between flights of a person [log units], beyond the effect of few windows."""

    windows: int = 31
    """Number of windows per person and flight."""

    touches: int = 8
    """Number of accepted touches per window."""

    flights: int = 1
    """Number of flights per person."""

    alpha: float = 0.05

    def __post_init__(self):
        """Reject impossible values.

        Raises:
            ConfigError: An option is out of its range; the message names the option.
        """
        for name in ("difference", "person_sd", "touch_sd", "window_sd", "flight_sd"):
            value = getattr(self, name)
            lowest = -LARGEST if name == "difference" else 0.0
            if not lowest <= value <= LARGEST:
                raise ConfigError(
                    f"--{_option(name)} is {value:g}; give log units from {lowest:g} to {LARGEST:g}, such as 0.35."
                )
        for name in ("windows", "touches", "flights"):
            if (value := getattr(self, name)) < 1:
                raise ConfigError(f"--{name} is {value}; give at least 1 for each person.")
        if not 0.0 < self.alpha < 0.5:
            raise ConfigError(f"--alpha is {self.alpha:g}; it must lie between 0 and 0.5; the usual value is 0.05.")


def _option(name: str) -> str:
    return {"person_sd": "sd"}.get(name, name.replace("_", "-"))


@dataclass(frozen=True)
class TruthAssumptions:
    """True values in each of many simulated studies: the same in all, or drawn from the pilot's posterior."""

    difference: Float[np.ndarray, " study"]
    person_sd: Float[np.ndarray, " study"]
    touch_sd: Float[np.ndarray, " study"]


def sure_worlds(plan: PlannedStudy, studies: int) -> TruthAssumptions:
    """Return the true values for all simulated studies, each equal to the value in the plan."""
    full = [np.full(studies, value) for value in (plan.difference, plan.person_sd, plan.touch_sd)]
    return TruthAssumptions(*full)
