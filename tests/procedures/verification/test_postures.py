"""Postures of a verification: new to the identification, equal for equal seeds, and passed in both directions."""

import numpy as np
import pytest

from exograv.errors import ModelError
from exograv.procedures.verification.postures import (
    POSTURES,
    REACH_RAD,
    SPEED_RAD_S,
    UNSEEN_RAD,
    both_ways,
    unseen_postures,
)

DT = 0.001
NOWHERE = np.full((1, 4), 9.0)
"""Motion that is far from all postures [rad]."""

ROUNDING = 1e-9


def test_a_seed_asks_again_at_the_same_postures_and_another_at_others(model, arm, postures):
    again = unseen_postures(model.again(), arm.x, NOWHERE, seed=1000)
    other = unseen_postures(model.again(), arm.x, NOWHERE, seed=1001)
    assert postures.shape == (POSTURES, 4)
    np.testing.assert_array_equal(postures, again)
    assert np.abs(postures - other).max() > REACH_RAD


def test_every_pass_stays_in_the_task_workspace(model, postures):
    lower, upper = model.assembly.description.workspace
    for q in postures:
        path = both_ways(q, np.array([1.0, -1.0, 1.0, -1.0]), DT)
        assert (path.q >= lower - ROUNDING).all()
        assert (path.q <= upper + ROUNDING).all()


def test_where_the_identification_has_been_nothing_is_verified(model, arm, postures):
    seen = postures[:3]
    others = unseen_postures(model.again(), arm.x, seen, seed=1000)
    for q in seen:
        assert np.abs(others - q).max(axis=1).min() > UNSEEN_RAD


def test_a_workspace_that_was_seen_everywhere_is_refused(model, arm):
    lower, upper = model.assembly.description.workspace
    axes = [np.arange(low, high + UNSEEN_RAD, 2 * UNSEEN_RAD) for low, high in zip(lower, upper, strict=True)]
    everywhere = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 4)
    with pytest.raises(ModelError, match="not seen"):
        unseen_postures(model.again(), arm.x, everywhere, seed=1000)


def test_a_pass_meets_its_posture_once_in_each_direction_with_every_joint_at_speed(postures):
    towards = np.array([1.0, -1.0, -1.0, 1.0])
    path = both_ways(postures[0], towards, DT)
    near = np.flatnonzero(np.abs(path.q - postures[0]).max(axis=1) < SPEED_RAD_S * DT)
    directions = np.sign(path.v[near])
    assert {tuple(row) for row in directions} == {tuple(towards), tuple(-towards)}
    np.testing.assert_allclose(np.abs(path.v[near]), SPEED_RAD_S)
    np.testing.assert_allclose(path.v[-1], 0.0, atol=SPEED_RAD_S * DT / 0.3)
