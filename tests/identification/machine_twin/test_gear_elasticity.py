"""The compliance of a gear is found where the motor has its own encoder, and nowhere else."""

import numpy as np
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, ResidualNoise, Sweeps
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.gear_elasticity import ON_THE_MOTOR, gear_elasticity
from exograv.identification.machine_twin.measured_motion import Samples

SAMPLES = 400
TRUE = np.array([5e-5, 8e-5, 6e-5, np.nan])
"""Compliances; the last joint has no encoder on its motor [rad/(N·m)]."""

NOISE_RAD = 2e-5
SIGMAS = 4.0


def test_the_compliance_is_within_its_interval_and_unknown_without_an_encoder(exo: Exo):
    model, draw = EmptyMachine(exo.description, exo.tree, TWIN_PER_JOINT), np.random.default_rng(1)
    prior, t = model.prior, 0.04 * np.arange(SAMPLES)
    q = 0.8 * np.sin(np.outer(t, [0.5, 0.7, 0.6, 0.8])) + 0.4
    none = np.zeros((SAMPLES, len(exo.description.mounts) * prior.layout.weights))
    still = np.zeros((SAMPLES, 4))
    sweeps = Sweeps(t, q, still, still, still, none, np.zeros(SAMPLES, dtype=bool))
    theta = prior.mean.copy()
    for name in ON_THE_MOTOR:
        theta[prior.layout.of(name)] = 0.0
    load = -model.residual(sweeps, theta, float(t[-1])) / theta[prior.layout.of("inverse_gain")]
    wound = TRUE * load + 1e-3 + NOISE_RAD * draw.standard_normal(q.shape)
    noise = ResidualNoise(np.full(4, 0.1), np.full(4, 0.04))
    fit = Fit(prior, prior.mean, 1e-4 * prior.covariance, noise, noise)
    found = gear_elasticity(model, fit, Samples(sweeps, np.zeros(SAMPLES, dtype=int), wound))
    told = np.isfinite(found.compliance)
    assert not told[3]
    assert told[0]
    assert (np.abs(found.compliance - TRUE)[told] < SIGMAS * found.sd[told]).all()
    assert (found.sd[told] < 0.2 * found.compliance[told]).all()
