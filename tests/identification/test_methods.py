"""Every method passes the same tests: possible bodies, correct time, no references to samples, repeatable results."""

from typing import get_args

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Method, Sample
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.tree import is_physical
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import build_method, table_guess
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.identification.method_names import MethodName

METHODS: tuple[MethodName, ...] = get_args(MethodName)
UNPROJECTED = ("nlms", "kaczmarz", "rls")
"""Methods without a constraint to possible bodies. They publish impossible bodies too; the controller refuses these."""

LEFT_AFTER: dict[MethodName, float] = {
    "recursive": 0.1,
    "gradient-full": 0.95,
    "adam": 0.5,
    "gradient-prior": 0.8,
    "nlms": 0.9,
    "kaczmarz": 0.5,
    "rls": 0.3,
    "ekf": 0.3,
    "least-squares": 0.12,  # its ridge holds the unknowns near the prior; with the axis of the elbow there are two more
    "oracle": 0.1,
}
"""Largest share of the torque error that remains after 6 s, for a noise-free arm of the method's own model. `gradient`
has another model and its own test; the other methods learn nothing from motion."""

PERIOD_S, SECONDS = 0.02, 6.0


@pytest.fixture(scope="module")
def arm():
    """Return assembly and machine."""
    assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
    return assembly, nominal_machine(assembly.description, assembly.exo.phi)


@pytest.fixture(scope="module")
def model(arm) -> ArmModel:
    """Model, compiled once; each method uses a copy of it."""
    return ArmModel(*arm)


def stream(arm, model: ArmModel, x: np.ndarray, noise_Nm: float) -> list[Sample]:
    """Samples of the model along the machine's motion."""
    noise, other = np.random.default_rng(0), model.again()
    path = identification_motion(arm[0], SECONDS, PERIOD_S)
    made = []
    for k in range(len(path)):
        sample = Sample(PERIOD_S * (k + 1), path.q[k], path.v[k], path.a[k], np.zeros(4))
        sample.tau = other.linearise(sample, x)[0] + noise.normal(0.0, noise_Nm, 4)
        made.append(sample)
    return made


@pytest.fixture(scope="module")
def samples(arm, model: ArmModel) -> list[Sample]:
    """Samples of an arm heavier than the table's, with noise."""
    x = table_guess(*arm)
    x[:20] *= 1.2
    return stream(arm, model, x, 0.1)


@pytest.fixture
def method(request, arm, model: ArmModel) -> Method:
    return build_method(request.param, *arm, model=model.again())


@pytest.mark.parametrize("method", METHODS, indirect=True)
def test_it_is_a_method(method: Method):
    assert isinstance(method, Method)
    assert method.name in METHODS


@pytest.mark.parametrize("method", METHODS, indirect=True)
def test_before_the_first_sample_it_knows_a_possible_arm(method: Method):
    estimate = method.estimate()
    assert estimate.t == 0.0
    assert np.isfinite(estimate.x).all()
    assert is_physical(estimate.x[:10])
    assert is_physical(estimate.x[10:20])


@pytest.mark.parametrize("method", METHODS, indirect=True)
def test_every_estimate_is_of_the_newest_sample_and_possible_where_the_method_knows_what_that_is(
    method: Method, samples: list[Sample]
):
    every = 100 if getattr(method, "offline", False) else 10
    for k, sample in enumerate(samples):
        method.update(sample)
        if k % every == 0:
            estimate = method.estimate()
            assert estimate.t == sample.t
            assert np.isfinite(estimate.x).all()
            if method.name not in UNPROJECTED:
                assert is_physical(estimate.x[:10])
                assert is_physical(estimate.x[10:20])
            if estimate.covariance is not None:
                np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)
                assert (np.diag(estimate.covariance) >= 0.0).all()


@pytest.mark.parametrize("name", METHODS)
def test_the_same_samples_give_the_same_estimate_also_when_their_memory_is_used_again(
    name: MethodName, arm, model: ArmModel, samples: list[Sample]
):
    own, shared = (build_method(name, *arm, model=model.again()) for _ in range(2))
    buffer = Sample(0.0, np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4))
    for sample in samples[:150]:
        own.update(sample)
        buffer.t = sample.t
        for field in ("q", "v", "a", "tau"):
            getattr(buffer, field)[:] = getattr(sample, field)
        shared.update(buffer)
    np.testing.assert_array_equal(own.estimate().x, shared.estimate().x)


@pytest.mark.parametrize("method", METHODS, indirect=True)
def test_an_estimate_is_not_changed_by_what_is_learned_later(method: Method, samples: list[Sample]):
    for sample in samples[:60]:
        method.update(sample)
    early = method.estimate()
    noted = early.x.copy()
    for sample in samples[60:120]:
        method.update(sample)
    method.estimate()
    np.testing.assert_array_equal(early.x, noted)


def test_the_prior_is_symmetric_and_positive_semidefinite(arm):
    mean, covariance = prior(*arm)
    np.testing.assert_allclose(covariance, covariance.T, atol=1e-15)
    sd = np.sqrt(np.diag(covariance))
    scaled = covariance / np.outer(sd, sd) if (sd > 0).all() else covariance
    assert np.linalg.eigvalsh(scaled).min() > -1e-9
    assert is_physical(mean[:10])


def test_the_table_alone_never_learns(arm, samples: list[Sample]):
    method = build_method("anthropometric", *arm)
    before = method.estimate()
    for sample in samples[:50]:
        method.update(sample)
    np.testing.assert_array_equal(method.estimate().x, before.x)
    np.testing.assert_array_equal(method.estimate().covariance, prior(*arm)[1])


@pytest.mark.parametrize("name", LEFT_AFTER)
def test_without_noise_it_comes_nearer_to_an_arm_of_its_own_model(name: MethodName, arm, model: ArmModel):
    mean, _ = prior(*arm)
    x = mean.copy()
    x[:20] *= 1.2
    clean, method = stream(arm, model, x, 0.0), build_method(name, *arm, model=model.again())
    before = error_rms(model, mean, clean)
    for sample in clean:
        method.update(sample)
    assert error_rms(model, method.estimate().x, clean) < LEFT_AFTER[name] * before


def error_rms(model: ArmModel, x: np.ndarray, samples: list[Sample]) -> float:
    other = model.again()
    errors = [sample.tau - other.linearise(sample, x)[0] for sample in samples]
    return float(np.sqrt(np.mean(np.square(errors))))
