"""Measurements of exograv itself: identification updates, and how near its kernels come to what a core can do."""

from typing import Any

from .contest import Report
from .limit import limits_of
from .peaks import measure_peaks
from .plan import task
from .updates import time_updates

LIMITED = (
    "rnea_4", "rnea_7", "torque_gradient_4", "torque_gradient_7",
    "tick_aligned_4", "tick_aligned_7", "tick_general_4", "tick_general_7",
)  # fmt: skip
SECONDS, SECONDS_QUICK = 60.0, 15.0
"""Of motion that updates are timed on."""


def own_section(order: dict[str, Any], report: Report) -> None:
    """Updates, then limits."""
    report({"share": 0.0, "text": "identification updates"})
    time_updates(SECONDS_QUICK if order["quick"] else SECONDS, report)
    report({"share": 0.5, "text": "what this core can do"})
    report({"at": ["limits", None]})
    peaks = measure_peaks()
    report({"peaks": {"latency_ns": _short(peaks.latency_ns), "single_ns": _short(peaks.single_ns),
                      "batch_ns": _short(peaks.batch_ns), "call_ns": round(peaks.call_ns, 1)}})  # fmt: skip
    for name in LIMITED:
        report({"limit": limits_of(task(name), peaks)})


def _short(values: dict[str, float]) -> dict[str, float]:
    return {kind: float(f"{value:.3g}") for kind, value in values.items()}
