"""Open loop: one method processes a recorded stream sample by sample, as in the loop."""

import gc
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from jaxtyping import Float

from exograv.identification.baselines.anthropometric import Anthropometric
from exograv.identification.core.interface import Agreement, Checkable, Estimate, Method
from exograv.procedures.identification.check_motion import PlannedCheck

from .streams import Samples

DURATIONS_S = (20.0, 60.0, 120.0)
"""Motion times after which all measures are evaluated [s]."""

NOTE_S = 1.0
"""Time between two estimates [s]."""

WORK = 10.0
"""Ratio of an update's duration to that of an update that only advances the clock, above which the update counts as
work [-]."""

WORK_SHARE_MIN = 0.002
"""Smallest share of working samples [-]. A smaller share comes from pauses of the computer, not from the method."""

IDLE_SAMPLES = 2000


@dataclass(frozen=True)
class MethodTrace:
    """Estimates and times of one method during the motion."""

    estimates: list[Estimate]
    update_us: Float[np.ndarray, " update"]
    """Processor time of the updates that did work [µs]."""

    work_share: float
    """Share of the samples on which the method worked [-]."""

    estimate_us: Float[np.ndarray, " estimate"]
    """Processor time of each estimate [µs]; empty if not measured."""

    method_s: float
    """Processor time of all updates and estimates [s]."""

    agreement: Agreement | None = None
    """Check of the estimate at unused postures; None if the method or the motion has none."""


def replay(method: Method, samples: Samples, check: PlannedCheck | None = None) -> MethodTrace:
    """Feed all samples; those of a `check` also test the estimate.

    Estimate once a second and at the end, or after `DURATIONS_S` if the method is off-line. The method's earlier rests
    count as motion time. Until they are over, its first estimate is used.
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
            if check is not None and sample.t >= check.from_s:
                _hold_out(method, check)
                check = None
            # The thread's processor time is measured, not wall time: other programs must not count.
            before = time.thread_time_ns()
            update(sample)
            times[k] = time.thread_time_ns() - before
            if len(estimates) < len(notes) and sample.t > notes[len(estimates)] - 1e-9:
                note()
    agreement = method.agreement() if isinstance(method, Checkable) else None
    _finish(method)
    note()
    update_us = 1e-3 * times
    worked = update_us[update_us > WORK * idle_us]
    if len(worked) < WORK_SHARE_MIN * len(samples):
        worked = worked[:0]
    share, method_s = len(worked) / len(samples), time.thread_time() - start
    return MethodTrace(estimates, worked, share, 1e-3 * np.array(estimate_ns, dtype=float), method_s, agreement)


def _hold_out(method: Method, check: PlannedCheck) -> None:
    if isinstance(method, Checkable):
        method.hold_out(check.postures)


def is_offline(method: Method) -> bool:
    """Return True if the method computes its estimate from all samples at once, and slowly."""
    return bool(getattr(method, "offline", False))


def _note_times(method: Method, end: float) -> Sequence[float]:
    """List the times before the end at which estimates are due [s]."""
    if is_offline(method):
        return [t for t in DURATIONS_S if t < end - NOTE_S]
    return np.arange(NOTE_S, end - 1e-3, NOTE_S).tolist()


def _finish(method: Method) -> None:
    """Finish as a session does: a method that can relinearise all samples does so once more."""
    relinearise = getattr(method, "relinearise", None)
    if relinearise is not None:
        relinearise()


def _idle_us(samples: Samples) -> float:
    """Median time of an update that only sets a clock [µs]."""
    nothing = np.zeros(1)
    update, times = Anthropometric(nothing, np.zeros((1, 1))).update, []
    for sample in islice(samples, IDLE_SAMPLES):
        before = time.thread_time_ns()
        update(sample)
        times.append(time.thread_time_ns() - before)
    return 1e-3 * float(np.median(times))


@contextmanager
def _no_collection() -> Iterator[None]:
    """Disable Python's garbage collector, as in the loop."""
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
