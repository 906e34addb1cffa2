"""A participant's file is refused by two judgements running, and never by one."""

from pathlib import Path

import pytest

from exograv.errors import IdentificationError
from exograv.session.returning import Returning


def judged(evidence: dict[float, float]) -> None:
    """The rule, after these log evidences of the file over the table."""
    one = object.__new__(Returning)
    one.path, one.code, one.evidence = Path("p-08.toml"), "P-08", evidence
    one._refuse_contradicted(max(evidence))


@pytest.mark.parametrize(
    "evidence",
    [{5.0: -50.0}, {5.0: -50.0, 10.0: -4.9}, {5.0: -50.0, 10.0: 3.0, 20.0: -50.0}, {5.0: 4.0, 10.0: 5.0}],
)
def test_one_judgement_against_a_file_is_not_enough(evidence: dict[float, float]):
    judged(evidence)


@pytest.mark.parametrize("evidence", [{5.0: -5.1, 10.0: -50.0}, {5.0: 3.0, 10.0: -6.0, 20.0: -7.0}])
def test_two_judgements_running_refuse_it_by_name(evidence: dict[float, float]):
    with pytest.raises(IdentificationError, match=r"p-08\.toml is not this person's.*'P-08'"):
        judged(evidence)
