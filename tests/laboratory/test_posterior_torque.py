"""Posterior torque grows with the covariance, agrees with its linear form if small, and needs a covariance."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.control.resting import RestingTorque
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.laboratory.posterior_torque import PosteriorTorque, posterior_torque
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.calibration.nominal_machine import nominal_machine

SMALL = 1e-4
"""Share of the prior's covariance at which torque is linear in the parameters, to a per cent."""

SAMPLING = 0.1
"""Relative tolerance: the RMS of 512 draws has an error of 3 %, linearity one of 1 %."""


@pytest.fixture(scope="module")
def laboratory():
    description = load_rig("recupera_like")
    assembly = assemble(description, Body(1.75, 75.0, "male"))
    machine = nominal_machine(description, assembly.exo.phi)
    return assembly, machine, RestingTorque(assembly, machine), *prior(assembly, machine)


def doubt_of(laboratory, share: float) -> PosteriorTorque:
    """Estimate with this share of the prior's covariance."""
    assembly, _, resting, mean, covariance = laboratory
    found = posterior_torque(resting, assembly, Estimate(0.0, mean, share * covariance, 0.0, 1.0))
    assert found is not None
    return found


def test_small_doubt_is_the_linear_prediction(laboratory):
    assembly, machine, _, mean, covariance = laboratory
    found = doubt_of(laboratory, SMALL)
    linear = LeftOverPrediction(ArmModel(assembly, machine), mean).rms(SMALL * covariance)
    # The median of an RMS lies below the total RMS, the 95th percentile above it.
    assert (found.median < linear).all()
    assert (found.p95 > linear).all()
    assert found.draws == 512


def test_doubt_grows_with_the_covariance_and_vanishes_with_it(laboratory):
    small, large = doubt_of(laboratory, SMALL), doubt_of(laboratory, 4 * SMALL)
    np.testing.assert_allclose(large.p95 / small.p95, 2.0, rtol=SAMPLING)
    np.testing.assert_allclose(doubt_of(laboratory, 0.0).p95, 0.0, atol=1e-9)


def test_arms_that_fall_out_of_their_cuffs_are_left_out(laboratory):
    found = doubt_of(laboratory, 30.0)
    assert 0 < found.draws < 512
    assert np.isfinite(found.p95).all()
    assert (found.p95 > found.median).all()


def test_arms_that_are_not_closed_do_not_count(laboratory, monkeypatch: pytest.MonkeyPatch):
    honest = RestingTorque.__call__

    def with_lost_arms(self, q, x, z_start, **more):
        found = honest(self, q, x, z_start, **more)
        if len(q) < 1000:
            return found
        lost = np.arange(len(q)) < len(q) // 4
        tau = np.where(lost[:, None], 1e6, found.tau_desired)
        return replace(found, tau_desired=tau, is_closed=found.is_closed & ~lost)

    monkeypatch.setattr(RestingTorque, "__call__", with_lost_arms)
    found = doubt_of(laboratory, SMALL)
    assert found.draws == 384
    assert (found.p95 < 1.0).all()


def test_a_method_without_covariance_states_no_doubt(laboratory):
    assembly, _, resting, mean, _ = laboratory
    assert posterior_torque(resting, assembly, Estimate(0.0, mean, None, 0.0, 1.0)) is None
