"""Projections fulfil their equations, approach the solution of consistent ones, and average inconsistent ones."""

import numpy as np

from exograv.identification.baselines.kaczmarz import Kaczmarz, tail_average
from exograv.identification.baselines.nlms import Nlms

RNG = np.random.default_rng(5)
A, SOLUTION = RNG.standard_normal((12, 4)), RNG.standard_normal(4)


def test_one_equation_is_met_exactly():
    xi, _ = tail_average(A[:1], np.array([2.0]), np.zeros(4), np.random.default_rng(0))
    np.testing.assert_allclose(A[0] @ xi, 2.0)


def test_the_distance_to_the_solution_never_grows():
    xi, generator, before = np.zeros(4), np.random.default_rng(0), np.inf
    for _ in range(20):
        xi, _ = tail_average(A, A @ SOLUTION, xi, generator)
        distance = float(np.linalg.norm(xi - SOLUTION))
        assert distance <= before + 1e-12
        before = distance
    assert before < 1e-6


def test_equations_that_contradict_each_other_are_averaged():
    rows, y = np.ones((2, 1)), np.array([0.0, 1.0])
    generator, tails, xi = np.random.default_rng(0), [], np.zeros(1)
    for _ in range(200):
        xi, tail = tail_average(rows, y, xi, generator)
        assert min(abs(xi[0]), abs(xi[0] - 1.0)) < 1e-12
        tails.append(tail[0])
    np.testing.assert_allclose(np.mean(tails), 0.5, atol=0.05)


def test_without_noise_the_windows_error_falls(linear_setting, linear_stream):
    setting = linear_setting()
    samples = linear_stream(setting, np.linspace(-1.0, 1.0, 11), seconds=16.0)
    method = Kaczmarz(setting, window_s=4.0, ridge=1e-6)
    for sample in samples:
        method.update(sample)
    before = np.abs(samples[-1].tau - setting.model.linearise(samples[-1], setting.mean)[0]).max()
    left = np.abs(samples[-1].tau - setting.model.linearise(samples[-1], method.estimate().x)[0]).max()
    assert left < 0.5 * before


def test_the_whole_step_of_nlms_meets_the_last_joints_equation(linear_setting, linear_stream):
    # Torques so large that the noise is negligible.
    setting = linear_setting(scale=1e4)
    sample = linear_stream(setting, 0.5 * np.ones(11))[0]
    method = Nlms(setting, share=1.0)
    method.update(sample)
    tau, _ = setting.model.linearise(sample, method.estimate().x)
    np.testing.assert_allclose(tau[-1], sample.tau[-1], rtol=1e-6)


def test_a_share_of_nothing_leaves_nlms_where_it_was(linear_setting, linear_stream):
    setting = linear_setting()
    method = Nlms(setting, share=0.0)
    for sample in linear_stream(setting, np.ones(11)):
        method.update(sample)
    np.testing.assert_array_equal(method.estimate().x, setting.mean)
