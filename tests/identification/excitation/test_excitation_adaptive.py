"""The next piece of motion is more informative than the last one repeated, and keeps all limits."""

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.identification.excitation import adaptive
from exograv.identification.excitation.adaptive import PIECE_S, Planner
from exograv.identification.excitation.limits import MotionLimits
from exograv.model.assembly import Assembly

DT = 0.01


@pytest.fixture(scope="module", autouse=True)
def small():
    """Reduce the size of the search: runtime shape checks make the model a hundred times slower."""
    with pytest.MonkeyPatch.context() as patch:
        for name, size in (("LIBRARY", 6), ("POLISH_ITERATIONS", 1), ("SAMPLES", 20)):
            patch.setattr(adaptive, name, size)
        yield


@pytest.fixture(scope="module")
def planner(assembly: Assembly, machine: CalibratedMachine, prediction: LeftOverPrediction, model: ArmModel) -> Planner:
    return Planner(assembly, machine, prediction, model.again())


def test_the_next_piece_tells_more_than_the_last_one_again(
    assembly: Assembly, machine: CalibratedMachine, planner: Planner, prediction: LeftOverPrediction
):
    mean, covariance = prior(assembly, machine)
    first = planner.next_motion(covariance, planner.home, mean, DT, seed=0)
    known = planner.after(covariance, first.path, mean)
    second = planner.next_motion(known, planner.home, mean, DT, seed=1)
    planned, again = (prediction.rms(planner.after(known, path, mean)) for path in (second.path, first.path))
    assert np.linalg.norm(planned) < 0.95 * np.linalg.norm(again)
    assert np.all(prediction.rms(known) < prediction.rms(covariance))


@pytest.mark.slow
def test_a_motion_under_way_counts_as_if_it_were_over(assembly: Assembly, machine: CalibratedMachine, planner: Planner):
    mean, covariance = prior(assembly, machine)
    first = planner.next_motion(covariance, planner.home, mean, DT, seed=0).path
    told = planner.next_motion(planner.after(covariance, first, mean), planner.home, mean, DT, seed=1)
    early = planner.next_motion(covariance, planner.home, mean, DT, seed=1, under_way=first)
    np.testing.assert_allclose(early.path.q, told.path.q, atol=1e-9)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_piece_goes_from_rest_to_rest_at_its_posture_within_the_limits(
    assembly: Assembly, machine: CalibratedMachine, planner: Planner, seed: int
):
    mean, covariance = prior(assembly, machine)
    limits = MotionLimits.of(assembly)
    posture = planner.home + 0.1 * np.random.default_rng(seed).standard_normal(assembly.n)
    path = planner.next_motion(covariance, posture, mean, DT, seed).path
    assert path.seconds == pytest.approx(PIECE_S)
    np.testing.assert_allclose(path.q[-1], posture, atol=1e-9)
    np.testing.assert_allclose([path.v[-1], path.a[-1]], 0.0, atol=1e-8)
    assert not limits.broken_by_motion(path.q, path.v, path.a).any()
    np.testing.assert_allclose(path.q[: len(path) // 2 - 1], path.q[len(path) // 2 : -1][::-1], atol=1e-8)
