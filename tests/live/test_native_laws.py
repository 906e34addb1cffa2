"""The loop in C: never two commands in a period, never a torn or stale answer, never a torque that is no number."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from exograv.live import native_guard
from exograv.live.guard_job import GIVEN_UP_AFTER
from exograv.live.native import library, record
from exograv.live.native.record import HAPPENINGS, ORDERS, Happening, HappeningPlace, Order, OrderPlace, Outcome
from exograv.rig.drives.canopen.native import record as can_record
from exograv.rig.drives.native import record as machine_record
from exograv.rig.drives.udp.layout import Type
from exograv.rig.drives.udp.native import record as udp_record
from exograv.rig.drives.udp.packets import Packet, decode
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import LoopOutcome
from exograv.runtime.control_loop.exchange import DRIFTED
from exograv.safety.guard import WINDOW_MS
from exograv.safety.native import build, core
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

from .scripted_buses import CanWorld, UdpWorld
from .scripted_drives import DESCENT_S, GAIN, NativeSide, side
from .scripted_world import HUGE, NAN, OPEN_LOOPS, OTHER_MODE, SILENT, WRONG_MODE, Script, World, calm, wild

FAULT_AT, TICKS, PERIOD_NS = 150, 400, 1_000_000
BOUND = 4
"""Ticks without an answer, the fourth of which begins the descent (docs/explanation/safety.md)."""
DESCENT = round(DESCENT_S * 1e9 / PERIOD_NS)

needs_loop = pytest.mark.skipif(library.LIBRARY is None or LIBRARY is None, reason="needs the compiled loop and guard")


@contextlib.contextmanager
def flown(script: Script) -> Iterator[NativeSide]:
    with side(script, LIBRARY, UdpWorld) as one, contextlib.closing(NativeSide(one)) as native:
        yield native


def tick(native: NativeSide, period: int) -> list[Packet]:
    """Run one tick; return the commands that it sent."""
    world = native.side.world
    world.tick, world.now = period, max(world.now, 5_100_000_000 + period * PERIOD_NS)
    world.sent.clear()
    native.run(period)
    return [packet for packet in map(decode, world.sent) if packet.header.kind is Type.COMMAND]


def torques(commands: list[Packet]) -> np.ndarray:
    (command,) = commands
    return GAIN * np.array(command.joints[::2])


def stop_of(native: NativeSide) -> StopReason | None:
    return native.side.guard.envelope.stop


def happenings(native: NativeSide) -> list[tuple[Happening, float, int]]:
    found, place = [], HappeningPlace()
    while native.library.loop_hear(native.guarding.loop, place):
        found.append((Happening(place.kind), place.value, place.period))
    return found


def still(ticks: int) -> Script:
    """Return a calm course in which the machine stands: the descent has nothing to brake."""
    script = calm(ticks)
    script.q = 0.1 + 1e-7 * np.random.default_rng(0).standard_normal(script.q.shape)
    return script


@needs_loop
@pytest.mark.parametrize("seed", range(4))
def test_a_period_never_has_two_commands_and_a_command_is_never_sent_again(seed: int):
    script, sequences = wild(TICKS, seed, 0.2), list[int]()
    with flown(script) as native:
        for period in range(TICKS):
            commands = tick(native, period)
            assert len(commands) <= 1
            sequences += [command.header.sequence for command in commands]
    assert sequences == sorted(set(sequences))
    assert len(sequences) > TICKS // 2


@needs_loop
def test_a_stale_answer_is_held_for_three_ticks_and_becomes_a_descent_in_the_fourth():
    script = still(TICKS)
    script.control[FAULT_AT:] = SILENT
    with flown(script) as native:
        sent = [torques(tick(native, period)) for period in range(FAULT_AT + BOUND + DESCENT + 2)]
        assert happenings(native)[-1] == (Happening.STOP, [*StopReason].index(StopReason.CONTROL_SILENT) + 1, 153)
    held, bridged = sent[FAULT_AT - 1], sent[FAULT_AT : FAULT_AT + BOUND - 1]
    for tau in bridged:
        np.testing.assert_allclose(tau, held, rtol=1e-6)
    sizes = np.abs(sent[FAULT_AT + BOUND - 1 :]).max(axis=1)
    assert sizes[0] > 0.1
    assert sizes[-1] < 0.01


@needs_loop
@pytest.mark.parametrize("begun_done", [(0, 0), (1, 0), (0, 1), (1, -4), (-4, 1)])
def test_an_answer_that_is_only_half_written_is_not_read(begun_done: tuple[int, int]):
    with flown(calm(TICKS)) as native:
        for period in range(50):
            tick(native, period)
        assert native.side.guard.envelope.record.numbers[core.SPOKE] == 1.0
        native.side.world.script.control[50] = SILENT
        write_half(native, *begun_done)
        tick(native, 50)
        assert native.side.guard.envelope.record.numbers[core.SPOKE] == 0.0
        assert native.guarding.loop.unanswered == 1


def write_half(native: NativeSide, begun: int, done: int) -> None:
    """Leave an answer to the next measurement in the mailbox as an interrupted writer does.

    Args:
        native: Loop whose mailbox is written.
        begun: First word of the slot, as distance to the number of the value; 0 is a whole one.
        done: Last word of the slot, likewise.
    """
    block = native.side.answers._block
    count = int(block.head["written"][0]) + 1
    slot = block.rows[count % len(block.rows) :][:1]
    slot["value"] = block.rows[(count - 1) % len(block.rows)]["value"]
    slot["value"]["sequence"] += 1
    slot["begun"], slot["done"] = count + begun, count + done
    if (begun, done) == (0, 0):
        slot["value"]["sequence"] -= 2  # a whole value, but of the measurement before
    block.head["written"] = count


@needs_loop
@pytest.mark.parametrize(("what", "reason"), [(NAN, StopReason.NOT_FINITE), (OPEN_LOOPS, StopReason.MODEL_LOST)])
def test_a_number_that_is_none_or_a_lost_model_becomes_a_descent_with_finite_torques(what: int, reason: StopReason):
    script = still(TICKS)
    script.control[FAULT_AT] = what
    with flown(script) as native:
        sent = [torques(tick(native, period)) for period in range(FAULT_AT + DESCENT + 5)]
        assert stop_of(native) is reason
    assert np.isfinite(sent).all()
    assert np.abs(sent[-1]).max() < 0.01


@needs_loop
def test_a_huge_torque_changes_the_command_no_faster_than_the_envelope_allows():
    script = calm(TICKS)
    script.control[FAULT_AT:] = HUGE
    with flown(script) as native:
        sent = np.array([torques(tick(native, period)) for period in range(FAULT_AT + 20)])
        most = native.side.guard.envelope.limits.torque_rate_max_Nm_per_s * 1e-9 * PERIOD_NS
    assert np.abs(np.diff(sent, axis=0)).max() < most + 1e-5  # currents are sent with 24 bits


@needs_loop
def test_a_mode_that_does_not_exist_is_no_answer_and_does_not_end_the_loop():
    script = calm(TICKS)
    script.control[FAULT_AT:] = WRONG_MODE
    with flown(script) as native:
        for period in range(FAULT_AT + BOUND):
            tick(native, period)
        assert native.guarding.loop.unanswered == BOUND
        assert stop_of(native) is StopReason.CONTROL_SILENT
        assert native.guarding.loop.mode == 2


@needs_loop
def test_a_supervisor_that_falls_silent_costs_a_descent_and_a_supervisor_that_lives_costs_nothing():
    with flown(calm(TICKS)) as native:
        native.guarding.loop.alone_after_ns = 200 * PERIOD_NS
        for period in range(FAULT_AT):
            native.library.loop_beat(native.guarding.loop)
            tick(native, period)
        assert stop_of(native) is None
        for period in range(FAULT_AT, FAULT_AT + 210):
            tick(native, period)
        assert stop_of(native) is StopReason.STOP_PRESSED
        assert native.guarding.loop.is_ending
        assert [kind for kind, *_ in happenings(native)].count(Happening.ALONE) == 1


@needs_loop
def test_a_supervisor_that_reads_nothing_and_a_recorder_that_takes_nothing_do_not_stop_the_loop():
    script = calm(2 * HAPPENINGS + 200)
    script.control[120::2] = OTHER_MODE
    with flown(script) as native:
        native.guarding.loop.ticks.count = 300  # a recorder with a small ring
        sent = sum(len(tick(native, period)) for period in range(len(script.drives)))
        assert sent == len(script.drives)
        assert native.guarding.loop.unheard > 0
        assert native.side.ticks.lost == len(script.drives) - 300
        assert len(happenings(native)) == HAPPENINGS


@needs_loop
def test_an_order_without_room_is_given_back_to_the_supervisor():
    with flown(calm(TICKS)) as native:
        order, give = OrderPlace(Order.FEEL, (0.5, 0.0)), native.library.loop_order
        assert [give(native.guarding.loop, order) for _ in range(ORDERS + 1)] == [1] * ORDERS + [0]
        tick(native, 0)
        assert give(native.guarding.loop, order) == 1


@needs_loop
def test_a_late_tick_starts_at_once_and_periods_that_are_over_are_skipped():
    script = calm(TICKS)
    with flown(script) as native:
        world, loop, sleep = native.side.world, native.guarding.loop, native.side.world.sleep_until
        stalls = iter([10, 20])

        def oversleep(until_ns: int) -> None:
            world.tick = min(world.tick + 1, TICKS - 1)
            is_stalled = world.tick in (300, 301)
            sleep(until_ns + (next(stalls, 0) * PERIOD_NS if is_stalled else 0))

        world.sleep_until = oversleep  # type: ignore[method-assign]
        loop.periods = 200
        native.library.loop_run(loop)
        timing = native.guarding._measured()
    assert Outcome(loop.outcome) is Outcome.COMPLETE
    assert len(timing.period) < 200
    assert (np.diff(timing.period) >= 1).all()
    assert np.diff(timing.period).max() > 5
    commands = [packet for packet in map(decode, world.sent) if packet.header.kind is Type.COMMAND]
    assert len(commands) <= len(timing.period)


@needs_loop
def test_a_loop_is_complete_when_the_arm_is_down_after_the_end_of_its_time():
    with flown(calm(TICKS)) as native:
        loop = native.guarding.loop
        loop.flies = 200
        native.library.loop_run(loop)
        native.guarding.hear()
        report = native.guarding.report(native.guarding._measured(), Rights())
    assert report.timing.outcome is LoopOutcome.COMPLETE
    assert 200 < len(report.timing.period) < 300
    assert not report.latches


@needs_loop
def test_a_loop_that_finds_no_time_to_sleep_gives_the_processor_back():
    with flown(calm(TICKS)) as native:
        world, loop = native.side.world, native.guarding.loop
        send = world.sent_by_c

        def slow(data: bytes) -> int:
            world.now += PERIOD_NS
            return send(data)

        world.sent_by_c = slow  # type: ignore[method-assign]
        loop.periods, loop.ends_stopped = 5000, 0
        native.library.loop_run(loop)
    assert Outcome(loop.outcome) is Outcome.NO_REST
    assert loop.ran <= loop.rest_at_least_every + 2


@needs_loop
def test_a_control_that_is_given_up_is_waited_for_in_few_ticks_only():
    script = calm(TICKS)
    script.control[100:] = SILENT
    waits = []
    with flown(script) as native:
        for period in range(300):
            before = max(native.side.world.now, 5_100_000_000 + period * PERIOD_NS)
            tick(native, period)
            waits.append(native.side.world.now - before > PERIOD_NS // 2)
    assert all(waits[100 : 100 + GIVEN_UP_AFTER])
    assert 0 < sum(waits[120:]) <= 180 // 8 + 1
    assert WINDOW_MS < 100


@pytest.mark.parametrize("made", [record, machine_record, udp_record, can_record])
def test_the_headers_are_those_of_the_classes(made):
    assert made.HEADER.read_text(encoding="utf-8") == made.text()


@pytest.mark.skipif(build.compiler() is None, reason="needs a C compiler")
def test_a_loop_with_another_layout_is_not_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    path = tmp_path / "loop.native"
    if not library.build_loop(path):
        pytest.skip("the loop in C needs Linux")
    assert library.load(path) is not None
    constants = record.constants()
    monkeypatch.setattr(record, "constants", lambda: {**constants, "GUARD_N": 7})
    assert library.load(path) is None
    assert library.load(tmp_path / "missing.native") is None


@needs_loop
@pytest.mark.parametrize("make", [UdpWorld, CanWorld])
def test_the_loop_in_c_runs_only_what_it_knows(make: type[World], monkeypatch: pytest.MonkeyPatch):
    with side(calm(10), LIBRARY, make) as one:

        def is_native(job=one.job, made=one.made) -> bool:
            found = native_guard.native_guard(job, one.lines[0], made)  # type: ignore[arg-type]
            if found is not None:
                found.close()
            return found is not None

        assert is_native()
        object.__setattr__(one.job, "is_steered", True)
        assert not is_native()
        object.__setattr__(one.job, "is_steered", False)
        one.rig._lock_step = True
        assert not is_native()
        one.rig._lock_step = False
        monkeypatch.setattr(library, "LIBRARY", None)
        assert not is_native()
    monkeypatch.undo()
    with side(calm(10), None, make) as one:
        assert native_guard.native_guard(one.job, one.lines[0], one.made) is None  # type: ignore[arg-type]


@needs_loop
def test_the_supervisor_passes_a_large_finding_of_the_drift_monitor_on_and_the_loop_lowers_the_arm():
    with flown(calm(TICKS)) as native:
        guarding, row = native.guarding, native.side._row
        row["drift"], row["drift_joint"], row["drift_Nm"] = 1, 2, 0.6
        for period, level in enumerate((1, 1, 2, 2, 2)):
            row["drift"] = level
            tick(native, period)
            guarding._look_for_drift()
            while guarding._waiting:
                assert native.library.loop_order(guarding.loop, guarding._waiting.popleft())
            if level == 1:
                assert stop_of(native) is None
        assert stop_of(native) is StopReason.DRIFTED
        told = [event for event in native.side.events.take() if event["kind"] == b"warning"]
        assert len(told) == 2
        assert np.count_nonzero(native.side.ticks.take()["acts"] & DRIFTED) == 1
