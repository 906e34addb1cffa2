"""No method has a lower cost than the oracle, and the oracle publishes only possible bodies."""

import numpy as np
import pytest

from exograv.identification.baselines.oracle import OracleMethod
from exograv.identification.core.interface import Sample
from exograv.identification.methods import built
from exograv.model.tree import is_physical

ROUNDING = 1e-3
"""Distance of the projection's barrier from the boundary of the cone, in half squared standard deviations."""


def after(name: str, setting, samples: list[Sample]) -> np.ndarray:
    method = built(name, setting)
    for sample in samples:
        method.update(sample)
    return method.estimate().x


@pytest.mark.parametrize("off", [0.5, -3.0, -9.0])
def test_no_other_method_has_a_lower_cost(linear_setting, linear_stream, off: float):
    setting = linear_setting()
    samples = linear_stream(setting, off * np.eye(11)[4] + 0.5, noise_seed=2)
    oracle = OracleMethod(setting)
    for sample in samples:
        oracle.update(sample)
    x = oracle.estimate().x
    assert is_physical(x[:10])
    for name in ("recursive", "ekf", "least-squares", "gradient-full", "gradient-prior", "adam"):
        assert oracle.cost(x) <= oracle.cost(after(name, setting, samples)) + ROUNDING
    assert oracle.cost(x) <= oracle.cost(setting.mean)


def test_its_covariance_is_no_larger_than_the_priors(linear_setting, linear_stream):
    setting = linear_setting()
    oracle = OracleMethod(setting)
    for sample in linear_stream(setting, np.zeros(11), noise_seed=3):
        oracle.update(sample)
    assert (oracle.estimate().sd <= np.sqrt(np.diag(setting.covariance)) + 1e-12).all()


def test_an_outlier_hardly_moves_it(linear_setting, linear_stream):
    setting = linear_setting()
    samples = linear_stream(setting, np.zeros(11), noise_seed=4)
    found = []
    for push in (0.0, 20.0):
        samples[40].tau = samples[40].tau + push
        found.append((after("oracle", setting, samples) - setting.mean) / np.sqrt(np.diag(setting.covariance)))
    assert np.abs(found[0] - found[1]).max() < 0.2
