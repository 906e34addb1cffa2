"""An estimate is carried in full where it is surely nearer to the arm than the body table, and in part elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.carried_arm import (
    CONFIDENCE_SD,
    MARGIN_NM,
    BodyTable,
    CarriedArm,
    carried_arm,
    largest_share,
    widened_by_check,
)
from exograv.identification.core.interface import Agreement, Estimate
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.prior import prior
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.model.tree import is_physical
from exograv.procedures.calibration.nominal_machine import nominal_machine

ROUNDING_NM = 1e-6

BLEND = 0.03
"""Error of a share, because the axes have common masses [-]."""

joints = st.floats(0.0, 3.0)


class Laboratory:
    """Arm of a person in a machine, with the prediction of its left over."""

    def __init__(self):
        self.assembly: Assembly = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male"))
        machine = nominal_machine(self.assembly.description, self.assembly.exo.phi)
        mean, covariance = prior(self.assembly, machine)
        self.table = BodyTable(mean, covariance)
        self.prediction = LeftOverPrediction(ArmModel(self.assembly, machine), mean)
        self.bodies = ParameterLayout.of(self.assembly).bodies
        sd = np.sqrt(np.diag(covariance))
        # An eigenvector has another sign on another processor, and its draws would be other arms.
        self._root = sd[:, None] * np.linalg.cholesky(covariance / np.outer(sd, sd))

    def estimate(self, change_sd: float, certain: float, seed: int = 3) -> Estimate:
        """Return an estimate about `change_sd` standard deviations from the table, with this share of their size."""
        draw = np.random.default_rng(seed).standard_normal(self._root.shape[1])
        project = PhysicalProjection(self.bodies, self.table.x)
        x = project(self.table.x + change_sd * self._root @ draw, self.table.covariance)
        return Estimate(20.0, x, certain**2 * self.table.covariance, 0.0, 1.0)

    def carried(self, estimate: Estimate) -> CarriedArm:
        return carried_arm(estimate, self.table, self.prediction, self.bodies)

    def excess_Nm(self, estimate: Estimate, carried: CarriedArm, error_sd: float) -> np.ndarray:
        """Left over beyond the table's, by joint, if on each axis the error along the carried change is this large."""
        change = self.prediction.torque_of(estimate.x - self.table.x)
        part = self.prediction.torque_of(carried.x - self.table.x)
        along = part / np.maximum(rms(part), 1e-12)
        error = error_sd * self.prediction.sd_along(part, carried_covariance(estimate)) * along
        return rms(error - change + part) - rms(error - change)


def carried_covariance(estimate: Estimate) -> np.ndarray:
    assert estimate.covariance is not None
    return estimate.covariance


def rms(torque: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(torque**2, axis=0))


@pytest.fixture(scope="module")
def laboratory() -> Laboratory:
    return Laboratory()


@given(along=joints, size=joints, bound=joints, more=joints)
def test_a_larger_bound_never_carries_more_and_a_larger_change_of_the_same_direction_never_less(
    along: float, size: float, bound: float, more: float
):
    one, wider = (share(along, size, each) for each in (bound, bound + more))
    assert 0.0 <= wider <= one <= 1.0
    assert share(along + more, size, bound) >= one


@given(size=joints, bound=joints, u=st.floats(0.0, 1.0), error=st.floats(-1.0, 1.0))
def test_no_error_within_the_bound_leaves_more_than_the_margin_above_the_table(
    size: float, bound: float, u: float, error: float
):
    part = u * share(size, size, bound) * size
    along = error * bound
    assert abs(along - size + part) - abs(along - size) <= MARGIN_NM + ROUNDING_NM


def test_the_estimate_is_carried_unchanged_where_twice_its_bound_is_below_the_change():
    assert share(0.4, 0.4, 0.2) == 1.0
    assert share(0.4, 0.4, 0.3) < 1.0


def test_a_change_within_the_margin_is_carried_however_uncertain_it_is():
    assert share(MARGIN_NM, MARGIN_NM, 5.0) == 1.0


def test_a_certain_estimate_is_carried_in_full_and_unchanged(laboratory):
    estimate = laboratory.estimate(1.0, certain=0.01)
    carried = laboratory.carried(estimate)
    assert carried.is_whole
    np.testing.assert_array_equal(carried.x, estimate.x)
    np.testing.assert_array_equal(carried.covariance, estimate.covariance)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("certain", [0.15, 0.3, 0.6])
