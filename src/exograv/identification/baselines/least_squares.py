"""Offline least squares in stages.

Stage 0 (calibration) identifies the machine. Then arm and elasticity are fitted to the whole motion.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv.identification.core.coordinates import Coordinates
from exograv.identification.core.elasticity import DoubleExponential
from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.setting import Setting

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(MappingProxyType({"ridge": ridge}) for ridge in (1.0, 30.0, 1e3))
RIDGE = 1e3
"""Weight of the start, in units of the prior's information [-]; from python benchmarks/tune_methods.py."""

STEPS_MAX, SETTLED = 25, 1e-4
"""Largest number of Levenberg–Marquardt steps, and relative decrease of the cost that ends the search [-]."""

DAMPING, DAMPING_MAX = 1e-3, 1e6

Unknowns = Float[np.ndarray, " unknown"]


@dataclass(frozen=True)
class _Here:
    """Cost, gradient and information of the fit at one point."""

    cost: float
    slope: Unknowns
    information: Float[np.ndarray, "unknown unknown"]


class LeastSquares:
    """Offline minimum of Σ ((τ − τ̂)/σ)² + ridge · (distance from the start), by Levenberg–Marquardt (a `Method`).

    Li et al. identify actuators, then the empty machine, then wearer and machine. They model the elasticity of the
    joints as a double exponential and optimise over inverse dynamics. Here stage 0 replaces their first two stages;
    friction and rotors keep its values. The unknowns are the bodies (log-Cholesky, for a possible arm), two
    exponentials and a damping for each freedom, and the fit of our cuffs. Their machine is aligned; without this
    fit their method would be judged unfairly here. Their few parameters need no ridge. Ours do, because the data would
    leave most of them undetermined. The covariance is the textbook's: s² times the inverse information, for white
    residuals.

    Source: Li et al. 2022, IEEE TMRB 4:206 (abstract); search: Marquardt 1963.
    """

    name = "least-squares"
    offline = True

    def __init__(self, setting: Setting, ridge: float = RIDGE, settled: float = SETTLED, steps_max: float = STEPS_MAX):
        self._setting, self._averages, self._t = setting, Averages(BATCH_PERIOD_S), 0.0
        self._fit = _StagedFit(setting, ridge, settled, int(steps_max))
        self._done: Estimate | None = None

    def update(self, sample: Sample) -> None:
        """Keep the mean of each 0.08 s."""
        self._t = sample.t
        kept = self._averages.take(sample)
        if kept is not None:
            self._fit.samples.append(kept)
            self._done = None

    def estimate(self) -> Estimate:
        """Return the fit to all samples so far; takes some seconds for a long motion."""
        if self._done is None:
            x, covariance = self._fit.solved()
            self._done = Estimate(self._t, x, covariance, 0.0, 1.0)
        done = self._done
        return Estimate(self._t, done.x.copy(), done.covariance, 0.0, 1.0)


