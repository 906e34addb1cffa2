"""A force sensor tells the gains of a machine without weights, and its errors are in their intervals."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, Sweeps
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.measured_motion import MeasuredMotion, samples_of
from exograv.identification.machine_twin.model_discrepancy import FORCE_SCALE_SD, Considered, DiscrepancySize

SAMPLES, NOISE_NM, FORCE_N = 3000, 0.05, 20.0
GAINS = np.array([1.06, 0.95, 1.04, 0.97])
"""True gains over those of the data sheet [-]."""

BETTER = 3.0
"""Factor by which pulling has to narrow the interval of each gain, which the drawings of the links tell alone."""

SIGMAS = 4.0


@dataclass(frozen=True)
class Pulled:
    """Samples of a machine that is pulled by a known force."""

    model: EmptyMachine
    sweeps: Sweeps

    def fitted(self, wrench: np.ndarray | None) -> Fit:
        """Fit with a measured wrench, with the errors of the sensor in the covariance."""
        sweeps = replace(self.sweeps, wrench=wrench)
        fit = self.model.fit(sweeps, self.model.prior, self.model.fit(sweeps, self.model.prior))
        none = DiscrepancySize(np.zeros(4), np.zeros(4))
        return replace(fit, covariance=Considered(self.model, sweeps).covariance(fit, none))


@pytest.fixture(scope="module")
def pulled(exo: Exo) -> Pulled:
    model = EmptyMachine(exo.description, exo.tree, TWIN_PER_JOINT, exo.description.calibration.mount)
    t, rng = 0.04 * np.arange(SAMPLES), np.random.default_rng(3)
    rates, sizes = np.array([0.5, 0.7, 0.9, 1.1]), np.array([0.6, 0.3, 0.5, 0.7])
    q = np.array([0.7, 0.4, 0.0, 1.0]) + sizes * np.sin(np.outer(t, rates))
    v, a = sizes * rates * np.cos(np.outer(t, rates)), -sizes * rates**2 * np.sin(np.outer(t, rates))
    wrench = np.hstack([FORCE_N * np.sin(np.outer(t, [0.31, 0.47, 0.39])), 0.5 * np.cos(np.outer(t, [0.3, 0.5, 0.4]))])
    hung = np.zeros((SAMPLES, len(exo.description.mounts) * model.prior.layout.weights))
    still = Sweeps(t, q, v, a, np.zeros_like(q), hung, np.zeros(SAMPLES, dtype=bool), wrench=wrench)
    theta = model.prior.mean.copy()
    theta[model.prior.layout.of("inverse_gain")] = 1.0 / GAINS
    tau = -model.residual(still, theta, float(t[-1])) + NOISE_NM * rng.standard_normal(q.shape)
    return Pulled(model, replace(still, current=tau / exo.description.nominal_gain))


def errors(pulled: Pulled, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Errors of the inverse gains and their standard deviations."""
    place = pulled.model.prior.layout.of("inverse_gain")
    return fit.theta[place] - 1.0 / GAINS, fit.sd[place]


def test_pulling_tells_every_gain_without_a_weight(pulled: Pulled):
    error, sd = errors(pulled, pulled.fitted(pulled.sweeps.wrench))
    silent = replace(pulled.sweeps, wrench=None)
    still = pulled.model.residual(silent, pulled.model.prior.mean, float(silent.t[-1]))
    with_pull = pulled.model.residual(pulled.sweeps, pulled.model.prior.mean, float(silent.t[-1]))
    # The same motion without pulls: the current that the pulls have saved is given back.
    current = silent.current - (still - with_pull) / pulled.model.description.nominal_gain
    of_weight = replace(pulled, sweeps=replace(silent, current=current)).fitted(None)
    assert (np.abs(error) < SIGMAS * sd).all()
    assert (BETTER * sd < errors(pulled, of_weight)[1]).all()


def test_the_scale_of_the_sensor_is_in_the_interval_of_every_gain(pulled: Pulled):
    wrench = pulled.sweeps.wrench
    assert wrench is not None
    error, sd = errors(pulled, pulled.fitted(wrench * (1.0 + 2.0 * FORCE_SCALE_SD)))
    assert (np.abs(error) > FORCE_SCALE_SD).all()
    assert (np.abs(error) < SIGMAS * sd).all()


def test_a_constant_wrench_passes_the_filter_of_the_samples():
    t = 0.001 * np.arange(3000)
    q = 0.5 * np.sin(np.outer(t, [2.0, 2.0, 2.0, 2.0]))
    nothing, wrench = np.zeros_like(q), np.tile([1.0, -2.0, 3.0, 0.1, 0.2, -0.3], (len(t), 1))
    pulled = MeasuredMotion("pulled", t, q, nothing, nothing, np.zeros((len(t), 1)), wrench=wrench)
    free = MeasuredMotion("free", t, q, nothing, nothing, np.zeros((len(t), 1)))
    found = samples_of((pulled, free)).sweeps.wrench
    assert found is not None
    of_pulled = samples_of((pulled,)).sweeps.t.shape[0]
    np.testing.assert_allclose(found[of_pulled // 2 : of_pulled], wrench[: of_pulled - of_pulled // 2], rtol=1e-3)
    np.testing.assert_array_equal(found[of_pulled:], 0.0)
    assert samples_of((free,)).sweeps.wrench is None
