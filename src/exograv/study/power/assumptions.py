"""What a planned study is taken to be like, and where each number comes from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

LOG_2 = 0.6931471805599453
"""The published medians, 50 against 100 px: half the deviation."""

LARGEST = 5.0
"""Of a spread or a difference [log units]: a factor of 148."""

TOUCH_SD = 0.6
"""Between touches of a person [log units]. A deviation of two equal normal parts has 0.64 (Rayleigh's distribution)."""


@dataclass(frozen=True)
class PlannedStudy:
    """A study that might be done; standard deviations are of log deviation."""

    difference: float
    """Between the groups [log units], of either sign: 0.69 is half the deviation."""

    person_sd: float
    """Between people of a group, lasting."""

    touch_sd: float = TOUCH_SD
    window_sd: float = 0.0
    """Between windows of a person, beyond what few touches do."""

    flight_sd: float = 0.0
    """Between flights of a person, beyond what few windows do."""

    windows: int = 31
    """Each person has in a flight."""

    touches: int = 8
    """That count, in a window."""

    flights: int = 1
    """Each person takes part in."""

    alpha: float = 0.05

    def __post_init__(self):
        """Refuse what cannot be.

        Raises:
            ConfigError: Names the option.
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
                raise ConfigError(f"--{name} is {value}; each person has at least one.")
        if not 0.0 < self.alpha < 0.5:
            raise ConfigError(f"--alpha is {self.alpha:g}; it must lie between 0 and 0.5, 0.05 as a rule.")


def _option(name: str) -> str:
    return {"person_sd": "sd"}.get(name, name.replace("_", "-"))


@dataclass(frozen=True)
class TruthAssumptions:
    """What is true in each of many simulated studies; all the same, or drawn from what a pilot leaves open."""

    difference: Float[np.ndarray, " study"]
    person_sd: Float[np.ndarray, " study"]
    touch_sd: Float[np.ndarray, " study"]


def sure_worlds(plan: PlannedStudy, studies: int) -> TruthAssumptions:
    """Every study as the plan says."""
    full = [np.full(studies, value) for value in (plan.difference, plan.person_sd, plan.touch_sd)]
    return TruthAssumptions(*full)
