"""Adaptive excitation: the best piece of a random library, refined by the optimiser, for the current estimate."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Covariance, Parameters
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.model.assembly import Assembly
from exograv.motion import Trajectory

from .basis import Coefficients, piece
from .information import LeftOverCriterion, SeenMotion, Statistics
from .limits import MotionLimits
from .optimiser import solve
from .problem import MotionProblem
from .regressor import along

PIECE_S = 10.0
HARMONICS = 6  # 0.6 Hz at most: far below the corner frequency of the sample filter
LIBRARY = 32
SAMPLES = 40
POLISH_ITERATIONS = 12
START_SD = 0.3  # rad


@dataclass(frozen=True)
class MotionPiece:
    """Piece of motion from rest to rest, forth and back to the start posture; its usual length is `PIECE_S`."""

    path: Trajectory
    merit: float
    """Value of the criterion: predicted left over / target [-]; the joint with the largest ratio dominates."""


class Planner:
    """Planner of excitation pieces for one arm in one machine."""

    def __init__(
        self,
        assembly: Assembly,
        machine: CalibratedMachine,
        prediction: LeftOverPrediction,
        model: ArmModel,
        seconds: float = PIECE_S,
    ):
        self._places = assembly.description.places
        self._model, self._prediction = model, prediction
        self._limits = MotionLimits.of(assembly)
        self._statistics = Statistics.of(machine, self._places)
        self._basis = piece(seconds, HARMONICS)

    @property
    def home(self) -> Float[np.ndarray, " joint"]:
        """Best start posture of pieces: the middle of the posture range [rad]."""
        return 0.5 * (self._limits.lower + self._limits.upper)

    def next_motion(
        self,
        covariance: Covariance,
        posture: Float[np.ndarray, " joint"],
        x: Parameters,
        dt: float,
        seed: int,
        under_way: Trajectory | None = None,
    ) -> MotionPiece:
        """Plan the most informative next piece.

        Args:
            covariance: Covariance of all parameters at the time of planning.
            posture: Posture at rest at the start and end of the piece [rad].
            x: Current estimate of the parameters.
            dt: Period of the loop [s].
            seed: Seed of the library.
            under_way: Motion before the piece whose samples are not yet in the covariance.
        """
        if under_way is not None:
            covariance = self.after(covariance, under_way, x)
        problem = self._problem(covariance, posture, x)
        best = solve(problem, self._best_of_library(problem, seed), POLISH_ITERATIONS, np.inf)
        return MotionPiece(self._basis.trajectory(best, self._basis.period_s, dt), problem.value(best))

    def after(self, covariance: Covariance, path: Trajectory, x: Parameters) -> Covariance:
        """Predict the covariance of all parameters at the end of `path`."""
        problem = self._problem(covariance, path.q[0], x)
        rows = np.linspace(0, len(path) - 1, SAMPLES).astype(int)
        q = path.q[rows]
        seen = along(self._model, x, q, path.v[rows], path.a[rows], slopes=False)
        F, B = SeenMotion(problem.criterion, self._statistics, seen, q, path.seconds / SAMPLES).information(1.0)
        P, root = np.linalg.inv(F), problem.criterion.root
        return root @ (P + P @ B @ P) @ root.T

    def _problem(self, covariance: Covariance, posture: Float[np.ndarray, " joint"], x: Parameters) -> MotionProblem:
        criterion = LeftOverCriterion(self._prediction, covariance, self._places)
        return MotionProblem(
            self._basis, self._limits, self._model, x, self._statistics, criterion, (1.0,), posture, SAMPLES
        )

    def _best_of_library(self, problem: MotionProblem, seed: int) -> Coefficients:
        generator = np.random.default_rng(seed)
        drawn = [problem.squeezed(START_SD * generator.standard_normal(problem.shape)) for _ in range(LIBRARY)]
        return problem.fitted(min(drawn, key=problem.value))
