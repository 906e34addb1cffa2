"""Warm start: a participant's file is refused after two judgements in a row, and never after one."""

import re
from pathlib import Path

import pytest

from exograv.procedures.identification.person_check import JUDGED_S, PersonCheck
from exograv.procedures.identification.warm_start import FROM_FILE_S, WarmStart

FILTERED_S = 0.5
"""Time at the ends of a motion from which the filter gives no sample, with a margin [s]."""


def test_every_judgement_comes_before_the_end_of_the_motion_of_a_stored_arm():
    assert max(JUDGED_S) <= FROM_FILE_S - FILTERED_S


def returning(evidence: dict[float, float]) -> WarmStart:
    """Return the warm start of a participant whose file has these log evidences over the table."""
    one, check = object.__new__(WarmStart), object.__new__(PersonCheck)
    check.evidence = evidence
    one.path, one.code, one._check = Path("p-08.toml"), "P-08", check
    return one


@pytest.mark.parametrize(
    "evidence",
    [{5.0: -50.0}, {5.0: -50.0, 10.0: -4.9}, {5.0: -50.0, 10.0: 3.0, 19.0: -50.0}, {5.0: 4.0, 10.0: 5.0}],
)
def test_one_judgement_against_a_file_is_not_enough(evidence: dict[float, float]):
    assert not returning(evidence)._check.is_contradicted


@pytest.mark.parametrize("evidence", [{5.0: -5.1, 10.0: -50.0}, {5.0: 3.0, 10.0: -6.0, 19.0: -7.0}])
def test_two_judgements_running_refuse_it_by_name(evidence: dict[float, float]):
    one = returning(evidence)
    assert one._check.is_contradicted
    assert re.match(r"p-08\.toml belongs to another person.*'P-08'", str(one._contradicted(max(evidence))))
