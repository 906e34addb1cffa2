"""A machine's own motion, designed once for a nominal person: several starts, judged by the filter itself."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.left_over import TARGET_NM, LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.model.assembly import Assembly

from .basis import Basis, Coefficients, forth_and_back, harmonic
from .forecast import Forecast
from .information import Criterion, DeterminantCriterion, LeftOverCriterion, Statistics
from .limits import MotionLimits
from .optimiser import solve
from .problem import MotionProblem
from .standard import standard_basis

HORIZONS_S = (20.0, 60.0)
"""The predicted left over counts after each of these: the target soon, and accuracy at the end."""

START_SD = 0.3  # rad: of a random start's coefficients, before they are squeezed into the limits
ITERATIONS = 80
FORECAST_DT = 0.02  # s
SAMPLE_S = 0.25
"""Between samples of the optimiser's information; the filter's noise is turned to it."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Design:
    """A motion, and what the filter expects of it."""

    basis: Basis
    coefficients: Coefficients
    merit: float
    """Mean over `HORIZONS_S` of the worst joint's predicted left over against its target, by the filter."""


class Designer:
    """Of one machine with a nominal person in it."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine):
        places = assembly.description.places
        self.model = ArmModel(assembly, machine)
        self.limits = MotionLimits.of(assembly)
        self.statistics = Statistics.of(machine, places)
        self._mean, self._covariance = prior(assembly, machine)
        prediction = LeftOverPrediction(self.model, self._mean)
        self._left_over = LeftOverCriterion(prediction, self._covariance, places)
        self.forecast = Forecast(self.model, self._mean, self._covariance, self.statistics)
        self._target = np.array([TARGET_NM[place] for place in places])

    def designs(
        self, starts: Sequence[tuple[Basis, Coefficients]], iterations: int, seconds: float, progress: Progress
    ) -> list[Design]:
        """Improved from each start, best first by the filter; those that time does not reach are left out."""
        end, found = time.monotonic() + seconds, []
        for k, (basis, coefficients) in enumerate(starts):
            left = end - time.monotonic()
            progress("Designing the motion", k / len(starts))
            if found and left <= 0.0:
                break
            problem = self._problem(basis, self._left_over)
            start = problem.fitted(coefficients)
            share = left / (len(starts) - k)
            better = solve(problem, start, iterations, share)
            found += [Design(basis, c, self.judged(basis, c)) for c in (start, better)]
        progress("Designing the motion", 1.0)
        return sorted(found, key=lambda design: design.merit)

    def standard(self, period_s: float, seed: int, iterations: int = ITERATIONS) -> Design:
        """Five harmonics, D-optimal under the same limits, from a random start."""
        basis = standard_basis(period_s)
        problem = self._problem(basis, DeterminantCriterion(self._covariance), is_white=True)
        start = problem.fitted(self.random_start(basis, np.random.default_rng(seed)))
        coefficients = solve(problem, start, iterations, np.inf)
        return Design(basis, coefficients, self.judged(basis, coefficients))

    def judged(self, basis: Basis, coefficients: Coefficients) -> float:
        """`Design.merit`: the filter's own word, in place of the optimiser's."""
        path = basis.trajectory(coefficients, max(HORIZONS_S), FORECAST_DT)
        found = self.forecast.left_over(path, HORIZONS_S)
        return float(np.mean([(left / self._target).max() for left in found.values()]))

    def random_start(self, basis: Basis, generator: np.random.Generator) -> Coefficients:
        """About the middle of all postures."""
        coefficients = START_SD * generator.standard_normal((basis.mixing.shape[1], self.model.n_joints))
        coefficients[0] = 0.5 * (self.limits.lower + self.limits.upper)
        return coefficients

    def starts(self, period_s: float, harmonics: int, count: int, seed: int) -> list[tuple[Basis, Coefficients]]:
        """Loops and motions that come back the way they went, in turn."""
        generator = np.random.default_rng(seed)
        bases = (harmonic(period_s, harmonics), forth_and_back(period_s, harmonics))
        return [(bases[k % 2], self.random_start(bases[k % 2], generator)) for k in range(count)]

    def _problem(self, basis: Basis, criterion: Criterion, *, is_white: bool = False) -> MotionProblem:
        passes = tuple(horizon / basis.period_s for horizon in HORIZONS_S)
        statistics = self.statistics
        if is_white:
            none = np.zeros_like(statistics.white)
            statistics = Statistics(statistics.white, none, none)
        samples = max(round(basis.period_s / SAMPLE_S), 8 * basis.harmonics)
        return MotionProblem(
            basis, self.limits, self.model, self._mean, statistics, criterion, passes, samples=samples
        )  # fmt: skip


def degrees(values: Float[np.ndarray, "..."]) -> list[float] | list[list[float]]:
    """As a rig file has them, to a tenth."""
    return np.rad2deg(values).round(1).tolist()
