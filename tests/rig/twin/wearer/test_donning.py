"""A second donning keeps the wearer's body, changes the fastening, and leaves earlier draws as they were."""

import numpy as np
import pytest

from exograv.rig.twin import Disturbances, Wearer, day_seed, donned_again, draw_wearer
from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.wearer.muscles import Muscles

LEVEL = Disturbances.at_level(2)


@pytest.fixture(scope="module")
def first() -> Wearer:
    return draw_wearer(LEVEL, 1000)


def masses(wearer: Wearer) -> np.ndarray:
    return np.array([bone.mass for bone in wearer.arms[0].skeleton.bones])


def test_the_first_donning_is_the_wearer_as_drawn(first: Wearer):
    assert donned_again(first, LEVEL, 1000, 0) is first
    assert day_seed(1000, 0) == 1000


def test_what_somebody_measured_stays(first: Wearer):
    again = donned_again(first, LEVEL, 1000, 1)
    assert again.body == first.body
    assert again.lengths_given == first.lengths_given
    assert again.arms[0].skeleton.lengths == first.arms[0].skeleton.lengths


def test_the_shoulder_sits_elsewhere_within_the_same_range(first: Wearer):
    offsets = np.array([donned_again(first, LEVEL, 1000, n).arms[0].donning_offset for n in range(1, 200)])
    assert np.abs(offsets).max() <= 0.015
    assert np.abs(offsets).max() > 0.0145
    assert np.abs(np.corrcoef(offsets[:-1, 0], offsets[1:, 0])[0, 1]) < 0.2


def test_masses_and_elasticity_change_by_the_size_of_their_row(first: Wearer):
    days = [donned_again(first, LEVEL, 1000, n) for n in range(1, 300)]
    heavier = np.log([masses(day) / masses(first) for day in days])
    assert np.std(heavier) == pytest.approx(0.01, rel=0.1)
    stiffer = np.log([day.passive.stiffness / first.passive.stiffness for day in days])
    assert np.std(stiffer) == pytest.approx(0.1, rel=0.1)
    pulled = np.log([day.cuffs.stiffness[0] / first.cuffs.stiffness[0] for day in days])
    assert np.std(pulled) == pytest.approx(0.2, rel=0.15)


def test_without_day_to_day_only_the_shoulder_moves(first: Wearer):
    again = donned_again(first, LEVEL.without("day_to_day"), 1000, 1)
    np.testing.assert_array_equal(masses(again), masses(first))
    np.testing.assert_array_equal(again.passive.neutral, first.passive.neutral)
    np.testing.assert_array_equal(again.cuffs.stiffness, first.cuffs.stiffness)
    assert (again.arms[0].donning_offset != first.arms[0].donning_offset).all()


def test_each_day_has_slow_torques_of_its_own(first: Wearer):
    unrest = first.arms[0].unrest
    blocks = [Muscles(unrest, day_seed(1000, n), 1e-3).next_block() for n in (0, 1, 2)]
    assert all((a != b).all() for a, b in ((blocks[0], blocks[1]), (blocks[1], blocks[2])))
    np.testing.assert_array_equal(blocks[0], Muscles(unrest, 1000, 1e-3).next_block())


def test_another_day_of_one_seed_is_no_day_of_another():
    draws = {stream(day_seed(seed, n), "run", "x").random() for seed in range(50) for n in range(20)}
    assert len(draws) == 1000
