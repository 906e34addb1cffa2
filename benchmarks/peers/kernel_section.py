"""Measurements of exograv itself: identification updates, and distance of its kernels from the limit of a core."""

from dataclasses import asdict
from typing import Any

from exograv.errors import KernelError
from peers.opponents import Native

from .limit import limits_of
from .measurement import Report
from .peaks import measure_peaks
from .plan import task
from .updates import time_updates

LIMITED = (
    "rnea_4", "rnea_7", "torque_gradient_4", "torque_gradient_7",
    "tick_aligned_4", "tick_aligned_7", "tick_general_4", "tick_general_7",
)  # fmt: skip
SECONDS, SECONDS_QUICK = 60.0, 15.0
"""Motion that updates are timed on [s]."""


def own_section(order: dict[str, Any], report: Report) -> None:
    """Time the updates, then compute the limits."""
    report({"share": 0.0, "text": "identification updates"})
    time_updates(SECONDS_QUICK if order["quick"] else SECONDS, report)
    report({"share": 0.5, "text": "limits of this core"})
    report({"at": ["limits", None]})
    try:
        peaks = measure_peaks()
    except KernelError as error:
        report({"missing": {"implementation": Native.name, "row": "limits", "reason": str(error)}})
        return
    report({"peaks": {name: _short(value) for name, value in asdict(peaks).items()}})
    for name in LIMITED:
        report({"limit": limits_of(task(name), peaks)})


def _short(value: float | dict[str, float]) -> float | dict[str, float]:
    if isinstance(value, dict):
        return {kind: float(f"{each:.3g}") for kind, each in value.items()}
    return float(f"{value:.3g}")
