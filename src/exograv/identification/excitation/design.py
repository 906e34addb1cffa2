"""Design of a machine's excitation motion for a nominal person: several starts, judged by the estimator's filter."""

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
"""Times of motion at which the predicted left over counts [s]: early for the target, late for final accuracy."""

START_SD = 0.3  # rad: standard deviation of a random start's coefficients, before they are scaled into the limits
ITERATIONS = 80
FORECAST_DT = 0.02  # s
SAMPLE_S = 0.25
"""Period of the optimiser's samples [s]; the filter's noise is converted to it."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Design:
    """Excitation motion, with its merit as predicted by the filter."""

    basis: Basis
    coefficients: Coefficients
    merit: float
    """Residual torque that the filter predicts for the worst joint, divided by the joint's target [-].

    Mean over `HORIZONS_S`.
    """


class Designer:
    """Designer of motions for one machine with a nominal person."""

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
        """Optimise from each start; return all designs, best first by the filter.

        Starts are skipped when `seconds` are over, except the first one.
        """
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
        """Design a D-optimal motion of five harmonics under the same limits, from a random start."""
        basis = standard_basis(period_s)
        problem = self._problem(basis, DeterminantCriterion(self._covariance), is_white=True)
        start = problem.fitted(self.random_start(basis, np.random.default_rng(seed)))
        coefficients = solve(problem, start, iterations, np.inf)
        return Design(basis, coefficients, self.judged(basis, coefficients))

    def judged(self, basis: Basis, coefficients: Coefficients) -> float:
        """Compute `Design.merit` by the filter, not by the optimiser's approximation."""
        path = basis.trajectory(coefficients, max(HORIZONS_S), FORECAST_DT)
        found = self.forecast.left_over(path, HORIZONS_S)
        return float(np.mean([(left / self._target).max() for left in found.values()]))

    def random_start(self, basis: Basis, generator: np.random.Generator) -> Coefficients:
        """Draw random coefficients around the middle of the posture range [rad]."""
        coefficients = START_SD * generator.standard_normal((basis.mixing.shape[1], self.model.n_joints))
        coefficients[0] = 0.5 * (self.limits.lower + self.limits.upper)
        return coefficients

    def starts(self, period_s: float, harmonics: int, count: int, seed: int) -> list[tuple[Basis, Coefficients]]:
        """Draw `count` random starts, alternately with free harmonics and forth-and-back motions."""
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
    """Convert radians to degrees with one decimal, as in a rig file."""
    return np.rad2deg(values).round(1).tolist()
