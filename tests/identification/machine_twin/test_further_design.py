"""The designed motion stays within the limits of the machine, and tells of the least known parameters."""

from dataclasses import dataclass, replace
from unittest.mock import Mock

import numpy as np
import pytest
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit, ResidualNoise, Sweeps
from exograv.identification.excitation.limits import A_MAX, V_MAX
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.further_design import (
    EmptyLimits,
    MotionDesign,
    design_further_motion,
    expected_ratio,
)
from exograv.identification.machine_twin.machine_fit import MachineFit
from exograv.identification.machine_twin.model_discrepancy import DiscrepancySize

NOISE_NM = 0.1
MOVED_LOG = 0.25
"""Change of the logarithm of an expected ratio by values that moved by one standard deviation; their derivatives change
by some ten per cent."""
NAMES = ("inverse_gain", "coulomb", "viscous", "rotor")


@dataclass(frozen=True)
class Designed:
    """Motion for a machine of which nothing but the data sheet is known."""

    model: EmptyMachine
    limits: EmptyLimits
    fit: Fit
    places: np.ndarray
    design: MotionDesign


@pytest.fixture(scope="module")
def designed(exo: Exo) -> Designed:
    model = EmptyMachine(exo.description, exo.tree, TWIN_PER_JOINT)
    noise = ResidualNoise(np.full(4, 0.1), np.full(4, 0.1))
    fit = Fit(model.prior, model.prior.mean, model.prior.covariance, noise, noise)
    limits = EmptyLimits.of(exo.description, exo.tree)
    places = np.concatenate([np.arange(4) + model.prior.layout.of(name).start for name in NAMES])
    return Designed(model, limits, fit, places, design_further_motion(model, fit, limits, places))


def test_the_motion_keeps_the_limits_of_posture_speed_and_acceleration(designed: Designed):
    path = designed.design.basis.trajectory(designed.design.coefficients, 30.0, 0.001)
    assert (path.q >= designed.limits.lower - 1e-6).all()
    assert (path.q <= designed.limits.upper + 1e-6).all()
    assert np.abs(path.v).max() <= V_MAX
    assert np.abs(path.a).max() <= A_MAX


def test_the_motion_tells_of_every_parameter_that_counts(designed: Designed):
    ratio = designed.design.sd_after[designed.places] / designed.design.sd_before[designed.places]
    assert (ratio < 0.9).all()


def test_no_motion_makes_a_parameter_less_certain(designed: Designed):
    assert (designed.design.sd_after <= designed.design.sd_before * (1.0 + 1e-9)).all()


def found_with(designed: Designed, size: float) -> MachineFit:
    """Fit to the designed motion itself, with this error of the model, additive [N·m]."""
    model, draw, design = designed.model, np.random.default_rng(1), designed.design
    t = SAMPLE_PERIOD_S * np.arange(round(design.basis.period_s / SAMPLE_PERIOD_S))
    q, v, a = (table @ design.coefficients for table in design.basis.tables(t))
    hung = np.zeros((len(t), len(model.description.mounts) * model.prior.layout.weights))
    rows = (hung, np.zeros(len(t), dtype=bool))
    still = Sweeps(t, q, v, a, np.zeros_like(q), *rows)
    tau = -model.residual(still, model.prior.mean, float(t[-1])) + NOISE_NM * draw.standard_normal(q.shape)
    sweeps = Sweeps(t, q, v, a, tau / model.description.nominal_gain, *rows)
    fit = model.fit(sweeps, model.prior, model.fit(sweeps, model.prior))
    return Mock(
        spec=MachineFit,
        model=model,
        fit=fit,
        discrepancy=DiscrepancySize(np.full(4, size), np.zeros(4)),
        sweeps=sweeps,
    )


def test_errors_of_the_model_that_repeat_make_a_repetition_of_the_motion_tell_less(designed: Designed):
    none, some = (
        expected_ratio(found_with(designed, size), designed.limits, designed.design)[designed.places]
        for size in (0.0, 3.0 * NOISE_NM)
    )
    assert (none <= 1.0 + 1e-9).all()
    assert np.median(some) > np.median(none)


def test_values_that_moved_after_the_fit_do_not_change_what_the_motion_is_expected_to_tell(designed: Designed):
    found = found_with(designed, 3.0 * NOISE_NM)
    fit, draw = found.fit, np.random.default_rng(3)
    moved = fit.theta + np.linalg.cholesky(fit.covariance) @ draw.standard_normal(len(fit.theta))
    before = expected_ratio(found, designed.limits, designed.design)[designed.places]
    parts = {name: getattr(found, name) for name in ("model", "discrepancy", "sweeps")}
    later: MachineFit = Mock(spec=MachineFit, fit=replace(fit, theta=moved), **parts)
    after = expected_ratio(later, designed.limits, designed.design)[designed.places]
    assert np.abs(np.log(after / before)).max() < MOVED_LOG