def test_no_axis_is_left_with_more_than_the_table_within_the_bound(laboratory, seed: int, certain: float):
    estimate = laboratory.estimate(0.7, certain, seed)
    carried = laboratory.carried(estimate)
    for sd in (-CONFIDENCE_SD, 0.0, CONFIDENCE_SD):
        assert (laboratory.excess_Nm(estimate, carried, sd) <= MARGIN_NM + 1e-3).all()


@pytest.mark.parametrize("seed", range(6))
def test_the_error_that_is_stated_for_the_carried_arm_is_never_above_the_tables(laboratory, seed: int):
    estimate = laboratory.estimate(0.7, 0.4, seed)
    carried = laboratory.carried(estimate)
    away = laboratory.table.x - estimate.x
    of_table = laboratory.prediction.rms(carried_covariance(estimate) + np.outer(away, away))
    assert (laboratory.prediction.rms(carried.covariance) <= of_table + ROUNDING_NM).all()


def test_an_uncertain_estimate_is_carried_less_the_more_uncertain_it_is(laboratory):
    shares = [laboratory.carried(laboratory.estimate(0.7, certain)).share for certain in (0.05, 0.2, 0.4, 0.8)]
    assert not (np.diff(shares, axis=0) > BLEND).any()
    assert shares[-1].max() < 1.0


@pytest.mark.parametrize("seed", range(6))
def test_the_carried_arm_is_physically_possible(laboratory, seed: int):
    carried = laboratory.carried(laboratory.estimate(1.0, 0.5, seed))
    assert not carried.is_whole
    assert all(is_physical(carried.x[body]) for body in laboratory.bodies)


def test_an_axis_keeps_its_change_while_another_goes_back_to_the_table(laboratory):
    shares = np.array([laboratory.carried(laboratory.estimate(0.7, 0.2, seed)).share for seed in range(40)])
    mixed = (shares.min(axis=1) < 0.7) & (shares.max(axis=1) > 0.95)
    assert mixed.any()


def test_an_estimate_that_states_more_than_the_table_is_hardly_carried(laboratory):
    carried = laboratory.carried(laboratory.estimate(0.7, certain=1.1))
    assert (carried.stated_Nm > carried.table_Nm).all()
    assert (carried.share * carried.change_Nm <= MARGIN_NM + 1e-3).all()


def test_a_method_without_uncertainty_is_carried_as_it_is(laboratory):
    estimate = replace(laboratory.estimate(1.0, 0.1), covariance=None)
    carried = laboratory.carried(estimate)
    assert carried.is_whole
    assert np.isnan(carried.bound_Nm).all()
    np.testing.assert_array_equal(carried.x, estimate.x)


def test_slip_of_the_cuffs_widens_the_bound(laboratory):
    estimate = laboratory.estimate(0.7, 0.2)
    slipped = replace(estimate, slipped=np.full(len(laboratory.assembly.cuffs), 0.01))
    assert (laboratory.carried(slipped).bound_Nm > laboratory.carried(estimate).bound_Nm).all()


def check(p: list[float], residual: float) -> Agreement:
    return Agreement(np.array(p), np.full(4, residual), np.full(4, 0.2), 0.0025)


def test_a_check_that_disagrees_adds_its_unexplained_residual_to_the_left_over(laboratory):
    estimate = laboratory.estimate(0.7, 0.2)
    wide = widened_by_check(estimate, laboratory.prediction, check([0.5, 0.001, 0.5, 0.5], 0.5))
    before, after = laboratory.prediction.of(estimate), laboratory.prediction.of(wide)
    np.testing.assert_allclose(after[1], np.sqrt(before[1] ** 2 + 0.5**2 - 0.2**2))
    assert (laboratory.carried(wide).share <= laboratory.carried(estimate).share + BLEND).all()


@pytest.mark.parametrize("agreement", [None, check([0.5, 0.4, 0.5, 0.5], 0.9)])
def test_an_estimate_that_no_check_refutes_keeps_its_uncertainty(laboratory, agreement: Agreement | None):
    estimate = laboratory.estimate(0.7, 0.2)
    assert widened_by_check(estimate, laboratory.prediction, agreement) is estimate


def share(along: float, size: float, bound: float) -> float:
    return float(largest_share(np.array([along]), np.array([size]), np.array([bound]))[0])
