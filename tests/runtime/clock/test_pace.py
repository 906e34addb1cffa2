"""The simulation waits for the wall clock, and a late tick does not delay those after it."""

import pytest

from exograv.runtime.clock import pace
from exograv.runtime.clock.pace import RealTimePace

PERIOD_S = 0.001


class Clock:
    """Clock that advances only by sleep or work."""

    def __init__(self):
        self.now = 100.0
        self.slept: list[float] = []

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += seconds


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(pace, "time", made)
    return made


def test_each_tick_ends_at_its_own_time(clock: Clock):
    one = RealTimePace(PERIOD_S)
    for tick in range(1, 6):
        clock.now += 0.0003  # work
        one.wait()
        assert clock.now == pytest.approx(100.0 + tick * PERIOD_S)


def test_a_late_tick_does_not_wait_and_the_next_ones_catch_up(clock: Clock):
    one = RealTimePace(PERIOD_S)
    clock.now += 0.0025
    one.wait()
    one.wait()
    assert clock.slept == []
    one.wait()
    assert clock.now == pytest.approx(100.003)
