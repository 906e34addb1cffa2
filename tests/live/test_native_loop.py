"""The loop in C sends the same packets, keeps the same guard and records the same rows as the loop in Python."""

import contextlib
from collections.abc import Iterator, Mapping

import numpy as np
import pytest

from exograv.live.guard_job import TIME_IS_OVER
from exograv.live.native import library
from exograv.runtime.control_loop.exchange import FeltLevel, PersonUpdate
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

from .scripted_buses import CanWorld, UdpWorld
from .scripted_drives import NativeSide, PythonSide, limits_of_person, side
from .scripted_world import Script, World, calm, wild

TICKS, SEEDS = 400, range(12)

pytestmark = pytest.mark.skipif(library.LIBRARY is None or LIBRARY is None, reason="needs the compiled loop and guard")

Words = Mapping[int, object]


@contextlib.contextmanager
def both(script: Script, make: type[World], lasts: int) -> Iterator[tuple[PythonSide, NativeSide]]:
    with (
        side(script, LIBRARY, make, lasts) as native,
        side(script, LIBRARY, make, lasts) as python,
        pytest.MonkeyPatch.context() as patch,
        contextlib.closing(NativeSide(native)) as in_c,
        contextlib.closing(PythonSide(python, patch)) as in_python,
    ):
        yield in_python, in_c


def advance(one: PythonSide | NativeSide, script: Script, period: int) -> bool:
    """Run the tick of a period, late as the script says."""
    world = one.side.world
    world.tick = period
    begins = 5_100_000_000 + period * one.side.job.period_ns
    world.now = max(world.now, begins + int(script.overslept_ns[period]))
    return one.run(period)


def refuse_any_difference(in_python: PythonSide, in_c: NativeSide, period: int) -> None:
    ours, theirs = in_python.side, in_c.side
    assert ours.world.sent == theirs.world.sent, period
    ours.world.sent.clear()
    theirs.world.sent.clear()
    (left,), (right,) = ours.ticks.take(), theirs.ticks.take()
    for name in left.dtype.names:
        assert left[name].tobytes() == right[name].tobytes(), (period, name, left[name], right[name])
    ours_record, theirs_record = (one.guard.envelope.record.view for one in (ours, theirs))
    np.testing.assert_array_equal(ours_record.view(np.int64), theirs_record.view(np.int64), f"record, {period}")
    assert str(ours.states.read()) == str(theirs.states.read())


def fly_both(script: Script, words: Words, make: type[World], lasts: int = 10_000) -> tuple[list[str], list[str], int]:
    """Fly both loops, whose time is over after `lasts` ticks; return the texts of their events, and the ticks flown."""
    with both(script, make, lasts) as (in_python, in_c):
        period = 0
        for period in range(len(script.drives)):
            if period in words:
                in_c.order(words[period])
            is_over = advance(in_c, script, period)
            was_over = advance(in_python, script, period)
            if period in words:
                in_python.order(words[period])
            refuse_any_difference(in_python, in_c, period)
            assert is_over == was_over
            if is_over:
                break
        in_c.guarding.hear()
        texts = [[row["text"].decode() for row in one.side.events.take()] for one in (in_python, in_c)]
        assert in_python.guarding._unanswered == in_c.guarding.loop.unanswered
        assert len(in_python.guarding._latches) == len(in_c.guarding._latches)
        ours, theirs = (one.side.guards.take() for one in (in_python, in_c))
        assert len(ours) > 0
        assert ours.tobytes() == theirs.tobytes()
        in_c.take_back()
        assert in_c.side.rig.counts == in_python.side.rig.counts
        return texts[0], texts[1], period + 1


@pytest.mark.parametrize("make", [UdpWorld, CanWorld])
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("share", [0.01, 0.05, 0.5])
def test_both_loops_send_keep_and_record_the_same_whatever_drives_and_control_do(
    seed: int, share: float, make: type[World]
):
    words = {30: FeltLevel(0.7), 90: PersonUpdate(limits_of_person(25.0)), 130: limits_of_person(28.0)}
    words |= {150: FeltLevel(0.2, 0.5), 330: "stop"}
    ours, theirs, _ = fly_both(wild(TICKS, seed, share), words, make)
    assert sorted(ours) == sorted(theirs)


@pytest.mark.parametrize(("make", "descent_ticks"), [(UdpWorld, 50), (CanWorld, 25)])
def test_a_run_without_faults_is_the_same_to_its_end_and_ends_after_stop(make: type[World], descent_ticks: int):
    ours, theirs, ticks = fly_both(calm(TICKS), {200: "stop"}, make)
    assert sorted(ours) == sorted(theirs)
    assert 190 + descent_ticks < ticks < 220 + descent_ticks


@pytest.mark.parametrize(("make", "descent_ticks"), [(UdpWorld, 50), (CanWorld, 25)])
def test_at_the_end_of_its_time_a_run_lets_the_arm_down_which_counts_as_no_stop(make: type[World], descent_ticks: int):
    ours, theirs, ticks = fly_both(calm(TICKS), {}, make, lasts=200)
    assert sorted(ours) == sorted(theirs)
    assert 200 + descent_ticks <= ticks < 220 + descent_ticks
    assert TIME_IS_OVER in ours
    assert StopReason.STOP_PRESSED.value not in ours


@pytest.mark.parametrize("seed", SEEDS)
def test_both_loops_agree_at_the_end_of_their_time_whatever_drives_and_control_do(seed: int):
    ours, theirs, _ = fly_both(wild(TICKS, seed, 0.01), {}, (UdpWorld, CanWorld)[seed % 2], lasts=150)
    assert sorted(ours) == sorted(theirs)


@pytest.mark.parametrize("make", [UdpWorld, CanWorld])
def test_the_loop_in_c_records_the_positions_that_the_drives_send_and_sends_the_torques_of_control(make: type[World]):
    script = calm(100)
    with side(script, LIBRARY, make) as one, contextlib.closing(NativeSide(one)) as native:
        for period in range(100):
            advance(native, script, period)
        rows = one.ticks.take()
        np.testing.assert_allclose(rows["q_measured"], script.q, atol=6e-6)  # counts of the encoders
        assert np.abs(one.world.currents).min() > 0.0
