"""Timing of calls in turns, so that other load on the computer affects every implementation alike."""

import gc
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from peers.tasks.interface import Call, State

CALLS_MAX = 400
"""Largest number of calls per turn."""

WARM_UP = 2
"""Calls of each turn that are not counted: the implementation before has left its own data in the caches. A single call
that fills a turn outlasts this effect, and is counted."""

CLOCK_READINGS = 2000


@dataclass(frozen=True)
class Effort:
    """Number of rounds and time per turn."""

    rounds: int
    seconds_per_turn: float


@contextmanager
def quiet() -> Iterator[None]:
    """Switch Python's garbage collector off."""
    gc.collect()
    gc.freeze()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        gc.unfreeze()


def timed(
    calls: Mapping[str, Call], state_of_round: Callable[[int], State], effort: Effort
) -> dict[str, Float[np.ndarray, " call"]]:
    """Return the time of each call [ns] by implementation, without the time of reading the clock."""
    names = list(calls)
    counts = {name: _calls_a_turn(calls[name], state_of_round(0), effort) for name in names}
    times: dict[str, list[int]] = {name: [] for name in names}
    with quiet():
        own = clock_ns()
        for turn in range(effort.rounds):
            state = state_of_round(turn)
            # Another implementation begins each round, so that the order does not matter.
            for k in range(len(names)):
                name = names[(turn + k) % len(names)]
                call = calls[name]
                call.load(state)
                if counts[name] > 1:
                    _times(call.run, WARM_UP)
                times[name] += _times(call.run, counts[name])
    return {name: np.array(values, float) - own for name, values in times.items()}


def clock_ns() -> float:
    """Median time [ns] between two readings of the clock with nothing between them."""
    clock, readings = time.perf_counter_ns, [0] * CLOCK_READINGS
    for i in range(CLOCK_READINGS):
        start = clock()
        readings[i] = clock() - start
    return float(np.median(readings))


def _times(run: Callable[[], object], count: int) -> list[int]:
    clock, times = time.perf_counter_ns, [0] * count
    for i in range(count):
        start = clock()
        run()
        times[i] = clock() - start
    return times


def _calls_a_turn(call: Call, state: State, effort: Effort) -> int:
    call.load(state)
    call.run()
    typical = min(_times(call.run, WARM_UP)) * 1e-9
    return int(np.clip(effort.seconds_per_turn / max(typical, 1e-9), 1, CALLS_MAX))
