"""An ablation gives the change of transfer without a mechanism, in the same people."""

import numpy as np
import pytest
from tests.campaigns.virtual_study.made_up_flights import comparison

from exograv.campaigns.virtual_study.ablation import ALL_ON, MECHANISMS, ablated_rows, sentences
from exograv.campaigns.virtual_study.options import StudyOptions
from exograv.campaigns.virtual_study.transfer import PairedCareers, change


def flown() -> list:
    """Flights in which all transfer of one half is lost without slow states, and no other mechanism matters."""
    shares = {"slow states learn nothing": 1.0, "none of these three learns": 1.0}
    return [comparison({"dam": shares.get(one.name, 0.5)}) for one in MECHANISMS]


def test_every_mechanism_can_be_put_out_of_action():
    for one in MECHANISMS:
        _ = StudyOptions(constants=one.constants).habits


def test_no_two_mechanisms_share_a_folder():
    assert len({one.folder for one in MECHANISMS}) == len(MECHANISMS)


def test_the_change_is_that_of_transfer():
    rows = ablated_rows("dam", flown())
    assert rows[0].off == ALL_ON.name
    assert rows[0].change is None
    assert [row.change for row in rows[1:]] == pytest.approx([-0.5, 0.0, 0.0, -0.5, *[0.0] * 5], abs=1e-12)


def test_a_mechanism_without_which_nothing_is_left_is_named_and_others_are_not_shown():
    said = " ".join(sentences(ablated_rows("dam", flown())))
    assert "It changes where slow states learn nothing (−0.50" in said
    assert "not shown where the fast state learns nothing (+0.00" in said


def test_where_nothing_can_be_told_the_reason_is():
    rows = ablated_rows("dam", [comparison({"dam": 0.5}, people=1) for _ in MECHANISMS])
    assert all(row.change_ci95 is None for row in rows)
    assert all(row.reason for row in rows)
    assert "cannot be told where" in " ".join(sentences(rows))


def test_the_interval_of_a_change_holds_the_truth_as_often_as_it_says():
    random, held, studies = np.random.default_rng(1000), 0, 500
    for _ in range(studies):
        before = 30.0 + 5.0 * random.standard_normal(6)
        usual, own = (share * before + 3.0 * random.standard_normal(6) for share in (0.4, 0.7))
        people = tuple(range(6))
        told = change(PairedCareers(people, own, before, ()), PairedCareers(people, usual, before, ()))
        assert told.ci95 is not None
        held += told.ci95[0] <= -0.3 <= told.ci95[1]
    # Three standard errors of a share of 95 % in 500 studies.
    assert held / studies == pytest.approx(0.95, abs=0.03)
