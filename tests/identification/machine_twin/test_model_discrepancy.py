"""A systematic error widens the intervals of a fit, and white noise of the stated size does not."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, Sweeps
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.model_discrepancy import Considered, DiscrepancySize

SAMPLES, NOISE_NM = 2000, 0.05
HELD = np.arange(SAMPLES) // 125 % 5 == 4
WAVE = 0.03
"""Amplitude of a gain's wave along the angle [-]."""

NEAR = 2.0
"""Factor within which the size of an error has to be found."""

SIGMAS = 4.0

BY_CHANCE = 0.7
"""Size over the noise that chance shows: the mean square of 350 held-out samples is off by 3 · √(2 / 350) = 23 %, and
at least half of a field is seen."""


@dataclass(frozen=True)
class Simulated:
    """Samples of a machine with the values of its data sheet, without noise."""

    model: EmptyMachine
    sweeps: Sweeps

    def fitted(self, current: np.ndarray) -> tuple[Fit, DiscrepancySize, np.ndarray]:
        """Fit of all samples, size of the discrepancy, and covariance with it."""
        sweeps = replace(self.sweeps, current=current)
        seen = replace(
            sweeps, **{name: getattr(sweeps, name)[~HELD] for name in ("t", "q", "v", "a", "current", "hung", "start")}
        )
        prior, considered = self.model.prior, Considered(self.model, sweeps)
        before, fit = (self.model.fit(one, prior, self.model.fit(one, prior)) for one in (seen, sweeps))
        size = considered.size(before, ~HELD, np.full(4, NOISE_NM), float(seen.t[-1]))
        return fit, size, considered.covariance(fit, size)


@pytest.fixture(scope="module")
def simulated(exo: Exo) -> Simulated:
    model = EmptyMachine(exo.description, exo.tree, TWIN_PER_JOINT)
    t = 0.04 * np.arange(SAMPLES)
    rates, sizes = np.array([0.5, 0.7, 0.9, 1.1]), np.array([0.6, 0.3, 0.5, 0.7])
    q = np.array([0.7, 0.4, 0.0, 1.0]) + sizes * np.sin(np.outer(t, rates))
    v, a = sizes * rates * np.cos(np.outer(t, rates)), -sizes * rates**2 * np.sin(np.outer(t, rates))
    hung = np.zeros((SAMPLES, len(exo.description.mounts) * model.prior.layout.weights))
    hung[SAMPLES // 2 :, 0] = 1.0
    still = Sweeps(t, q, v, a, np.zeros_like(q), hung, np.zeros(SAMPLES, dtype=bool))
    current = -model.residual(still, model.prior.mean, float(t[-1])) / exo.description.nominal_gain
    return Simulated(model, replace(still, current=current))


def noisy(simulated: Simulated, current: np.ndarray) -> np.ndarray:
    noise = np.random.default_rng(2).standard_normal(current.shape)
    return current + NOISE_NM * noise / simulated.model.description.nominal_gain


def test_white_noise_of_the_stated_size_widens_little(simulated: Simulated):
    fit, size, covariance = simulated.fitted(noisy(simulated, simulated.sweeps.current))
    assert (size.additive_Nm < BY_CHANCE * NOISE_NM).all()
    assert (np.diag(covariance) >= np.diag(fit.covariance)).all()


def test_a_gain_that_depends_on_the_angle_widens_the_interval_of_the_gain(simulated: Simulated):
    wave = 1.0 + WAVE * np.sin(2.0 * simulated.sweeps.q)
    fit, size, covariance = simulated.fitted(noisy(simulated, simulated.sweeps.current * wave))
    gains = fit.prior.layout.of("inverse_gain")
    # Over a part of a wave, the motion shows only the mean of this part.
    error = np.abs(fit.theta[gains] - wave.mean(axis=0))
    assert size.proportional[0] > WAVE / np.sqrt(2.0) / NEAR
    assert (error < SIGMAS * np.sqrt(np.diag(covariance)[gains])).all()
    assert (np.diag(covariance)[gains] > np.diag(fit.covariance)[gains])[0]
