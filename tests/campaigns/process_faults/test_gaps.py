"""Gaps are those of the guard's ticks after the strike; several flights are pooled by their counts."""

import numpy as np
import pytest
from tests.campaigns.process_faults.made_up_process_flights import STRUCK_S, Course, evidence_of

from exograv.campaigns.process_faults.evidence import RecordedTicks
from exograv.campaigns.process_faults.gaps import TickGaps, gaps_of, pooled


def test_a_missing_tick_after_the_strike_is_the_worst_gap():
    ticks = evidence_of(Course()).ticks
    assert ticks is not None
    late = np.abs(ticks.t - STRUCK_S - 0.5) > 2.5e-3
    gaps = gaps_of(
        evidence_of(Course(), ticks=RecordedTicks(ticks.t[late], ticks.safe_state[late], ticks.sequence[late]))
    )
    assert (gaps.p50_ms, gaps.worst_ms, gaps.source) == (1.0, pytest.approx(6.0, abs=0.01), "recording")


def test_without_a_recording_the_commands_at_the_drives_count():
    assert gaps_of(evidence_of(Course(), ticks=None)).source == "drives"


def test_without_any_tick_after_the_strike_there_is_no_gap():
    assert gaps_of(evidence_of(Course(silent_s=-0.5))) == TickGaps()


def test_pooled_gaps_weigh_each_tick_once():
    long, short = TickGaps(histogram={"500": 1}), TickGaps(histogram={"100": 98, "110": 1})
    both = pooled([long, short])
    assert (both.p50_ms, both.p99_ms, both.worst_ms) == (1.0, 1.1, 5.0)
    assert pooled([]) == TickGaps()
