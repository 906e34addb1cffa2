"""The compensator scales the arm's weight with the gravity level and states how uncertain its torque is."""

import numpy as np
import pytest

import exograv

POSTURE = np.deg2rad([40.0, 20.0, 0.0, 70.0])
LIGHT, HEAVY = (exograv.Person(1.75, mass, "female") for mass in (60.0, 85.0))
SAG_NM = 0.05  # the loaded arm sags in its cuffs, so the torque is not exactly linear in the level


@pytest.fixture(scope="module")
def rig():
    return exograv.load_rig("recupera_like")


@pytest.fixture(scope="module")
def light(rig) -> exograv.Compensator:
    return exograv.Compensator(rig, LIGHT)


@pytest.fixture(scope="module")
def heavy(rig) -> exograv.Compensator:
    return exograv.Compensator(rig, HEAVY)


def test_at_level_one_the_arm_carries_itself_whatever_it_weighs(light, heavy):
    np.testing.assert_allclose(light.torque(POSTURE, 1.0), heavy.torque(POSTURE, 1.0), atol=1e-9)


def test_a_heavier_arm_needs_more_torque_at_the_shoulder(light, heavy):
    assert heavy.torque(POSTURE)[0] > light.torque(POSTURE)[0] + 1.0


@pytest.mark.parametrize("level", [0.165, 0.378, 0.7, 1.8])
def test_the_torque_is_linear_in_the_gravity_level_but_for_the_sag_of_the_cuffs(light, level):
    weightless, earth = light.torque(POSTURE, 0.0), light.torque(POSTURE, 1.0)
    expected = weightless + level * (earth - weightless)
    np.testing.assert_allclose(light.torque(POSTURE, level), expected, atol=SAG_NM)


def test_the_order_of_questions_changes_no_answer(rig, light):
    first = light.torque(POSTURE, 0.0)
    light.torque(np.deg2rad([0.0, 10.0, 10.0, 30.0]), 1.0)
    np.testing.assert_allclose(light.torque(POSTURE, 0.0), first, atol=1e-7)


def test_the_interval_of_a_known_arm_is_narrower_than_that_of_the_table(rig, light):
    sure = exograv.Estimate(
        LIGHT, light.assembly, _machine(rig), light.x, 0.01 * np.asarray(light.covariance), "known for this test"
    )
    known = exograv.Compensator(rig, sure)
    width, narrow = (np.ptp(one.interval(POSTURE), axis=0) for one in (light, known))
    assert (narrow < 0.5 * width).all()
    low, high = known.interval(POSTURE)
    assert ((low < known.torque(POSTURE)) & (known.torque(POSTURE) < high)).all()


def _machine(rig):
    return exograv.load_calibration("examples/data/calibration.toml", rig).machine


@pytest.mark.parametrize(
    ("q", "level", "words"),
    [
        (np.zeros(3), 0.0, "must hold 4 finite positions"),
        (np.array([0.0, np.nan, 0.0, 1.0]), 0.0, "must hold 4 finite positions"),
        (POSTURE, -0.1, "allowed: 0 .weightless. to 1.8"),
        (POSTURE, 2.0, "allowed: 0 .weightless. to 1.8"),
    ],
)
def test_a_wrong_posture_or_level_is_refused_with_what_is_allowed(light, q, level, words):
    with pytest.raises(exograv.ExogravError, match=words):
        light.torque(q, level)


def test_an_estimate_of_another_machine_is_refused(rig, light):
    estimate = exograv.Estimate(LIGHT, light.assembly, _machine(rig), light.x, light.covariance, "")
    with pytest.raises(exograv.ExogravError, match="belongs to 'recupera_like'"):
        exograv.Compensator(exograv.load_rig("recupera_like_qdd"), estimate)
