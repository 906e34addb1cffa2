"""An implausible calibration is refused with joint or weight, value, allowed range and next step."""

from collections.abc import Callable

import numpy as np
import pytest
from tests.identification.conftest import HIDDEN, Exo

from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_machine import Sweeps, calibrate

POUND = 0.45359237  # kg


def refused(exo: Exo, sweeps: Sweeps) -> str:
    with pytest.raises(IdentificationError) as caught:
        calibrate(exo.description, exo.tree, sweeps)
    return str(caught.value)


def test_weights_in_pounds_are_found_out_by_the_links(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    text = refused(exo, make_sweeps(shares=(POUND, POUND)))
    assert text.startswith("The weight of 1.5 kg acts like 0.")
    assert "10% are allowed" in text
    assert "scale" in text


def test_one_wrong_weight_is_told_from_the_right_one(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    assert refused(exo, make_sweeps(shares=(1.0, 0.8))).startswith("The weight of 3 kg acts like 2.")


@pytest.mark.parametrize("share", [0.6, pytest.param(1.41, marks=pytest.mark.long)])
def test_a_gain_beyond_any_tolerance_is_refused(exo: Exo, make_sweeps: Callable[..., Sweeps], share: float):
    inverse = HIDDEN["inverse_gain"].copy()
    inverse[1] = 1.0 / share
    text = refused(exo, make_sweeps(inverse_gain=inverse))
    assert "The gain of joint 'shoulder_abduction' is" in text
    assert "35% are allowed" in text
    assert "torque_constant_Nm_per_A" in text


@pytest.mark.parametrize("share", [0.75, pytest.param(1.3, marks=pytest.mark.long)])
def test_a_gain_of_a_bad_day_is_believed(exo: Exo, make_sweeps: Callable[..., Sweeps], share: float):
    inverse = HIDDEN["inverse_gain"].copy()
    inverse[1] = 1.0 / share
    gain = calibrate(exo.description, exo.tree, make_sweeps(inverse_gain=inverse)).machine.actuators.gain
    np.testing.assert_allclose(gain[1], share * exo.description.nominal_gain[1], rtol=0.01)


def test_an_encoder_that_is_five_degrees_off_is_refused(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    text = refused(exo, make_sweeps(offset=np.deg2rad([0.0, 0.0, 0.0, 5.0])))
    assert "The encoder of joint 'elbow_flexion' reads +" in text
    assert "3° are allowed" in text


def test_a_base_that_leans_like_no_base_is_refused(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    text = refused(exo, make_sweeps(tilt=np.sin(np.deg2rad([12.0, 0.0]))))
    assert text.startswith("The base leans by +12")
    assert "4.5° are allowed" in text


def test_the_first_joints_encoder_is_not_excused_by_the_base(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    """Half of the error would be within the limits of each."""
    text = refused(exo, make_sweeps(offset=np.deg2rad([5.0, 0.0, 0.0, 0.0])))
    assert "or the encoder of joint 'shoulder_flexion' is off by as much" in text


def test_a_link_that_carries_something_is_refused(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    """A mass of 4 kg next to the upper arm, on the axis of rotation, loads no other joint."""
    heavier = exo.tree.phi.copy()
    heavier[1, :4] += 4.0 * np.array([1.0, 0.0, -0.05, 0.0])
    assert "differs from the URDF by" in refused(exo, make_sweeps(links=heavier.ravel()))


def test_torque_that_nothing_explains_is_refused(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    sweeps = make_sweeps()
    sweeps.current[:, 2] += 4.0 * np.sin(40.0 * sweeps.q[:, 2]) / exo.description.nominal_gain[2]
    text = refused(exo, sweeps)
    assert "of the torque of joint 'shoulder_rotation' unexplained; 1.20 N·m are allowed" in text
