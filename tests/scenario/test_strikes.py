"""Killed, stopped and starved processes of a live run lose no acknowledged sample, and the arm comes down."""

import pytest

from exograv.campaigns.faults.fault_participants import load_participant, prepare_participant
from exograv.campaigns.faults.process_faults import strike
from exograv.campaigns.faults.strikes import KINDS
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.live.live_control import LivePlan


@pytest.mark.slow
def test_no_strike_takes_an_acknowledged_sample_or_lets_a_torque_out_of_the_envelope(tmp_path):
    known = load_participant(prepare_participant(7, 0, 2, tmp_path))
    found = strike(
        LivePlan(
            known.laboratory.description,
            known.laboratory.form,
            known.prepared,
            known.person,
            0.0,
            cooperative_machine(known.laboratory, 0, known.prepared.t),
        ),
        1,
        lambda _text, _share: None,
    )
    assert found.live.acknowledged_missing == 0
    assert found.live.envelope_violations == 0
    assert found.live.ticks > 0
    assert found.live.not_struck == []
    rows = found.by_fault
    assert set(rows) == {*KINDS, "F17 live"}
    assert [row.runs for row in rows.values()] == [1] * len(rows)
    assert {name for name, row in rows.items() if row.missed} == set()
    assert found.live.control_restarts == found.live.recorder_restarts == 1
