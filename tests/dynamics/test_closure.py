"""The closed posture has the stated derivatives, and one Newton step per tick keeps it closed."""

from itertools import pairwise

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step, velocity_bias
from exograv.model.loops import FIT, LoopSolver

DERIVATIVE_TOLERANCE = 1e-8  # -: fourth-order differences of postures that are closed to 1e-14 rad
BIAS_TOLERANCE = 1e-7  # rad/s²: the same of G·v, of size 10
STEP = 5e-4
SLOPE_LEFT_Nm = 1e-8  # a thousandth of the effect of one encoder step
DT = 1e-3


@pytest.fixture(scope="module")
def step(assembly) -> kernel.Kernel:
    cuffs = cuff_energy(assembly)
    y, z, fit, v = ca.SX.sym("y", 4), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT)), ca.SX.sym("v", 4)
    closed = closure(cuffs, y, newton_step(cuffs, y, z, fit), fit)
    bias = velocity_bias(cuffs, closed, y, fit, v)
    outputs = [closed.z, closed.G, closed.slope, closed.strain, bias, closed.pivot, closed.H]
    names = ["z_closed", "G", "slope", "strain", "bias", "pivot", "H"]
    return kernel.compile(ca.Function("step", [y, z, fit, v], outputs, ["y", "z", "fit", "v"], names))


def closed_at(step: kernel.Kernel, y: np.ndarray, z: np.ndarray, fit: np.ndarray, v: np.ndarray):
    """Outputs after Newton's method has converged."""
    for _ in range(4):
        z = step.of(y, z, fit, v)[0]
    return step.of(y, z, fit, v)


def derivative(function, direction: np.ndarray) -> np.ndarray:
    """Fourth-order central difference along a direction."""
    near = function(STEP * direction) - function(-STEP * direction)
    far = function(2 * STEP * direction) - function(-2 * STEP * direction)
    return (8 * near - far) / (12 * STEP)


def postures(assembly, count: int) -> np.ndarray:
    lower, upper = assembly.description.workspace
    return np.random.default_rng(0).uniform(lower, upper, (count, 4))


def test_G_is_the_derivative_of_the_posture(assembly, fit, step):
    solver, v = LoopSolver(assembly), np.zeros(4)
    for y in postures(assembly, 6):
        z = solver.solve(y, fit=fit)[0]
        G = closed_at(step, y, z, fit, v)[1]
        moved = [derivative(lambda d, y=y, z=z: closed_at(step, y + d, z, fit, v)[0], e) for e in np.eye(4)]
        np.testing.assert_allclose(G, np.column_stack(moved), atol=DERIVATIVE_TOLERANCE)


def test_the_velocity_bias_is_the_rate_of_G_times_velocity(assembly, fit, step):
    solver, generator = LoopSolver(assembly), np.random.default_rng(1)
    for y in postures(assembly, 6):
        v = generator.uniform(-3.0, 3.0, 4)
        z = solver.solve(y, fit=fit)[0]
        bias = closed_at(step, y, z, fit, v)[4]
        rate = derivative(lambda d, y=y, z=z, v=v: closed_at(step, y + d, z, fit, v)[1] @ v, v)
        np.testing.assert_allclose(bias, rate, atol=BIAS_TOLERANCE)


def test_the_strain_is_the_derivative_of_the_least_energy(assembly, fit, step):
    cuffs = cuff_energy(assembly)
    energy = ca.Function("energy", [cuffs.y, cuffs.z, cuffs.fit], [cuffs.energy])
    solver, v = LoopSolver(assembly), np.zeros(4)
    for y in postures(assembly, 4):
        z = solver.solve(y, fit=fit)[0]

        def least(d: np.ndarray, y: np.ndarray = y, z: np.ndarray = z) -> np.ndarray:
            return np.array([float(energy(y + d, closed_at(step, y + d, z, fit, v)[0], fit))])

        strain = closed_at(step, y, z, fit, v)[3]
        np.testing.assert_allclose(strain, [derivative(least, e)[0] for e in np.eye(4)], atol=DERIVATIVE_TOLERANCE)


def test_predictor_and_one_newton_step_keep_the_loops_closed_at_three_radians_per_second(assembly, fit, step):
    lower, upper = assembly.description.workspace
    centre, reach = (lower + upper) / 2, (upper - lower) / 2
    t = np.arange(3000)[:, None] * DT
    path = centre + reach * np.sin(3.0 / reach * t + [0.0, 1.0, 2.0, 3.0])
    none = np.zeros(4)
    z, G = LoopSolver(assembly).solve(path[0], fit=fit)[0], np.zeros((4, 4))
    z, G = closed_at(step, path[0], z, fit, none)[:2]
    worst = 0.0
    for before, y in pairwise(path):
        z, G, slope = step.of(y, z + G @ (y - before), fit, none)[:3]
        worst = max(worst, float(np.abs(slope).max()))
    assert np.abs(np.diff(path, axis=0)).max() > 2.9 * DT
    assert worst < SLOPE_LEFT_Nm


def test_an_aligned_arm_moves_as_the_machine_does(assembly, step):
    none = np.zeros(len(FIT))
    for y in postures(assembly, 6):
        z, G, slope, strain, bias, _, _ = closed_at(step, y, y, none, np.full(4, 2.0))
        np.testing.assert_allclose(z, y, atol=1e-10)
        np.testing.assert_allclose(G, np.eye(4), atol=1e-9)
        for zero in (slope, strain, bias):
            np.testing.assert_allclose(zero, 0.0, atol=1e-9)


def test_nothing_is_strained_where_the_cuffs_were_fastened(assembly, fit, step):
    donning = assembly.description.donning_posture
    z, _, slope, strain, _, _, _ = closed_at(step, donning, donning, fit, np.zeros(4))
    np.testing.assert_allclose(z, donning, atol=1e-12)
    np.testing.assert_allclose(slope, 0.0, atol=1e-10)
    np.testing.assert_allclose(strain, 0.0, atol=1e-10)


def test_the_gauss_newton_hessian_would_be_wrong(assembly, fit, step):
    # It differs from the full Hessian if cuffs are strained; G computed with it had errors of up to 0.3 per entry.
    solver, worst = LoopSolver(assembly), 0.0
    for y in postures(assembly, 20):
        z, G, *_, H = closed_at(step, y, solver.solve(y, fit=fit)[0], fit, np.zeros(4))
        G_gauss_newton = np.linalg.solve(solver.gauss_newton_hessian(y, z, fit), H @ G)
        worst = max(worst, float(np.abs(G_gauss_newton - G).max()))
    assert worst > 0.05


def test_a_broken_position_is_seen_in_every_output(fit, step):
    z, G, slope, strain, _, _, _ = step.of([np.nan, 0.3, 0.1, 1.0], [0.5, 0.3, 0.1, 1.0], fit, np.zeros(4))
    for output in (z, G, slope, strain):
        assert np.isnan(output).any()
