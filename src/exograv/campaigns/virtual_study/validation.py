"""Comparison of the virtual participant with published data, without machine, at 0, 1 and 1.8 g.

The results are simulated and no evidence about people. `trusts_felt` and `learns_aim` were each fitted to one row;
no other constant was fitted to any row.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.participant.habits import Habits, register
from exograv.loop.pilot import Progress
from exograv.rig.twin.disturbances.constant import Constant

from .validation_reaches import Landing, Reaching

WINDOWS = {0.0: 6, 1.0: 1, 1.8: 1}
"""Number of windows with sight, by gravity level."""

UNSEEN = 44
"""Number of touches without any sight, as many as the cycles in PMC5607024."""

UNSEEN_S = 2.75 * UNSEEN + 1.0
DRAWS = 2000
REFERENCE = "the project's reference"

SLOWED = 1.05
"""Ratio of movement time to that on the ground, from which a reach counts as distinctly slower (our choice)."""

MATCHES, DIFFERS, NOT_COMPARED = "matches", "does not match", "cannot be compared"


@dataclass(frozen=True)
class FactRow:
    """Published value beside the value of the model."""

    what: str
    unit: str
    published: str
    source: str
    standing: str
    """Standing of the published figure: "source" or "unverified"."""

    allowed: tuple[float | None, float | None] | None
    """Range for our figure, an open end None; None if it cannot be compared."""

    why: str
    ours: float | None = None
    interval: tuple[float, float] | None = None
    """Interval that holds 95 % of the bootstrap draws over people; None if the fact is not compared."""

    verdict: str = field(init=False)
    """Verdict by the mean, so that a wide interval does not make a match."""

    def __post_init__(self):
        verdict = NOT_COMPARED
        if self.allowed is not None and self.ours is not None:
            low, high = self.allowed
            is_in = (low is None or low <= self.ours) and (high is None or self.ours <= high)
            verdict = MATCHES if is_in else DIFFERS
        object.__setattr__(self, "verdict", verdict)


@dataclass(frozen=True)
class ValidatedPerson:
    """Touches of one person."""

    windows: dict[float, list[list[Landing]]]
    """Touches by gravity level and window."""

    unseen: list[Landing]


@dataclass(frozen=True)
class ValidationResult:
    """Result of `exograv dev validate-participant`."""

    simulated: bool = field(default=True, init=False)
    people: int
    seed: int
    rows: list[FactRow]
    constants: list[Constant]
    touches: dict[str, list[list[list[Landing]]]]
    """Touches by gravity level, participant and window."""

    unseen: list[list[Landing]]


def run_validation(people: int, seed: int, progress: Progress, habits: Habits | None = None) -> ValidationResult:
    """Measure `people` virtual people, with seeds from `seed` on.

    Raises:
        ConfigError: Fewer than two people, or more than 100.
    """
    if not 2 <= people <= 100:
        raise ConfigError(f"--people is {people}; allowed: 2 to 100. An interval over people needs two.")
    measured = []
    for k in range(people):

        def tell(share: float, k: int = k) -> None:
            progress(f"Person {k + 1} of {people}", (k + share) / people)

        measured.append(measured_person(seed + k, habits, tell))
    rows = rows_of(measured)
    touches = {str(level): [person.windows[level] for person in measured] for level in WINDOWS}
    return ValidationResult(people, seed, rows, register(habits), touches, [person.unseen for person in measured])


def measured_person(seed: int, habits: Habits | None, tell: Callable[[float], None]) -> ValidatedPerson:
    """Measure a person at each gravity without earlier experience, and on the ground once more without sight."""
    windows, total, done = {}, sum(WINDOWS.values()) + UNSEEN_S / 22.0, 0
    for level, count in WINDOWS.items():
        reaching = Reaching(seed, level, sees=True, habits=habits)
        windows[level] = []
        for _ in range(count):
            windows[level].append(reaching.window())
            done += 1
            tell(done / total)
    return ValidatedPerson(windows, Reaching(seed, 1.0, sees=False, habits=habits).window(UNSEEN_S))


def rows_of(people: list[ValidatedPerson]) -> list[FactRow]:
    """Compute the model's value and its interval for each published fact, one row of the table per fact."""
    first = {level: _table(people, lambda p, level=level: [t.up_mm for t in p.windows[level][0]]) for level in WINDOWS}
    n = min(table.shape[1] for table in first.values())
    away = first[0.0][:, :n] - first[1.0][:, :n]
    scatter = np.array([np.std([(t.right_mm, t.up_mm) for t in p.unseen], axis=0, ddof=1) for p in people])
    constant = np.array([np.mean([(t.right_mm, t.up_mm) for t in p.unseen], axis=0) for p in people])
    drift = np.array([_drift(p.unseen) for p in people])
    took = np.array([[np.mean([t.took_s for t in p.windows[g][0]]) for g in (0.0, 1.0)] for p in people])
    peak = np.array([[np.mean([t.peak_share for t in p.windows[g][0]]) for g in (0.0, 1.0)] for p in people])
    last = np.array([p.windows[0.0][-1][0].up_mm for p in people]) - first[1.0].mean(axis=1)
    up, down = (0.0, None), (None, 0.0)
    memorised = "there the target was remembered with closed eyes, here it is half visible all the time"
    return [
        _with(FactRow("scatter of unseen touches, SD", "mm", "4.5°: 55 at 0.7 m", "Watt 1997", "source", None,
                  memorised), scatter.mean(axis=1)),
        _with(FactRow("constant error of unseen touches, horizontal", "mm", "8.8 ± 8.7", "JEMS", "source", None,
                  "put in: the personal map (bias_sd_deg) is such an error, by another source"),
              np.abs(constant[:, 0])),
        FactRow("constant error of the unseen hand, sagittal", "mm", "12.4 ± 9.6", "JEMS", "source", None,
            "the glass stops the finger"),
        _with(FactRow("first touch, 0 g against 1 g, up", "mm", "downwards", "Chen et al.", "source", down,
                  "a weight that is still carried lifts the arm; earlier reports conflict"), away[:, 0]),
        _with(FactRow("first touch, 1.8 g against 1 g, up", "mm", "upwards", "Chen et al.; Bock 1996", "source", up,
                  "a weight that is not yet carried lowers the arm; nothing here makes anyone aim higher"),
              (first[1.8] - first[1.0])[:, 0]),
        _with(FactRow("size of that at 0 g", "mm", "10 to 30", REFERENCE, "unverified", (10.0, 30.0),
                  "trusts_felt was fitted to this row"), np.abs(away[:, 0])),
        _with(FactRow("half-life at 0 g", "movements", "3 to 8", REFERENCE, "unverified", (3.0, 8.0),
                  "learns_aim was halved for this row; aim, holding and the fast state learn at once"), away,
              half_life),
        _with(FactRow("residual, first touch of window 6 at 0 g, up", "mm", "one is left after 5 to 10", REFERENCE,
                  "unverified", None, "no size is given"), last),
        _with(FactRow("movement time, 0 g over 1 g", "-", "distinctly longer", "Bock 2001; eLife RP107472", "source",
                  (SLOWED, None),
                  "mass_doubt slows a little; stiff muscles keep the path"), took[:, 0] / took[:, 1]),
        _with(FactRow("greatest speed, share of the reach, 0 g minus 1 g", "-", "earlier", "eLife RP107472", "source",
                  down, "stiff muscles put the mass right on the way"), peak[:, 0] - peak[:, 1]),
        _with(FactRow("drift over 44 unseen touches", "mm", "about 50", "PMC5607024", "source", (25.0, 75.0),
                  "felt errors do not add up here; part of ours is scatter of four touches"), drift),
        FactRow("corrections to a double step", "-", "preserved", "Bringoux 2020", "source", None,
            "the target does not jump, and no reach is planned anew on the way"),
    ]  # fmt: skip


