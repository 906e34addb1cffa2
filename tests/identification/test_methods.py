"""Every method meets the same battery: possible bodies, its own clock, no hidden ties to its samples, one result."""

import numpy as np
import pytest

from exograv.identification.arm_model import ArmModel
from exograv.identification.interface import Method, Sample
from exograv.identification.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.tree import is_physical
from exograv.session.identify import build_method, identification_motion, table_guess
from exograv.session.names import MethodName
from exograv.session.nominal import nominal_machine

METHODS = ("recursive", "gradient", "anthropometric")
PERIOD_S, SECONDS = 0.02, 6.0


@pytest.fixture(scope="module")
def arm():
    """Assembly and machine."""
    assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
    return assembly, nominal_machine(assembly.description, assembly.exo.phi)


@pytest.fixture(scope="module")
def samples(arm) -> list[Sample]:
    """A heavier arm than the table's, with noise."""
    assembly, machine = arm
    model, noise = ArmModel(assembly, machine), np.random.default_rng(0)
    x = table_guess(assembly, machine)
    x[:20] *= 1.2
    path = identification_motion(assembly, SECONDS, PERIOD_S)
    made = []
    for k in range(len(path)):
        sample = Sample(PERIOD_S * (k + 1), path.q[k], path.v[k], path.a[k], np.zeros(4))
        sample.tau = model.linearise(sample, x)[0] + noise.normal(0.0, 0.1, 4)
        made.append(sample)
    return made


@pytest.fixture
def method(request, arm) -> Method:
    return build_method(request.param, *arm)


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
def test_every_estimate_is_possible_and_of_the_newest_sample(method: Method, samples: list[Sample]):
    for k, sample in enumerate(samples):
        method.update(sample)
        if k % 10 == 0:
            estimate = method.estimate()
            assert estimate.t == sample.t
            assert is_physical(estimate.x[:10])
            assert is_physical(estimate.x[10:20])
            if estimate.covariance is not None:
                np.testing.assert_allclose(estimate.covariance, estimate.covariance.T, atol=1e-12)
                assert (np.diag(estimate.covariance) >= 0.0).all()


@pytest.mark.parametrize("name", METHODS)
def test_the_same_samples_give_the_same_estimate_also_when_their_memory_is_used_again(name: MethodName, arm, samples):
    own, shared = build_method(name, *arm), build_method(name, *arm)
    buffer = Sample(0.0, *(np.zeros(4) for _ in range(4)))
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
