"""The long table holds every measure of the catalogue once per object, with its unit."""

from collections import Counter

import pytest
from tests.study.made_up_study import made_up_study

from exograv.study.dataset.tables import Tables, frame
from exograv.study.folder.columns import TABLES
from exograv.study.measures.catalogue import MEASURES
from exograv.study.measures.selecting import keys, rows
from exograv.study.measures.table import MEASURED, SESSION, measures_of


def test_no_two_measures_of_a_level_have_one_name():
    assert max(Counter((m.level, m.name) for m in MEASURES).values()) == 1


def test_every_measure_that_touches_can_tell_is_in_the_table_and_no_other():
    protocols = {"trained": {"training": 8}}
    tables = made_up_study({"trained": 1}, protocols, windows=7, rest_s=lambda window: 500.0 if window == 3 else 90.0)
    found = measures_of(tables)
    expected = {(m.level, m.name) for m in MEASURES if m.origin == "touches"}
    assert set(zip(found["level"], found["measure"], strict=True)) == expected
    assert list(found.columns) == [column.name for column in MEASURED]


def test_the_median_of_a_session_is_that_of_its_touches():
    tables = made_up_study({"trained": 2})
    found = measures_of(tables)
    found = rows(found, (found["measure"] == "median_deviation_px") & (found["level"] == "session"))
    expected = tables.touches.groupby(SESSION)["deviation_px"].median()
    assert dict(zip(keys(found, SESSION), found["value"], strict=True)) == pytest.approx(expected.to_dict())


def test_a_study_in_which_nobody_touched_anything_has_no_measures():
    empty = Tables(**{name: frame(columns, []) for name, columns in TABLES.items()})
    assert measures_of(empty).empty
