"""Each descent follows its rule: plain by the gradient, Adam by its sign, the third scaled by the prior."""

from dataclasses import replace

import numpy as np

from exograv.identification.baselines.adam import Adam
from exograv.identification.baselines.descent import Descent
from exograv.identification.baselines.gradient_full import GradientFull
from exograv.identification.baselines.gradient_prior import GradientPrior

OFF = np.array([1.0, -0.5, 0.8, 0.3, 0.2, 0.1, 0.0, 0.0, 0.1, 0.2, 1.0])


def test_the_slope_is_that_of_finite_differences(linear_setting, linear_stream):
    setting = linear_setting()
    sample = linear_stream(setting, OFF)[3]
    descent = Descent(setting)
    slope, start, step = descent.slope(sample), descent.c.copy(), 1e-6
    assert slope is not None
    for i in range(len(start)):
        halves = []
        for side in (-step, step):
            descent.c = start + side * np.eye(len(start))[i]
            error, _ = descent.error(sample)
            halves.append(0.5 * error @ error)
        np.testing.assert_allclose((halves[1] - halves[0]) / (2 * step), slope[i], rtol=1e-5, atol=1e-6)


def test_a_torque_that_the_model_cannot_tell_moves_nothing(linear_setting, linear_stream):
    setting = linear_setting()
    setting.model.direction_uncertainty = lambda _v: np.array([1e9, 1e9])
    method = GradientFull(setting, step=1e-3)
    for sample in linear_stream(setting, OFF):
        method.update(sample)
    np.testing.assert_allclose(method.estimate().x, setting.mean, atol=1e-9)


def test_plain_descent_moves_by_the_slope_times_the_step(linear_setting, linear_stream):
    setting = linear_setting(has_body=False)
    sample = linear_stream(setting, OFF)[0]
    slope = Descent(setting).slope(sample)
    method = GradientFull(setting, step=1e-4)
    method.update(sample)
    assert slope is not None
    np.testing.assert_allclose(method.estimate().x, setting.mean - 1e-4 * slope, atol=1e-12)


def test_adam_does_not_ask_how_large_the_loss_is(linear_setting, linear_stream):
    found = []
    for scale in (1.0, 100.0):
        setting = linear_setting(scale=scale)
        method = Adam(setting, rate=1e-2)
        for sample in linear_stream(setting, OFF):
            method.update(sample)
        found.append(method.estimate().x)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_adams_first_step_is_its_rate_in_every_direction_that_has_a_slope(linear_setting, linear_stream):
    setting = linear_setting(has_body=False)
    sample = linear_stream(setting, OFF)[0]
    method = Adam(setting, rate=1e-2)
    method.update(sample)
    slope = Descent(setting).slope(sample)
    moved = (method.estimate().x - setting.mean) / np.sqrt(np.diag(setting.covariance))
    assert slope is not None
    steep = np.abs(slope) > 1e-3 * np.abs(slope).max()
    np.testing.assert_allclose(moved[steep], -1e-2 * np.sign(slope[steep]), rtol=1e-3)


def test_with_a_round_prior_and_unit_noise_the_priors_scale_changes_nothing(linear_setting, linear_stream):
    setting = linear_setting(has_body=False)
    noise = replace(setting.noise, sd=np.ones(2))
    setting = replace(setting, covariance=np.eye(11), noise=noise)
    plain, scaled = GradientFull(setting, step=1e-4), GradientPrior(setting, step=1e-4)
    for sample in linear_stream(setting, OFF):
        plain.update(sample)
        scaled.update(sample)
    np.testing.assert_allclose(plain.estimate().x, scaled.estimate().x, rtol=1e-9)


def test_what_the_prior_knows_does_not_move(linear_setting, linear_stream):
    setting = linear_setting(has_body=False)
    covariance = setting.covariance.copy()
    covariance[10, 10] = 0.0
    method = GradientPrior(replace(setting, covariance=covariance), step=1e-4)
    for sample in linear_stream(setting, OFF):
        method.update(sample)
    x = method.estimate().x
    assert x[10] == setting.mean[10]
    assert (x[1:4] != setting.mean[1:4]).all()
