"""The batch at rest equals the tick at rest, at every posture and for every arm; it marks postures not found."""

import numpy as np
import pytest

from exograv.control.resting import RestingTorque
from exograv.control.tick import ControlMode, Tick
from exograv.dynamics import parameters
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.loops import FIT
from exograv.model.support import assemble, sample_postures
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess

PARITY = 1e-9  # N·m: rounding, and postures closed to 1e-10 rad
POSTURES = 31
FAR = 1.0  # rad: in a true minimum, arm and machine differ by 0.8 at most
LAYOUT = parameters.ParameterLayout(segments=2, freedoms=4, arms=1, joints=4)


@pytest.fixture(scope="module")
def resting(assembly, machine) -> RestingTorque:
    return RestingTorque(assembly, machine)


@pytest.fixture(scope="module")
def postures(assembly) -> np.ndarray:
    return sample_postures(assembly.description, 32)[:POSTURES]


@pytest.mark.parametrize("mode", [ControlMode(), ControlMode(gravity_level=0.378), ControlMode(arm_share=0.0)])
def test_it_asks_for_what_the_tick_asks_for(resting, postures, assembly, machine, wearer, mode: ControlMode):
    z_start = resting.cold_start(postures, wearer)
    got = resting(postures, np.tile(wearer, (POSTURES, 1)), z_start, mode)
    tick = Tick(assembly, machine)
    tick.mode = mode
    expected = [tick.at_rest(q, wearer, z) for q, z in zip(postures, z_start, strict=True)]
    assert got.is_closed.all()
    for mine, theirs in zip((got.tau_desired, got.tau_arm, got.z), zip(*expected, strict=True), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=PARITY)


def test_every_state_has_its_own_arm(resting, postures, wearer):
    z_start = resting.cold_start(postures[:1], wearer)
    arms = np.tile(wearer, (3, 1))
    arms[1, LAYOUT.phi] *= 1.2
    arms[2, LAYOUT.fit] = 0.0
    states = np.repeat(postures[:1], 3, axis=0)
    together = resting(states, arms, np.repeat(z_start, 3, axis=0))
    for i in range(3):
        alone = resting(states[:1], arms[i : i + 1], z_start)
        np.testing.assert_allclose(together.tau_desired[i], alone.tau_desired[0], atol=PARITY)
    assert np.abs(np.diff(together.tau_desired, axis=0)).max() > 0.1


def test_a_posture_that_is_not_found_is_marked_and_harms_no_other(resting, postures, wearer):
    z_start = resting.cold_start(postures, wearer)
    arms = np.tile(wearer, (POSTURES, 1))
    expected = resting(postures, arms, z_start)
    arms[4] = np.nan
    z_start[9] += 40.0
    got = resting(postures, arms, z_start)
    np.testing.assert_array_equal(np.flatnonzero(~got.is_closed), [4, 9])
    keep = np.flatnonzero(got.is_closed)
    np.testing.assert_allclose(got.tau_desired[keep], expected.tau_desired[keep], atol=PARITY)


def test_an_arm_that_lies_twisted_in_its_cuffs_is_not_closed(resting, postures, wearer):
    """Newton's method can end in a false minimum, with the arm turned away from the machine."""
    starts = resting.cold_start(postures, wearer)
    twisted = 0
    for turn in (np.array([np.pi, np.pi, np.pi, 0.0]), np.array([0.0, 0.0, 2 * np.pi, 0.0])):
        got = resting(postures, np.tile(wearer, (POSTURES, 1)), starts + turn)
        far = np.abs(got.z - postures).max(axis=1) > FAR
        twisted += int(far.sum())
        assert not got.is_closed[far].any()
    assert twisted > POSTURES


def test_an_arm_in_slack_cuffs_is_not_closed(resting, postures, wearer):
    slack = wearer.copy()
    slack[LAYOUT.fit][[FIT.index("cuff_log_stiffness"), FIT.index("cuff_log_rotational_stiffness")]] = -14.0
    slack[LAYOUT.phi] = 0.0
    starts = resting.cold_start(postures, wearer)
    assert not resting(postures, np.tile(slack, (POSTURES, 1)), starts).is_closed.any()


def test_an_arm_of_seven_freedoms_is_found_from_where_one_lies_whose_shoulder_is_elsewhere():
    """Newton's method fails directly in every second posture: a shift of 2 cm is too large for the soft roll."""
    description = load_rig("recupera_like_7")
    assembly = assemble(description, Body(1.78, 75.0, "male"))
    machine = nominal_machine(description, assembly.exo.phi)
    resting, x = RestingTorque(assembly, machine), table_guess(assembly, machine)
    q = sample_postures(description, 32)
    elsewhere = x.copy()
    elsewhere[parameters.ParameterLayout.of(assembly).fit][:4] = -0.016, -0.013, -0.006, 0.014
    before, arms = np.tile(elsewhere, (len(q), 1)), np.tile(x, (len(q), 1))
    there = resting(q, before, resting.cold_start(q, elsewhere))
    led, from_cold = resting(q, arms, there.z, x_start=before), resting(q, arms, resting.cold_start(q, x))
    assert there.is_closed.all()
    assert resting._settled(q, arms, there.z, ControlMode()).is_closed.mean() < 0.8
    assert led.is_closed.all()
    np.testing.assert_allclose(led.tau_desired, from_cold.tau_desired, atol=PARITY)
