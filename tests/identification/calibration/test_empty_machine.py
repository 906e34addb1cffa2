"""Stage 0 finds gain and friction at the end of the sweeps with known weights."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.identification.conftest import HIDDEN, NOISE_SD, Exo

from exograv.errors import IdentificationError
from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S, Calibration, Sweeps, calibrate, recheck

SIGMAS = 3.5
"""Largest of sixteen normalised errors; one in a hundred runs exceeds it."""


@pytest.fixture(scope="module")
def sweeps(make_sweeps: Callable[..., Sweeps]) -> Sweeps:
    return make_sweeps()


@pytest.fixture(scope="module")
def found(exo: Exo, sweeps: Sweeps) -> Calibration:
    return calibrate(exo.description, exo.tree, sweeps)


def test_gains_and_friction_are_found_within_their_intervals(exo: Exo, found: Calibration):
    machine, gain = found.machine, exo.description.nominal_gain / HIDDEN["inverse_gain"]
    assert (np.abs(machine.actuators.gain - gain) < SIGMAS * machine.actuators.gain_sd).all()
    assert (machine.actuators.gain_sd < 0.01 * gain).all()
    for name in ("coulomb", "breakaway"):
        value, sd = getattr(machine.friction, name), getattr(machine.friction_sd, name)
        assert (np.abs(value - HIDDEN[name]) < SIGMAS * sd).all()
    np.testing.assert_allclose(machine.friction.coulomb, HIDDEN["coulomb"], rtol=0.03)


def test_friction_is_that_of_the_end_though_the_machine_was_cold_at_the_start(exo: Exo, sweeps: Sweeps):
    """A fit without warming parameters would find the mean friction of the run, some percent too large."""
    prior = exo.model.prior
    for name in ("coulomb_warming", "viscous_warming"):
        prior = prior.with_sd(prior.layout.of(name), 1e-6)
    steady = exo.model.fit(sweeps, prior, exo.model.fit(sweeps, prior)).theta[prior.layout.of("coulomb")]
    assert steady[2] > 1.05 * HIDDEN["coulomb"][2]


def test_what_it_cannot_explain_is_the_noise_and_the_ripple_that_the_machine_does_not_know(found: Calibration):
    noise = np.hypot(NOISE_SD, HIDDEN["ripple_sine"] / np.sqrt(2.0) * HIDDEN["inverse_gain"])
    np.testing.assert_allclose(found.machine.residual_sd, noise / HIDDEN["inverse_gain"], rtol=0.15)


def test_a_leaning_base_and_a_shifted_encoder_of_the_elbow_are_told(exo: Exo, make_sweeps: Callable[..., Sweeps]):
    offset = np.deg2rad([0.0, 0.0, 0.0, 0.8])
    found = calibrate(exo.description, exo.tree, make_sweeps(offset=offset, tilt=np.array([0.0, 0.01])))
    assert (np.abs(found.offset - offset) < SIGMAS * found.offset_sd).all()
    assert found.offset[3] > 3 * found.offset_sd[3]
    assert (np.abs(found.tilt - [0.0, 0.01]) < SIGMAS * found.tilt_sd).all()


def test_a_recheck_finds_todays_friction_and_leaves_the_gains(
    exo: Exo, found: Calibration, make_sweeps: Callable[..., Sweeps]
):
    today = make_sweeps(coulomb=1.2 * HIDDEN["coulomb"], coulomb_warming=np.zeros(4))
    bare = today.hung.sum(axis=1) == 0.0
    columns = {name: getattr(today, name)[bare] for name in ("t", "q", "v", "a", "current", "hung", "start")}
    again = recheck(exo.description, exo.tree, Sweeps(**columns), found)
    np.testing.assert_allclose(again.machine.friction.coulomb, 1.2 * HIDDEN["coulomb"], rtol=0.03)
    np.testing.assert_array_equal(again.machine.actuators.gain, found.machine.actuators.gain)
    np.testing.assert_array_equal(again.machine.phi, found.machine.phi)
    np.testing.assert_array_equal(again.machine.friction.load_share, found.machine.friction.load_share)


def test_slow_samples_and_those_after_a_turn_have_no_clear_direction(sweeps: Sweeps):
    one = np.zeros((3, 4))
    v, a = one.copy(), one.copy()
    v[:, 0], a[2, 0] = [0.03, 0.05, 0.05], 1.0
    part = {name: getattr(sweeps, name)[:3] for name in ("t", "q", "current", "hung")}
    clear = Sweeps(**part, v=v, a=a, start=np.zeros(3, dtype=bool)).clear
    assert clear[:, 0].tolist() == [False, True, False]
    assert not clear[:, 1:].any()


def test_a_joint_that_did_not_move_is_named_and_refused(exo: Exo, sweeps: Sweeps):
    v = sweeps.v.copy()
    v[:, 2] = 0.0
    with pytest.raises(IdentificationError, match=r"'shoulder_rotation' moved for only 0.0 s"):
        calibrate(exo.description, exo.tree, replace(sweeps, v=v))


def test_samples_are_forty_milliseconds_apart(sweeps: Sweeps):
    assert np.isclose(np.median(np.diff(sweeps.t)), SAMPLE_PERIOD_S)