def half_life(away: np.ndarray) -> float:
    """Return the number of movements after which the mean of (person, touch) has halved; all of them if never."""
    mean = away.mean(axis=0) / away[:, 0].mean()
    below = np.flatnonzero(mean <= 0.5)
    if not len(below):
        return float(len(mean))
    k = int(below[0])
    return k - 1 + float((mean[k - 1] - 0.5) / (mean[k - 1] - mean[k]))


def _table(people: list[ValidatedPerson], values: Callable[[ValidatedPerson], list[float]]) -> np.ndarray:
    rows = [values(person) for person in people]
    n = min(map(len, rows))
    return np.array([row[:n] for row in rows])


def _drift(touches: list[Landing]) -> float:
    places = np.array([(t.right_mm, t.up_mm) for t in touches])
    return float(np.linalg.norm(places[-4:].mean(axis=0) - places[:4].mean(axis=0)))


def _with(row: FactRow, per_person: np.ndarray, statistic: Callable[[np.ndarray], float] = np.mean) -> FactRow:
    random = np.random.default_rng(1000)
    n = len(per_person)
    drawn = [statistic(per_person[random.integers(n, size=n)]) for _ in range(DRAWS)]
    low, high = np.percentile(drawn, [2.5, 97.5])
    return replace(row, ours=float(statistic(per_person)), interval=(float(low), float(high)))
