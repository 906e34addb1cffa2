"""The examiner compares the torque of the motors with that on the locks, at postures that never change."""

import numpy as np
import pytest

from exograv.rig.twin import (
    Body,
    Disturbances,
    Examiner,
    draw_machine,
    draw_wearer,
    held_out_postures,
    parameter_truth,
    rms,
)
from exograv.rig.twin.machine.machine import GRAVITY

LEVEL = Disturbances.at_level(2)
PARITY = 1e-12


@pytest.fixture(scope="module")
def examiner(rig) -> Examiner:
    return Examiner(rig, draw_machine(rig, LEVEL, 0), draw_wearer(LEVEL, 0))


def test_held_out_postures_are_two_hundred_fixed_ones_in_the_workspace(rig):
    postures = held_out_postures(rig)
    lower, upper = rig.workspace
    assert postures.shape == (200, 4)
    assert (postures >= lower).all()
    assert (postures <= upper).all()
    np.testing.assert_array_equal(postures, held_out_postures(rig))
    np.testing.assert_allclose(postures.mean(axis=0), 0.5 * (lower + upper), atol=0.02)


def test_a_controller_that_knows_everything_leaves_nothing_over(rig, examiner):
    machine = draw_machine(rig, LEVEL, 0)

    def currents_of(q_measured: np.ndarray) -> np.ndarray:
        q_true = q_measured - machine.sensors.encoder_offset
        return np.array([examiner.lock_torque(q) for q in q_true]) / machine.drives.gain

    assert np.abs(examiner.left_over(currents_of)).max() < 1e-6


def test_doing_nothing_leaves_the_whole_lock_torque_over(examiner):
    left_over = examiner.left_over(np.zeros_like)
    np.testing.assert_array_equal(left_over, examiner.lock_torques())
    assert (rms(left_over) > [5.0, 3.0, 0.5, 1.0]).all()


def test_the_arms_score_leaves_machine_and_cuffs_out(examiner):
    arm = examiner.arm_left_over(np.zeros_like)
    np.testing.assert_allclose(arm, examiner.lock_torques() - examiner.lock_torques(arm=False), atol=PARITY)


def test_motors_deliver_no_more_than_they_can(rig, examiner):
    assert (examiner.delivered(lambda q: np.full(q.shape, 1e3)) == [60.0, 60.0, 30.0, 30.0]).all()


def test_an_empty_machine_can_be_examined(rig):
    machine = draw_machine(rig, LEVEL, 0)
    empty = Examiner(rig, machine, None)
    np.testing.assert_allclose(empty.lock_torques(), empty.lock_torques(arm=False), atol=PARITY)


def test_a_weight_in_the_hand_adds_its_weight_times_its_lever(rig):
    stiff = Disturbances.at_level(0)
    wearer = draw_wearer(stiff, 0)
    examiner = Examiner(rig, draw_machine(rig, stiff, 0), wearer)
    q = np.array([0.0, 0.0, 0.0, np.pi / 2.0])  # forearm forward and level
    added = examiner.lock_torque(q, payload_kg=1.0) - examiner.lock_torque(q)
    lever = -wearer.arms[0].skeleton.grip[1][2]
    # Even the stiffest cuffs sag a little: 1 kg turns the forearm by less than 1°, which changes levers by 1 %.
    np.testing.assert_allclose(added[[0, 3]], GRAVITY * lever, rtol=0.01)
    np.testing.assert_allclose(added[[1, 2]], 0.0, atol=0.05)


def test_the_arms_gravity_follows_from_the_true_parameters(rig):
    stiff = Disturbances.at_level(0)
    wearer = draw_wearer(stiff, 0)
    examiner = Examiner(rig, draw_machine(rig, stiff, 0), wearer)
    truth = parameter_truth(wearer)
    q = np.array([0.0, 0.0, 0.0, np.pi / 2.0])
    share = examiner.lock_torque(q) - examiner.lock_torque(q, arm=False)
    assert share[3] == pytest.approx(-GRAVITY * truth["forearm.mz"], rel=0.01)  # as above


def test_arms_weigh_what_the_joint_centre_table_says(rig):
    # 10.55 N·m at the shoulder and 2.90 at the elbow for 73 kg and mean lengths (computed from de Leva's table),
    # straight and level. One person's lengths differ by 4 % from their stature's.
    exact = Disturbances.at_level(0).without("segment_residual")
    wearers = [draw_wearer(exact, seed, body=Body("male", 1.741, 73.0)) for seed in range(6)]
    q = np.array([np.pi / 2.0, 0.0, 0.0, 0.0])
    examiners = [Examiner(rig, draw_machine(rig, exact, 0), wearer) for wearer in wearers]
    shares = np.array([e.lock_torque(q) - e.lock_torque(q, arm=False) for e in examiners])
    np.testing.assert_allclose(shares.mean(axis=0)[[0, 3]], [10.55, 2.90], rtol=0.05)
