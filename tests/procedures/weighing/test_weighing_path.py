"""Weighing path: to and fro from rest to rest, with limited speed, between informative postures."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.arm import held_weight
from exograv.model.support import sample_postures
from exograv.motion import Passage
from exograv.procedures.weighing.weighing_path import WeighingPath, informative_path

ROUNDING = 1e-4  # rad: at the ends of a path, which are slowed down


@pytest.fixture(scope="module")
def way() -> WeighingPath:
    return WeighingPath(np.array([0.1, 0.0, 0.2, 0.5]), np.array([0.9, 0.3, 0.1, 1.0]), 0.7)


def test_it_begins_and_ends_at_rest_where_less_is_asked(way):
    path = way.cycles(20.0, 0.001).table()
    np.testing.assert_allclose(path.q[[0, -1]], [way.low, way.low], atol=ROUNDING)
    np.testing.assert_allclose(path.v[[0, -1]], 0.0, atol=0.01)


def test_no_joint_is_quicker_than_the_pace(way):
    assert np.abs(way.cycles(20.0, 0.001).table().v).max() <= way.speed * (1.0 + 1e-9)


def test_it_is_gone_once_at_least_and_reaches_its_other_end(way):
    path = way.cycles(0.0, 0.001).table()
    assert abs(path.seconds - way.period_s) < 1.1
    assert np.abs(path.q - way.high).max(axis=1).min() < 0.02


def test_no_other_two_postures_change_the_torque_much_more(model, believed_arm):
    x, _ = believed_arm
    held, phi = held_weight(model.assembly.arm, 1.0), ParameterLayout.of(model.assembly).phi
    postures = sample_postures(model.assembly.description, 16)[1:]
    way = informative_path(model, x, held, 0.7, postures)
    asked = {tuple(q): model.at_rest(q, x)[1][:, phi] @ held for q in postures}
    change = np.linalg.norm(asked[tuple(way.high)] - asked[tuple(way.low)])
    largest = max(np.linalg.norm(a - b) for a in asked.values() for b in asked.values())
    assert change > 0.7 * largest
    assert np.abs(asked[tuple(way.low)]).sum() <= np.abs(asked[tuple(way.high)]).sum()


@pytest.mark.parametrize("seconds", [0.0, 20.0])
@pytest.mark.parametrize("dt", [0.001, 0.004])
def test_it_is_the_same_tick_by_tick_as_in_a_table(seconds: float, dt: float, way: WeighingPath):
    path = way.cycles(seconds, dt)
    table = path.table()
    assert len(path) == len(table)
    q, v, a = (np.array(column) for column in zip(*map(path.at, range(len(path))), strict=True))
    # The table interpolates between the samples of the sine where it is eased.
    np.testing.assert_allclose(q, table.q, atol=3e-5)
    np.testing.assert_allclose(v, table.v, atol=1e-3)
    np.testing.assert_allclose(a, table.a, atol=2e-2)


def test_a_passage_is_the_same_tick_by_tick_as_in_a_table(way: WeighingPath):
    passage = Passage.planned(way.low, way.high, 0.6, 1.0, 0.004)
    table = passage.table()
    assert len(passage) == len(table)
    for tick in (0, 10, len(passage) - 1):
        np.testing.assert_allclose(passage.at(tick)[0], table.q[tick], rtol=1e-12)
