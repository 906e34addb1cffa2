"""The outcome of a live run names the cause of a stop before it says how the loop ended."""

from dataclasses import replace

import numpy as np

from exograv.live.guard_job import GuardReport, StopLatch
from exograv.live.live_figures import outcome_of
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import PERIOD_NS, LoopOutcome, Timing
from exograv.safety.stops import StopReason


def report(outcome: LoopOutcome, *latches: StopLatch) -> GuardReport:
    ticks = np.arange(10)
    timing = Timing(ticks, 0 * ticks, 0 * ticks, 10, PERIOD_NS, outcome)
    return GuardReport(timing, Rights(), latches, 0, 0.01, 0)


def test_a_run_that_the_guard_ended_begins_with_the_cause_and_its_time():
    stop = StopLatch(StopReason.CONTROL_SILENT.value, 486, 0.486)
    said = outcome_of(report(LoopOutcome.ENDED_EARLY, stop))
    assert said.startswith("Control did not answer in time. The guard stopped the machine after 0.486 s.")
    assert "full time" not in said.replace("before its full time", "")


def test_a_run_without_a_stop_only_says_how_the_loop_ended():
    assert outcome_of(report(LoopOutcome.COMPLETE)) == LoopOutcome.COMPLETE.value


def test_a_stop_beside_slow_ticks_asks_for_a_longer_period():
    stopped = report(LoopOutcome.ENDED_EARLY, StopLatch(StopReason.CONTROL_SILENT.value, 486, 0.486))
    slow = replace(stopped, timing=replace(stopped.timing, compute_ns=np.full(10, 7 * PERIOD_NS // 10)))
    assert "took 0.70 of 1 ms (median)" in outcome_of(slow)
    assert "period_ms" in outcome_of(slow)
    assert "period_ms" not in outcome_of(stopped)
    assert "period_ms" not in outcome_of(replace(slow, latches=()))


def test_a_run_that_went_on_after_a_stop_says_both():
    said = outcome_of(report(LoopOutcome.COMPLETE, StopLatch(StopReason.TOO_FAST.value, 486, 0.486)))
    assert said.startswith(StopReason.TOO_FAST.value)
    assert said.endswith(LoopOutcome.COMPLETE.value)
