"""Design of a machine's excitation motion for a nominal person: several starts, judged by the estimator's filter."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

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

Start = tuple[Basis, Float[np.ndarray, "_ joint"]]
"""Basis and coefficients at which a search starts. Each basis has its own number of shapes."""


@dataclass(frozen=True)
class Design:
    """Excitation motion, with its merit as predicted by the filter."""

    basis: Basis
    coefficients: Coefficients
    merit: float
    """Residual torque that the filter predicts for the worst joint, divided by the joint's target [-].

    Mean over `HORIZONS_S`.
    """


@dataclass(frozen=True)
class Search:
    """Designs of one search, best first by the filter."""

    designs: list[Design]

    starts: int
    """Number of starts that were searched to their end."""

    is_interrupted: bool
    """True if Ctrl-C ended the search."""


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

    def designs(self, starts: Sequence[Start], iterations: int, seconds: float, progress: Progress) -> Search:
        """Optimise from each start.

        Starts are skipped when `seconds` are over, except the first one. Ctrl-C ends the search and keeps the designs
        of the starts before it.

        Raises:
            KeyboardInterrupt: Ctrl-C came during the first start.
        """
        end, found, is_interrupted = time.monotonic() + seconds, list[Design](), False
        for k, (basis, coefficients) in enumerate(starts):
            left = end - time.monotonic()
            progress("Designing the motion", k / len(starts))
            if found and left <= 0.0:
                break
            try:
                found += self._designed(basis, coefficients, iterations, left / (len(starts) - k))
            except KeyboardInterrupt:
                if not found:
                    raise
                is_interrupted = True
                break
        progress("Designing the motion", 1.0)
        return Search(sorted(found, key=lambda design: design.merit), len(found) // 2, is_interrupted)

    def standard(self, period_s: float, seed: int, seconds: float = np.inf) -> Design:
        """Design a D-optimal motion of five harmonics under the same limits, from a random start.

        Args:
            period_s: Period of the motion [s].
            seed: Seed of the start.
            seconds: Largest duration of the search [s].
        """
        basis = standard_basis(period_s)
        problem = self._problem(basis, DeterminantCriterion(self._covariance), is_white=True)
        start = problem.fitted(self.random_start(basis, np.random.default_rng(seed)))
        coefficients = solve(problem, start, ITERATIONS, seconds)
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

    def starts(self, period_s: float, harmonics: int, count: int, seed: int) -> list[Start]:
        """Draw `count` random motions from which the optimisation starts, free and forth-and-back ones in turn."""
        generator = np.random.default_rng(seed)
        bases = (harmonic(period_s, harmonics), forth_and_back(period_s, harmonics))
        return [(bases[k % 2], self.random_start(bases[k % 2], generator)) for k in range(count)]

    def _designed(self, basis: Basis, coefficients: Coefficients, iterations: int, seconds: float) -> list[Design]:
        """Return the start within the limits, and what the optimiser makes of it."""
        problem = self._problem(basis, self._left_over)
        start = problem.fitted(coefficients)
        better = solve(problem, start, iterations, seconds)
        return [Design(basis, c, self.judged(basis, c)) for c in (start, better)]

    def _problem(self, basis: Basis, criterion: Criterion, *, is_white: bool = False) -> MotionProblem:
        passes = tuple(horizon / basis.period_s for horizon in HORIZONS_S)
        statistics = self.statistics
        if is_white:
            none = np.zeros_like(statistics.residual_sd)
            statistics = replace(statistics, disturbance_sd=none, field_sd=none)
        samples = max(round(basis.period_s / SAMPLE_S), 8 * basis.harmonics)
        return MotionProblem(
            basis, self.limits, self.model, self._mean, statistics, criterion, passes, samples=samples
        )  # fmt: skip


def degrees(values: Float[np.ndarray, "..."]) -> list[float] | list[list[float]]:
    """Convert radians to degrees with one decimal, as in a rig file."""
    return np.rad2deg(values).round(1).tolist()
