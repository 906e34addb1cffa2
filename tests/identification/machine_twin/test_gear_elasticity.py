"""The compliance of a gear is found where the motor has its own encoder; there its rotor parts from the links."""

import numpy as np
import pytest
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, ResidualNoise, Sweeps
from exograv.identification.machine_twin.drawing_errors import with_link_errors
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.gear_elasticity import ON_THE_MOTOR, gear_elasticity, with_wind_up
from exograv.identification.machine_twin.measured_motion import Samples

SAMPLES = 400
TRUE = np.array([5e-5, 8e-5, 6e-5, np.nan])
"""Compliances; the last joint has no encoder on its motor [rad/(N·m)]."""

NOISE_RAD = 2e-5
SIGMAS = 4.0


NOISE_NM = 0.1
NARROWER = 0.75
"""Largest ratio of a rotor's standard deviations with and without the leads of 48 s of motion [-]."""
WRONG_LINKS = 1.15
"""Inertia of the true links over that of their drawings [-]."""


@pytest.fixture
def shaken(exo: Exo) -> tuple[EmptyMachine, Fit, Samples, np.ndarray]:
    """Fit to fast motion of a machine whose links have more inertia than drawn; its samples, and its true values."""
    model, draw = EmptyMachine(exo.description, exo.tree, TWIN_PER_JOINT), np.random.default_rng(2)
    layout, t = model.prior.layout, 0.04 * np.arange(3 * SAMPLES)
    waves = (np.array([[0.5, 0.7, 0.6, 0.8], [7.0, 8.0, 9.0, 6.0]]), np.array([[0.5], [0.1]]))
    turns = waves[0] * t[:, None, None]
    q = 0.5 + np.sum(waves[1] * np.sin(turns), axis=1)
    v = np.sum(waves[1] * waves[0] * np.cos(turns), axis=1)
    a = -np.sum(waves[1] * waves[0] ** 2 * np.sin(turns), axis=1)
    true = model.prior.mean.copy()
    moments = np.arange(layout.links.stop - layout.links.start) % 10 >= 4
    true[layout.links][moments] *= WRONG_LINKS
    none = np.zeros((len(t), len(exo.description.mounts) * layout.weights))
    still = Sweeps(t, q, v, a, np.zeros_like(q), none, np.zeros(len(t), dtype=bool))
    on_links = true.copy()
    for name in ON_THE_MOTOR:
        on_links[layout.of(name)] = 0.0
    load = -model.residual(still, on_links, float(t[-1])) / true[layout.of("inverse_gain")]
    tau = -model.residual(still, true, float(t[-1])) + NOISE_NM * draw.standard_normal(q.shape)
    sweeps = Sweeps(t, q, v, a, tau / exo.description.nominal_gain, none, still.start)
    wound = TRUE * load + 1e-3 + NOISE_RAD * draw.standard_normal(q.shape)
    prior = with_link_errors(model.prior, 3.0)
    fit = model.fit(sweeps, prior, model.fit(sweeps, prior))
    return model, fit, Samples(sweeps, np.zeros(len(t), dtype=int), wound, np.full_like(q, np.nan)), true


def test_rotors_part_from_links_by_the_encoders_on_the_motors(shaken: tuple[EmptyMachine, Fit, Samples, np.ndarray]):
    model, fit, samples, true = shaken
    rotor = fit.prior.layout.of("rotor")
    found = with_wind_up(model, fit, samples)
    before, after = fit.sd[rotor], found.sd[rotor]
    assert (after[:2] < NARROWER * before[:2]).all()
    assert (np.abs(found.theta - true)[rotor] < SIGMAS * after).all()


def test_a_fit_without_encoders_on_the_motors_stays(shaken: tuple[EmptyMachine, Fit, Samples, np.ndarray]):
    model, fit, samples, _ = shaken
    unknown = np.full_like(samples.wound_up, np.nan)
    none = Samples(samples.sweeps, samples.fold, unknown, unknown)
    found = with_wind_up(model, fit, none)
    np.testing.assert_allclose(found.theta, fit.theta, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.sd, fit.sd, rtol=1e-6)


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
    found = gear_elasticity(
        model, fit, Samples(sweeps, np.zeros(SAMPLES, dtype=int), wound, np.full_like(wound, np.nan))
    )
    told = np.isfinite(found.compliance)
    assert not told[3]
    assert told[0]
    assert (np.abs(found.compliance - TRUE)[told] < SIGMAS * found.sd[told]).all()
    assert (found.sd[told] < 0.2 * found.compliance[told]).all()
