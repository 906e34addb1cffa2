"""The designed motion stays within the limits of the machine, and tells of the least known parameters."""

from dataclasses import dataclass

import numpy as np
import pytest
from tests.identification.conftest import Exo

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, ResidualNoise
from exograv.identification.excitation.limits import A_MAX, V_MAX
from exograv.identification.machine_twin.friction_laws import TWIN_PER_JOINT
from exograv.identification.machine_twin.further_design import EmptyLimits, MotionDesign, design_further_motion

NAMES = ("inverse_gain", "coulomb", "viscous", "rotor")


@dataclass(frozen=True)
class Designed:
    """Motion for a machine of which nothing but the data sheet is known."""

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
    return Designed(limits, fit, places, design_further_motion(model, fit, limits, places))


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
