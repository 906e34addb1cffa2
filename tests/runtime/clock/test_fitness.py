"""A computer may drive a worn machine only if each criterion holds; the answer gives reasons and next steps."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.runtime.clock.fitness import PERIODS_FOR_GOAL, judge
from exograv.runtime.clock.host import Host
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import PERIOD_NS, LoopOutcome, Timing

GOOD_HOST = Host("Linux 6.12", False, True, (3,), (0, 1, 2), ("performance",), "tsc")
GOOD_RIGHTS = Rights(is_fifo=True, is_locked=True)


def timing(periods: int = 30_000, late: int = 0, lateness_us: int = 300, compute_us: int = 40) -> Timing:
    """Return a run in which `late` ticks started late."""
    lateness = np.zeros(periods, dtype=np.int64)
    lateness[:late] = 1000 * lateness_us
    compute = np.full(periods, 1000 * compute_us)
    return Timing(np.arange(periods), lateness, compute, periods, PERIOD_NS, LoopOutcome.COMPLETE)


def test_a_prepared_and_punctual_computer_is_accepted():
    fitness = judge(timing(), GOOD_RIGHTS, GOOD_HOST)
    assert fitness.may_drive_worn
    assert fitness.prepare == []
    assert "100 % of 30000 ticks" in fitness.reasons[0]


def test_a_good_run_claims_no_more_than_its_length_shows():
    short = " ".join(judge(timing(), GOOD_RIGHTS, GOOD_HOST).reasons)
    assert "at most 1 missed period in 10000; the goal is 1 in 100000" in short
    long = " ".join(judge(timing(PERIODS_FOR_GOAL), GOOD_RIGHTS, GOOD_HOST).reasons)
    assert "goal" not in long


def test_on_an_ordinary_kernel_a_good_run_states_that_delays_have_no_bound():
    fitness = judge(timing(), GOOD_RIGHTS, replace(GOOD_HOST, is_realtime_kernel=False))
    assert fitness.may_drive_worn
    assert "nothing bounds them" in " ".join(fitness.reasons)
    assert "linux-image-rt-amd64" in " ".join(fitness.prepare)


AGAINST = {
    "a virtual machine": (timing(), GOOD_RIGHTS, replace(GOOD_HOST, is_virtual=True), "its host can stop it"),
    "no real-time scheduling": (timing(), replace(GOOD_RIGHTS, is_fifo=False), GOOD_HOST, "real-time scheduling"),
    "memory that is not locked": (timing(), replace(GOOD_RIGHTS, is_locked=False), GOOD_HOST, "locked memory"),
    "too short a test": (timing(9_999), GOOD_RIGHTS, GOOD_HOST, "too short"),
    "a tick in five hundred late": (timing(late=60), GOOD_RIGHTS, GOOD_HOST, "99.8 % of the ticks started within 200"),
    "one late by a period": (timing(late=1, lateness_us=1001), GOOD_RIGHTS, GOOD_HOST, "1 of 30000 periods ended"),
    "a tick that is too long": (timing(compute_us=1001), GOOD_RIGHTS, GOOD_HOST, "30000 of 30000"),
    "a loop that was stopped": (replace(timing(), outcome=LoopOutcome.NO_REST), GOOD_RIGHTS, GOOD_HOST, "was stopped"),
}


@pytest.mark.parametrize("case", AGAINST)
def test_one_failed_criterion_is_enough_and_is_the_only_reason(case: str):
    run, rights, host, words = AGAINST[case]
    fitness = judge(run, rights, host)
    assert not fitness.may_drive_worn
    (reason,) = fitness.reasons
    assert words in reason


def test_exactly_the_required_share_is_enough():
    assert judge(timing(late=30), GOOD_RIGHTS, GOOD_HOST).may_drive_worn
    assert not judge(timing(late=31), GOOD_RIGHTS, GOOD_HOST).may_drive_worn


def test_a_share_is_never_rounded_up_over_its_limit():
    (reason,) = judge(timing(100_000, late=101), GOOD_RIGHTS, GOOD_HOST).reasons
    assert reason.startswith("99.89 % ")


UNPREPARED = {
    "a right that was refused": (Rights(True, True, [], ["Do this."]), GOOD_HOST, "Do this."),
    "no processor kept free": (GOOD_RIGHTS, replace(GOOD_HOST, isolated_cpus=()), "isolcpus=2"),
    "one processor": (GOOD_RIGHTS, replace(GOOD_HOST, isolated_cpus=(), cpus=(0,)), "two processors or more"),
    "processors that save power": (GOOD_RIGHTS, replace(GOOD_HOST, governors=("powersave",)), "performance"),
    "a slow clock": (GOOD_RIGHTS, replace(GOOD_HOST, clock_source="hpet"), "'hpet'"),
    "a hypervisor": (GOOD_RIGHTS, replace(GOOD_HOST, is_virtual=True), "without a hypervisor"),
}


@pytest.mark.parametrize("case", UNPREPARED)
def test_a_missing_preparation_is_named_with_its_remedy(case: str):
    rights, host, words = UNPREPARED[case]
    (step,) = judge(timing(), rights, host).prepare
    assert words in step
