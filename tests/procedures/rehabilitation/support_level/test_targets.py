"""Targets: a fingertip that stays at one has reached it, on either side, and all lie within the arm's length."""

import numpy as np
import pytest

from exograv.procedures.rehabilitation.support_level.targets import DWELL_S, TARGETS, TOLERANCE_M, ReachJudge

SHOULDER, PLACE = np.array([0.0, -0.2, 0.5]), np.array([0.5, 0.0, 0.3])


def seen(offsets: list[float], dt: float = 0.02) -> ReachJudge:
    judge = ReachJudge(PLACE)
    for k, offset in enumerate(offsets):
        judge.see(k * dt, PLACE + np.array([offset, 0.0, 0.0]))
    return judge


def test_all_targets_lie_within_the_arm_and_mirror_from_side_to_side():
    for target in TARGETS:
        right, left = (target.place(SHOULDER, 0.7, side) - SHOULDER for side in ("right", "left"))
        assert np.linalg.norm(right) == pytest.approx(target.share * 0.7)
        np.testing.assert_allclose(right * [1, -1, 1], left)


def test_who_swings_past_has_not_reached_it_and_who_stays_has():
    stays = int(DWELL_S / 0.02) + 2
    inside, outside = 0.5 * TOLERANCE_M, 2.0 * TOLERANCE_M
    assert not seen([outside] + [inside] * (stays // 2) + [outside] + [inside] * (stays // 2)).reached
    assert seen([outside] + [inside] * stays).reached


def test_what_was_reached_stays_reached_and_the_nearest_distance_is_kept():
    judge = seen([0.3] + [0.01] * 30 + [0.4])
    assert judge.reached
    assert judge.nearest_m == pytest.approx(0.01)
