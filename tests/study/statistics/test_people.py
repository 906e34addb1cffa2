"""Each person is one number, independent of the number of touches; left-out touches are counted and named."""

import numpy as np
import pandas as pd
import pytest
from tests.study.statistics.made_up_touches import GROUPS, made_up_touches, touch_row

from exograv.errors import ConfigError
from exograv.study.dataset.tables import frame
from exograv.study.folder.columns import PARTICIPANTS, TOUCHES
from exograv.study.statistics.findings import Unit
from exograv.study.statistics.people import FLOOR, counted_touches, logs_of, people_of, spread_of


def counted(touches: pd.DataFrame, participants: pd.DataFrame, unit: Unit = "px"):
    return counted_touches(touches, participants, GROUPS, "flight", unit)


def test_a_person_s_number_is_the_median_of_own_touches():
    touches, participants = made_up_touches((2, 2))
    people = people_of(counted(touches, participants)[0], GROUPS)
    own = touches.loc[touches["participant"] == "T1"]["deviation_px"].to_numpy(float)
    assert [person.participant for person in people] == ["T1", "T2", "U1", "U2"]
    assert people[0].median == pytest.approx(np.median(own))
    assert people[0].log_median == pytest.approx(np.median(np.log(own)))
    assert people[0].touches == len(own)


def test_touches_told_twice_change_nobody_s_number():
    touches, participants = made_up_touches((2, 2))
    one = touches.loc[touches["participant"] == "U1"]
    twice = pd.concat([touches, one, one], ignore_index=True)
    once, more = (people_of(counted(table, participants)[0], GROUPS) for table in (touches, twice))
    assert logs_of(once, "untrained") == pytest.approx(logs_of(more, "untrained"))
    before, after = (spread_of(counted(table, participants)[0], "untrained") for table in (touches, twice))
    assert after.quartiles == pytest.approx(before.quartiles)
    assert (after.touches, after.people) == (before.touches + 2 * len(one), 2)


def test_a_touch_dead_on_the_centre_counts_as_half_a_pixel():
    participants = frame(PARTICIPANTS, [{"participant": "T1", "group": "trained"}])
    table, _ = counted(frame(TOUCHES, [touch_row("T1", 1, 0, 0.0)]), participants)
    assert table["log_deviation"].tolist() == [pytest.approx(np.log(FLOOR["px"]))]


def test_whatever_is_left_out_is_named():
    rows = [
        touch_row("T1", 1, 0, 50.0),
        touch_row("T1", 1, 1, 50.0, is_accepted=False, reason="palm"),
        touch_row("T1", None, 2, 50.0),
        touch_row("U1", 1, 0, 90.0, deviation_mm=None),
        touch_row("S1", 1, 0, 70.0),
        touch_row("X9", 1, 0, 70.0),
        touch_row("T2", 1, 0, 50.0, protocol="training"),
    ]
    groups = {"T1": "trained", "T2": "trained", "U1": "untrained", "S1": None, "C1": "control"}
    participants = frame(PARTICIPANTS, [{"participant": code, "group": group} for code, group in groups.items()])
    table, left_out = counted(frame(TOUCHES, rows), participants, "mm")
    assert table["participant"].tolist() == ["T1"]
    text = " ".join(left_out)
    for sentence in (
        "1 touches in 'flight' were rejected, each for its own reason.",
        "1 touches in 'flight' are outside of all windows.",
        "1 touches have no deviation in mm",
        "S1 has no group, or it is still sealed.",
        "C1 is in group 'control'",
        "T2 has no accepted touch in 'flight'.",
        "U1 has no accepted touch in 'flight'.",
        "X9 has touches but is not among the participants.",
    ):
        assert sentence in text
    assert len(left_out) == 8


def test_two_participants_with_one_code_are_refused():
    touches, participants = made_up_touches((2, 2))
    with pytest.raises(ConfigError, match="U2 occurs twice among the participants"):
        counted(touches, pd.concat([participants, participants.iloc[-1:]], ignore_index=True))


def test_nobody_at_all_is_no_crash():
    empty = frame(TOUCHES, [])
    table, _ = counted(empty, frame(PARTICIPANTS, []))
    assert people_of(table, GROUPS) == ()
    assert spread_of(table, "trained").median is None
