"""The gradients for the optimiser are correct; a design keeps every limit and is never worse than its start."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.excitation.basis import forth_and_back, harmonic
from exograv.identification.excitation.information import gram
from exograv.identification.excitation.optimiser import solve
from exograv.identification.excitation.problem import MotionProblem

SLOPE_TOLERANCE = 0.02
"""Relative tolerance: gradients of the regressor are forward differences over 1e-3 rad with a warm-started closure."""

FINE = 4000
"""Points of a period at which a design is checked: 200 between those of the constraints."""


def start_of(problem: MotionProblem, seed: int = 0) -> np.ndarray:
    drawn = 0.3 * np.random.default_rng(seed).standard_normal(problem.shape)
    drawn[0] = 0.5 * (problem.limits.lower + problem.limits.upper)
    return problem.fitted(drawn)


def test_slopes_of_the_predicted_left_over_agree_with_differences(make_problem: Callable[..., MotionProblem]):
    problem = make_problem(harmonic(20.0, 2))
    start = start_of(problem)
    _, slope = problem.slope(start, problem.follow(start, slopes=True))
    for seed in range(3):
        way = 1e-4 * np.random.default_rng(seed).standard_normal(start.shape)
        change = 0.5 * (problem.value(start + way) - problem.value(start - way))
        assert float((slope * way).sum()) == pytest.approx(change, rel=SLOPE_TOLERANCE, abs=2e-6)


@pytest.mark.slow
def test_a_design_is_better_than_its_start_and_the_same_every_time(make_problem: Callable[..., MotionProblem]):
    problem = make_problem(harmonic(20.0, 2))
    start = start_of(problem)
    designs = [solve(problem, start, 6, np.inf) for _ in range(2)]
    assert problem.value(designs[0]) < 0.98 * problem.value(start)
    np.testing.assert_array_equal(designs[0], designs[1])


def test_without_an_iteration_the_start_comes_back(make_problem: Callable[..., MotionProblem]):
    problem = make_problem(harmonic(20.0, 2))
    start = start_of(problem)
    assert problem.value(solve(problem, start, 0, np.inf)) <= problem.value(start)


@pytest.mark.parametrize("make_basis", [harmonic, forth_and_back])
def test_a_design_keeps_posture_speed_acceleration_comfort_and_torque_between_samples_too(
    make_problem: Callable[..., MotionProblem], make_basis
):
    problem = make_problem(make_basis(20.0, 2))
    design = solve(problem, start_of(problem, 1), 5, np.inf)
    path = problem.basis.trajectory(design, 20.0, 20.0 / FINE)
    assert not problem.limits.broken_by_motion(path.q, path.v, path.a).any()
    between = make_problem(problem.basis, samples=93)
    seen = between.follow(design, slopes=False)
    # The arm's limits are constrained at every fourth sample, and between them exceeded by a degree.
    assert not problem.limits.broken_by_arm(seen.z, seen.tau, slack=np.deg2rad(2.0))


def test_a_random_motion_is_squeezed_into_the_limits(make_problem: Callable[..., MotionProblem]):
    problem = make_problem(harmonic(20.0, 5))
    wild = 3.0 * np.random.default_rng(0).standard_normal(problem.shape)
    assert not problem.keeps_limits(wild)
    assert problem.keeps_limits(problem.fitted(wild))


def test_the_field_of_errors_sets_a_floor_under_what_passing_again_can_tell(make_problem: Callable[..., MotionProblem]):
    problem = make_problem(harmonic(20.0, 2))
    start = start_of(problem)
    seen = problem.follow(start, slopes=False)
    none = replace(problem.statistics, field_sd=np.zeros(4))
    floors, falls = (
        [replace(problem, passes=(m,), statistics=given).value(start, seen) for m in (1.0, 30.0, 3000.0)]
        for given in (problem.statistics, none)
    )
    assert falls[0] > falls[1] > falls[2]
    assert floors[2] > 0.5 * floors[0]
    assert all(floor > fall for floor, fall in zip(floors, falls, strict=True))


def test_left_over_is_a_quadratic_form_of_the_covariance(
    make_problem: Callable[..., MotionProblem], prediction: LeftOverPrediction, model: ArmModel
):
    A = gram(prediction, model.n_parameters)
    half = np.random.default_rng(0).standard_normal((model.n_parameters, 60))
    covariance: Parameters = half @ half.T
    expected = prediction.rms(covariance) ** 2
    np.testing.assert_allclose(np.einsum("jik,ki->j", A, covariance), expected, rtol=1e-6)
