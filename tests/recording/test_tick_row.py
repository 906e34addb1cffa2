"""A tick as one packed write: the row has the table's names, and an array of another kind is refused."""

import numpy as np
import pytest

from exograv.recording.schema import TICK
from exograv.recording.tick_block import STAGED, TickBlock
from exograv.recording.tick_row import JOINT_FIELDS, SCALARS, TickRow, tick_row

JOINTS = 3
NEEDED = ("closure_slope", "tick_us", "q_measured", "q_reference", "v", "current", "tau_measured", "tau_feedforward")


def row(k: int) -> TickRow:
    """Return a row in which every value differs from every other, and from those of other ticks."""
    scalars = [1000.0 * k + place for place in range(len(SCALARS))]
    arrays = [np.arange(JOINTS) + 1000.0 * k + 100.0 + 10.0 * n for n in range(len(JOINT_FIELDS))]
    return TickRow._make([*scalars, *arrays])


def block() -> TickBlock:
    return TickBlock(1, JOINTS, 1_000_000)


def test_a_row_has_the_fields_of_the_table_in_its_order_without_the_phase():
    assert TickRow._fields == tuple(field.name for field in TICK.fields if field.name != "phase")


def test_each_value_is_in_its_own_column_before_and_after_the_stage_is_full():
    ticks, count = block(), STAGED + 7
    for k in range(count):
        ticks.phase = k // 5
        ticks.add(row(k))
    assert len(ticks) == count
    for name in TickRow._fields:
        np.testing.assert_array_equal(ticks.ticks[name], [getattr(row(k), name) for k in range(count)], name)
    np.testing.assert_array_equal(ticks.ticks["phase"], np.arange(count) // 5)


def test_packed_rows_come_behind_the_staged_ones():
    ticks, others = block(), block()
    for k in range(3):
        ticks.add(row(k))
        others.add(row(10 + k))
    ticks.add_rows(others.ticks)
    ticks.add(row(20))
    np.testing.assert_array_equal(ticks.ticks["t"], [1000.0 * k for k in (0, 1, 2, 10, 11, 12, 20)])


@pytest.mark.parametrize("wrong", [np.zeros(JOINTS + 1), np.zeros(JOINTS - 1), np.zeros(JOINTS, np.float32)])
def test_an_array_of_another_size_or_kind_is_refused_and_not_recorded(wrong: np.ndarray):
    ticks = block()
    with pytest.raises(ValueError, match="must be"):
        ticks.add(row(0)._replace(v=wrong))
    assert len(ticks) == 0


def test_a_missing_and_an_unknown_value_are_refused_by_name():
    values = dict.fromkeys(NEEDED, 0.0) | {"t": 0.0, "tau_desired": 0.0, "tau_commanded": 0.0}
    assert np.isnan(tick_row(values, JOINTS).q_motor).all()
    with pytest.raises(ValueError, match="colour"):
        tick_row(values | {"colour": 0.0}, JOINTS)
    with pytest.raises(ValueError, match="tick_us"):
        tick_row({name: value for name, value in values.items() if name != "tick_us"}, JOINTS)
