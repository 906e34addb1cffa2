"""Open loop: one method meets a recorded stream, sample by sample, as it would have in the loop."""

import gc
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from jaxtyping import Float

from exograv.identification.baselines.anthropometric import Anthropometric
from exograv.identification.core.interface import Estimate, Method

from .streams import Samples

DURATIONS_S = (20.0, 60.0, 120.0)
"""Of motion, after which everything is judged."""

NOTE_S = 1.0
"""From one estimate to the next [s]."""

WORK = 10.0
"""An update counts as work where it takes more than so many times as long as one that only sets a clock [-]."""

WORK_SHARE_MIN = 0.002
"""Of the samples; where fewer take so long it is the computer that paused, not the method that worked [-]."""

IDLE_SAMPLES = 2000


@dataclass(frozen=True)
class MethodTrace:
    """What one method said while the arm moved."""

    estimates: list[Estimate]
    update_us: Float[np.ndarray, " update"]
    """Processor time of the updates that did work [µs]."""

    work_share: float
    """Share of the samples that were worked on [-]."""

    estimate_us: Float[np.ndarray, " estimate"]
    """The same of the estimates; empty where it was not taken [µs]."""

    method_s: float
    """The same of everything that the method did [s]."""


def replay(method: Method, samples: Samples) -> MethodTrace:
    """Feed all samples; take the estimate once a second and at the end, of an off-line method after `DURATIONS_S`.

    Rests that the method took before count as motion: until they are over, its estimate is the first one.
    """
    rest_s = float(getattr(method, "rest_s", 0.0))
    notes = _note_times(method, float(samples.t[-1]))
    update, times = method.update, np.empty(len(samples))
    estimates, estimate_ns = [], []

    def note() -> None:
        before = time.thread_time_ns()
        estimate = method.estimate()
        estimate_ns.append(time.thread_time_ns() - before)
        estimates.append(replace(estimate, t=estimate.t + rest_s))

    idle_us = _idle_us(samples)
    start = time.thread_time()
    with _no_collection():
        for k, sample in enumerate(samples):
            # Time of this thread, not of the clock on the wall: whatever else the computer does is not the method's.
            before = time.thread_time_ns()
            update(sample)
            times[k] = time.thread_time_ns() - before
            if len(estimates) < len(notes) and sample.t > notes[len(estimates)] - 1e-9:
                note()
    _finish(method)
    note()
    update_us = 1e-3 * times
    worked = update_us[update_us > WORK * idle_us]
    if len(worked) < WORK_SHARE_MIN * len(samples):
        worked = worked[:0]
    share, method_s = len(worked) / len(samples), time.thread_time() - start
    return MethodTrace(estimates, worked, share, 1e-3 * np.array(estimate_ns, dtype=float), method_s)


def is_offline(method: Method) -> bool:
    """Whether the method computes its estimate from everything at once, and slowly."""
    return bool(getattr(method, "offline", False))


def _note_times(method: Method, end: float) -> Sequence[float]:
    """When estimates are due before the end [s]."""
    if is_offline(method):
        return [t for t in DURATIONS_S if t < end - NOTE_S]
    return np.arange(NOTE_S, end - 1e-3, NOTE_S).tolist()


def _finish(method: Method) -> None:
    """As a session ends: a method that can take everything into account once more does."""
    relinearise = getattr(method, "relinearise", None)
    if relinearise is not None:
        relinearise()


def _idle_us(samples: Samples) -> float:
    """Median time of an update that does nothing but set a clock [µs]."""
    nothing = np.zeros(1)
    update, times = Anthropometric(nothing, np.zeros((1, 1))).update, []
    for sample in islice(samples, IDLE_SAMPLES):
        before = time.thread_time_ns()
        update(sample)
        times.append(time.thread_time_ns() - before)
    return 1e-3 * float(np.median(times))


@contextmanager
def _no_collection() -> Iterator[None]:
    """As in the loop, Python's garbage collector waits."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
