"""Timing of the live loop on this computer, without and with real-time rights, and the verdict for worn machines.

The loop runs in a process of its own, like live control. In this process the progress line would compete for the
interpreter.
"""

import multiprocessing
import signal
import sys
from collections.abc import Callable, MutableSequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from exograv.errors import ConfigError, ExogravError, RigError
from exograv.results import MERGED
from exograv.runtime.clock.fitness import PERIODS_FOR_GOAL, WOKEN_WITHIN_NS, judge
from exograv.runtime.clock.host import Host, loop_cpus, read_host
from exograv.runtime.clock.real_time_loop import run_loop
from exograv.runtime.clock.realtime import Rights, realtime
from exograv.runtime.clock.timing import EDGES_US, PERIOD_NS, Percentiles, Timing, percentiles_us
from exograv.runtime.processes.spawn import start_quietly

SECONDS_MIN, SECONDS_MAX = 2.0, 7200.0  # the longest holds 170 MB of times
HALVES = ("ordinary", "real-time")
WARM_UP_TICKS = 500  # first calls fault pages in and fill caches
POLL_S = 0.2
END_S = 5.0  # for the loop's process to end

Progress = Callable[[str, float], None]
Loop = Callable[[Callable[[int], object], int], Timing]


@dataclass(frozen=True)
class LatenessHistogram:
    """Histogram of lateness, one count per pair of edges."""

    edges_us: tuple[int, ...]
    counts: list[int]


@dataclass(frozen=True)
class ScheduledLoop:
    """Timing of the loop with one kind of scheduling."""

    scheduling: str
    granted: tuple[str, ...]
    refused: tuple[str, ...]
    outcome: str
    seconds: float
    ticks: int
    effective_rate_Hz: float
    longest_gap_us: float
    late_share: float
    woken_share: float
    missed: int
    lateness_us: Percentiles
    compute_us: Percentiles
    command_us: Percentiles
    histogram: LatenessHistogram


@dataclass(frozen=True)
class LoopFigures:
    """Timing with both kinds of scheduling, and the verdict."""

    rate_Hz: float
    rows: tuple[ScheduledLoop, ScheduledLoop]
    may_drive_worn: bool
    reasons: list[str]
    prepare: list[str]
    computer: Host


@dataclass(frozen=True)
class LoopTest:
    """Result of `exograv doctor --loop`."""

    seconds: float
    figures: LoopFigures = field(metadata=MERGED)
    open_ticks: int


def loop_test(seconds: float, progress: Progress) -> LoopTest:
    """Run the loop for half of `seconds` without and for half with real-time rights, with a row for each.

    Raises:
        ConfigError: The time cannot be used, or the system is not Linux.
        RigError: The loop's process died.
    """
    refuse_unusable(seconds)
    context = multiprocessing.get_context("spawn")
    place = context.RawArray("q", [-1, 0])
    receiver, sender = context.Pipe(duplex=False)
    periods = round(seconds / 2 * 1e9 / PERIOD_NS)
    process = context.Process(target=_loop_process, args=(periods, place, sender), daemon=True)
    start_quietly(process, _loop_process)
    sender.close()
    try:
        result = _await(process, receiver, lambda: _show(progress, place, periods))
    finally:
        # The process is ended in any case; rights and locks belong to it and end with it.
        process.kill()
        process.join(END_S)
    if isinstance(result, ExogravError):
        raise result
    return LoopTest(seconds, *result)


def refuse_unusable(seconds: float) -> None:
    """Refuse a duration or system that cannot be used, before the loop is built.

    Raises:
        ConfigError: See `loop_test`.
    """
    if not SECONDS_MIN <= seconds <= SECONDS_MAX:
        raise ConfigError(
            f"--loop is {seconds:g}; allowed: {SECONDS_MIN:g} to {SECONDS_MAX:g} s. One half runs without, one half "
            "with real-time rights; a verdict needs 20 s."
        )
    if not sys.platform.startswith("linux"):
        raise ConfigError(f"--loop needs Linux, and this is {sys.platform}. A worn machine is driven from Linux only.")


def measure(
    work: Callable[[int], object],
    periods: int,
    host: Host,
    begin: Callable[[int], object] = lambda _half: None,
    loop: Loop = run_loop,
) -> LoopFigures:
    """Measure both halves in this process, and judge. `begin` gets the index in `HALVES` before each half."""
    begin(0)
    ordinary = _row(HALVES[0], loop(work, periods), Rights())
    begin(1)
    with realtime(loop_cpus(host).guard) as rights:
        timing = loop(work, periods)
    fitness = judge(timing, rights, host)
    prepare = list(fitness.prepare)
    if periods < PERIODS_FOR_GOAL:
        seconds = 2e-9 * PERIODS_FOR_GOAL * timing.period_ns
        prepare.append(
            f"Then run `exograv doctor --loop {seconds:.0f}` under the load of a session, because an idle computer is "
            "punctual."
        )
    rows = ordinary, _row(HALVES[1], timing, rights)
    return LoopFigures(1e9 / timing.period_ns, rows, fitness.may_drive_worn, fitness.reasons, prepare, host)


def _row(name: str, timing: Timing, rights: Rights) -> ScheduledLoop:
    return ScheduledLoop(
        scheduling=name,
        granted=tuple(rights.granted),
        refused=tuple(rights.refused),
        outcome=timing.outcome.value,
        seconds=round(timing.seconds, 3),
        ticks=len(timing.period),
        effective_rate_Hz=round(timing.effective_rate_Hz, 3),
        longest_gap_us=round(timing.longest_gap_us, 1),
        late_share=timing.late_share,
        woken_share=timing.woken_within(WOKEN_WITHIN_NS),
        missed=timing.missed,
        lateness_us=percentiles_us(timing.lateness_ns),
        compute_us=percentiles_us(timing.compute_ns),
        command_us=percentiles_us(timing.command_ns),
        histogram=LatenessHistogram(EDGES_US, timing.histogram()),
    )


def _loop_process(periods: int, place: MutableSequence[int], results: Connection) -> None:
    """Run the loop's process: build, warm up, measure and send the result."""
    try:
        from .nominal_tick import MovingTick

        tick = MovingTick(1e-9 * PERIOD_NS)
        for period in range(WARM_UP_TICKS):
            tick(period)

        def work(period: int) -> None:
            tick(period)
            place[1] = period

        def begin(half: int) -> None:
            place[1] = 0
            place[0] = half

        results.send((measure(work, periods, read_host(), begin), tick.open_ticks))
    except ExogravError as error:
        results.send(error)


def _await(process: BaseProcess, receiver: Connection, show: Callable[[], None]) -> Any:
    while not receiver.poll(POLL_S):
        show()
    try:
        return receiver.recv()
    except EOFError:
        process.join(END_S)
        raise RigError(_obituary(process.exitcode)) from None


def _obituary(exit_status: int | None) -> str:
    if exit_status == -getattr(signal, "SIGXCPU", 24):
        return (
            "The system ended the loop: a tick did not return, and would have blocked its processor. "
            "A computer or a kernel this slow cannot drive a machine; see the line 'tick' of `exograv doctor`."
        )
    return f"The loop's process died (exit status {exit_status}). Read its messages above, then repeat."


def _show(progress: Progress, place: MutableSequence[int], periods: int) -> None:
    half, period = place
    if half < 0:
        progress("Building the tick", 0.0)
    else:
        progress(f"Loop at 1 kHz, {HALVES[half]} scheduling", period / periods)