class _StagedFit:
    """Fit of the unknowns: coordinates of bodies and linear parameters, then the curves of elasticity."""

    def __init__(self, setting: Setting, ridge: float, settled: float, steps_max: int):
        self._settled, self._steps_max = settled, steps_max
        self.samples: list[Sample] = []
        self._model, self._sd = setting.model, setting.residual_sd
        self._springs, self._mean = setting.springs, setting.mean
        loose = setting.learned & ~setting.machine
        for block in (*setting.bodies, *_spring_blocks(setting)):
            loose[block] = False
        sd = np.sqrt(np.diag(setting.covariance))
        self._coordinates = Coordinates(setting.bodies, setting.mean, (np.eye(len(sd)) * sd)[:, loose])
        self._split = len(self._coordinates.start)
        prior = np.linalg.inv(self._coordinates.prior(setting.covariance))
        curves, curve_sd = np.zeros(0), np.zeros(0)
        if self._springs is not None:
            stiffness, offset = setting.mean[self._springs.stiffness], setting.mean[self._springs.offset]
            self._elasticity = DoubleExponential(len(stiffness))
            curves, curve_sd = self._elasticity.start(stiffness, offset), self._elasticity.sd
        self._start: Unknowns = np.concatenate([self._coordinates.start, curves])
        self._prior = np.zeros((len(self._start), len(self._start)))
        self._prior[: self._split, : self._split] = ridge * prior
        self._prior[self._split :, self._split :] = ridge * np.diag(curve_sd**-2.0)

    def solved(self) -> tuple[Parameters, Covariance | None]:
        """Parameters in the model's order, and their covariance; the start if there is no sample."""
        u = self._start
        if not self.samples:
            return self._coordinates.at(u[: self._split])[0], None
        angles = self._angles(u)
        here, damping = self._at(u, angles), DAMPING
        for _ in range(self._steps_max):
            damped = here.information + damping * np.diag(np.diag(here.information))
            trial = u - np.linalg.solve(damped, here.slope)
            there = self._at(trial, angles)
            if there.cost < here.cost:
                gained = here.cost - there.cost
                u, here, damping = trial, there, 0.2 * damping
                if gained < self._settled * here.cost:
                    break
            else:
                damping *= 10.0
                if damping > DAMPING_MAX:
                    break
        return self._published(u, here, angles)

    def _published(
        self, u: Unknowns, here: _Here, angles: Float[np.ndarray, "sample freedom"] | None
    ) -> tuple[Parameters, Covariance]:
        x, x_by_c = self._coordinates.at(u[: self._split])
        scale = 2.0 * here.cost / max(len(self.samples) * self._model.n_joints - len(u), 1)
        of_u = max(scale, 1.0) * np.linalg.inv(here.information)
        if self._springs is not None and angles is not None:
            lines = self._elasticity.straightened(u[self._split :], angles)
            x[self._springs.stiffness], x[self._springs.offset] = lines
        return x, x_by_c @ of_u[: self._split, : self._split] @ x_by_c.T

    def _angles(self, u: Unknowns) -> Float[np.ndarray, "sample freedom"] | None:
        """Arm angles along the motion at the start parameters [rad]; the elasticity hardly changes them."""
        if self._springs is None:
            return None
        self._model.restart()
        x, angles = self._coordinates.at(u[: self._split])[0], []
        for sample in self.samples:
            self._model.linearise(sample, x)
            angles.append(self._springs.angles(self._model).copy())
        return np.array(angles)

    def _at(self, u: Unknowns, angles: Float[np.ndarray, "sample freedom"] | None) -> _Here:
        """Half the sum of squares, its gradient and information."""
        x, x_by_c = self._coordinates.at(u[: self._split])
        slope, information = self._prior @ (u - self._start), self._prior.copy()
        cost = 0.5 * float((u - self._start) @ slope)
        self._model.restart()
        with np.errstate(over="ignore", invalid="ignore"):
            for i, sample in enumerate(self.samples):
                error, derivative = self._row(sample, x, x_by_c, u, None if angles is None else angles[i])
                cost += 0.5 * float(error @ error)
                slope += derivative.T @ error
                information += derivative.T @ derivative
        return _Here(cost if np.isfinite(cost) else np.inf, slope, information)

    def _row(
        self,
        sample: Sample,
        x: Parameters,
        x_by_c: Float[np.ndarray, "parameter coordinate"],
        u: Unknowns,
        z: Float[np.ndarray, " freedom"] | None,
    ) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "joint unknown"]]:
        """Return expected minus measured torque and its derivative, in units of the sample's noise [-]."""
        springs, curves = self._springs, u[self._split :]
        if springs is not None and z is not None:
            x = x.copy()
            x[springs.stiffness], x[springs.offset] = self._elasticity.tangent(curves, z)
        tau, derivative = self._model.linearise(sample, x)
        by_u = derivative @ x_by_c
        if springs is not None and z is not None:
            # Spring torque is stiffness · angle − offset: the offset's column is the negative direction of the torque.
            by_u = np.hstack([by_u, -derivative[:, springs.offset] @ self._elasticity.by_numbers(curves, z)])
        sd = np.hypot(self._sd, self._model.direction_uncertainty(sample.v))
        return (tau - sample.tau) / sd, by_u / sd[:, None]


def _spring_blocks(setting: Setting) -> tuple[slice, ...]:
    return () if setting.springs is None else (setting.springs.stiffness, setting.springs.offset)
