"""The mixed model finds the law of the data, agrees with the fast one, and reports every failure."""

import numpy as np
import pandas as pd
import pytest
from tests.study.statistics.made_up_touches import GROUPS, made_up_touches

from exograv.study.statistics.mixed import CAVEAT, mixed_fit
from exograv.study.statistics.people import counted_touches
from exograv.study.statistics.random_intercept import fit, sums_of


def counted(**law) -> pd.DataFrame:
    touches, participants = made_up_touches(**law)
    return counted_touches(touches, participants, GROUPS, "flight", "px")[0]


@pytest.mark.parametrize("people", [(3, 3), (5, 4)])
@pytest.mark.parametrize("is_balanced", [True, False])
def test_the_fast_fit_agrees_with_statsmodels(people: tuple[int, int], is_balanced: bool):
    table = counted(people=people, windows=1, touches=30)
    if not is_balanced:
        kept = [own.iloc[: 8 + 5 * int(str(code)[1])] for code, own in table.groupby("participant")]
        table = pd.concat(kept, ignore_index=True)
    theirs = mixed_fit(table, GROUPS)
    assert theirs is not None
    ours = fit(sums_of(table, GROUPS))
    assert theirs.ratio is not None
    assert ours.difference[0] == pytest.approx(np.log(theirs.ratio), abs=1e-4)
    assert ours.person_sd[0] == pytest.approx(theirs.person_sd, rel=2e-3)
    assert ours.touch_sd[0] == pytest.approx(theirs.touch_sd, rel=2e-3)
    assert theirs.interval is not None
    assert theirs.interval.high is not None
    error = np.log(theirs.interval.high / theirs.ratio) / 1.959964
    assert ours.error[0] == pytest.approx(error, rel=2e-3)


def test_many_people_and_touches_give_back_what_was_put_in():
    found = mixed_fit(counted(people=(40, 40), windows=2, touches=30), GROUPS)
    assert found is not None
    assert found.converged
    assert found.person_sd == pytest.approx(0.35, rel=0.25)
    assert found.touch_sd == pytest.approx(0.6, rel=0.05)
    assert found.ratio == pytest.approx(np.exp(-0.7), rel=0.25)


def test_the_caveat_goes_with_every_fit():
    found = mixed_fit(counted(), GROUPS)
    assert found is not None
    assert CAVEAT in found.remarks
    assert found.p_wald is not None
    assert found.p_between is not None
    assert found.p_wald < found.p_between


def test_people_who_do_not_differ_are_said_to_be_suspicious():
    table = counted(windows=2, touches=5)
    own = table.groupby("participant")["log_deviation"].transform("mean")
    group = table.groupby("group")["log_deviation"].transform("mean")
    found = mixed_fit(table.assign(log_deviation=table["log_deviation"] - own + group), GROUPS)
    assert found is not None
    assert any("implausible" in remark or "converge" in remark or "warned" in remark for remark in found.remarks)


def test_touches_that_are_all_alike_give_a_failure_that_is_said():
    table = counted()
    found = mixed_fit(table.assign(log_deviation=1.0), GROUPS)
    assert found is not None
    assert (found.converged, found.p_wald) == (False, None)
    assert "a mixed model cannot be fitted" in found.remarks[0]


def test_one_person_in_a_group_has_no_mixed_model():
    assert mixed_fit(counted(people=(1, 3)), GROUPS) is None
