"""Variance components of a pilot study, and their uncertainty."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from exograv.errors import ConfigError
from exograv.study.statistics.bayes import PosteriorGrid, StudyPrior, posterior_grid
from exograv.study.statistics.people import counted_touches, logs_of, people_of
from exograv.study.statistics.random_intercept import sums_of

from .assumptions import TruthAssumptions


@dataclass(frozen=True)
class PilotVariance:
    """Variance components that a small study gives for the next one [log units]."""

    people: tuple[int, int]
    touches: int
    windows: int
    """Median number of windows per person."""

    touches_per_window: float
    """Mean number of touches per window of a person."""

    difference: float
    """Difference between the groups' means of people's medians."""

    window_sd: float
    grid: PosteriorGrid
    """Posterior of the difference and of the standard deviations between people and between touches."""

    left_out: tuple[str, ...]

    @property
    def touch_sd(self) -> float:
        """Standard deviation between touches of a window [log units].

        The grid does not model windows: its standard deviation between touches includes that between windows.
        """
        return self.share_of_touches * float(self.grid.weight @ self.grid.touch_sd)

    @property
    def share_of_touches(self) -> float:
        """Share of the grid's standard deviation between touches that remains without the one between windows [-]."""
        of_grid = float(self.grid.weight @ self.grid.touch_sd)
        return float(np.sqrt(max(0.0, 1.0 - (self.window_sd / of_grid) ** 2)))

    def worlds(self, studies: int, difference: float | None, rng: np.random.Generator) -> TruthAssumptions:
        """Draw true values from the pilot's posterior; the difference is drawn too, unless one is stated."""
        drawn, person_sd, touch_sd = self.grid.draw(studies, rng)
        return TruthAssumptions(
            drawn if difference is None else np.full(studies, difference), person_sd, self.share_of_touches * touch_sd
        )


def read_pilot(
    touches: pd.DataFrame, participants: pd.DataFrame, groups: tuple[str, str], protocol: str
) -> PilotVariance:
    """Estimate the variance components from tidy tables.

    Raises:
        ConfigError: There are too few people to estimate any.
    """
    counted, left_out = counted_touches(touches, participants, groups, protocol, "px")
    people = people_of(counted, groups)
    first, second = (logs_of(people, group) for group in groups)
    if min(len(first), len(second)) < 1 or len(first) + len(second) < 3:
        raise ConfigError(
            f"The pilot has {len(first)} people in '{groups[0]}' and {len(second)} in '{groups[1]}' with touches in "
            f"'{protocol}' that count. At least three people are needed, one in each group. Give --sd and --difference "
            "instead." + "".join(f" {sentence}" for sentence in left_out)
        )
    windows = [own.groupby(["session", "window"]).ngroups for _, own in counted.groupby("participant")]
    return PilotVariance(
        people=(len(first), len(second)),
        touches=len(counted),
        windows=round(float(np.median(windows))),
        touches_per_window=len(counted) / sum(windows),
        difference=float(first.mean() - second.mean()),
        window_sd=window_sd(counted),
        grid=posterior_grid(sums_of(counted, groups), StudyPrior()),
        left_out=left_out,
    )


def window_sd(counted: pd.DataFrame) -> float:
    """Compute the standard deviation between a person's windows [log units], by analysis of variance.

    The value is 0 if windows differ no more than touches do.
    """
    logs = counted["log_deviation"].to_numpy(float)
    window, person = (
        counted.groupby(key).ngroup().to_numpy(int) for key in (["participant", "session", "window"], ["participant"])
    )
    n, windows, people = len(logs), len(set(window)), len(set(person))
    if windows in (people, n):
        return 0.0
    window_mean, person_mean = (np.bincount(key, logs)[key] / np.bincount(key)[key] for key in (window, person))
    between = float(((window_mean - person_mean) ** 2).sum()) / (windows - people)
    within = float(((logs - window_mean) ** 2).sum()) / (n - windows)
    return float(np.sqrt(max(0.0, between - within) * windows / n))
