"""Streams that a live run publishes: joint state, torque and markers, sent by the recorder process.

The recorder copies these values anyway. The stamp of a sample is the time of its measurement on CLOCK_MONOTONIC, which
is LSL's own clock on Linux. It is computed from the two clocks of the tick, not from the time of sending.
"""

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from .library import lsl

KEPT_S = 10
"""Data kept for a slow consumer [s]; it misses older data, so that it cannot fill the recorder's memory."""

JOINT_STATE = (("q_measured", "rad"), ("v", "rad/s"))
TORQUE = (("tau_desired", "N·m"), ("tau_commanded", "N·m"), ("tau_measured", "N·m"))
"""Fields of a tick that are published per joint, with their units."""


@dataclass(frozen=True)
class OutletsJob:
    """Description of a run's streams. It names the machine, and never a person."""

    rig: str
    joints: tuple[str, ...]
    period_s: float

    token: str = field(default_factory=lambda: secrets.token_hex(8))
    """Part of each `source_id` of the run, by which a consumer finds the streams again after a recorder restart."""


@dataclass(frozen=True)
class _Columns:
    """Stream of numbers: its name, its type in LSL, and its fields."""

    name: str
    kind: str
    fields: tuple[tuple[str, str], ...]


STREAMS = (
    _Columns("exograv-joints", "JointState", JOINT_STATE),
    _Columns("exograv-torque", "Torque", TORQUE),
)
MARKERS = "exograv-markers"


class Outlets:
    """Streams of one run."""

    def __init__(self, job: OutletsJob):
        """Open the streams.

        Raises:
            ConfigError: LSL is not installed.
        """
        self._waiting = list[tuple[float, str]]()
        """Markers that wait for a tick: time on the rig's clock [s] and text."""
        self._numbers = [_numbers(job, columns) for columns in STREAMS]
        self._markers = marker_outlet(job)

    def publish(self, ticks: np.ndarray, events: Sequence[np.void] | np.ndarray) -> None:
        """Send new ticks (tick,) of `recording.encoding.tick_dtype` and new events of `recorder_process.EVENT`.

        An event waits for the first tick that is not older. This tick translates its time on the rig's clock.

        Raises:
            RuntimeError: The library has failed.
        """
        ticks = ticks[np.isfinite(ticks["monotonic"])]
        for row in events:
            kind, text = (bytes(row[name]).decode(errors="replace") for name in ("kind", "text"))
            self.mark(float(row["t"]), f"{kind}: {text}")
        if not len(ticks):
            return
        stamps = (ticks["monotonic"] + (ticks["t"] - ticks["now"])).tolist()
        for columns, outlet in zip(STREAMS, self._numbers, strict=True):
            outlet.push_chunk(samples(ticks, columns.fields), stamps)
        self._push_markers(ticks)

    def mark(self, t: float, text: str) -> None:
        """Send a marker of the time `t` on the rig's clock [s], with the next ticks."""
        self._waiting.append((t, text))

    def _push_markers(self, ticks: np.ndarray) -> None:
        while self._waiting and (later := int(np.searchsorted(ticks["now"], self._waiting[0][0]))) < len(ticks):
            (t, text), tick = self._waiting.pop(0), ticks[later]
            self._markers.push_sample([text], float(tick["monotonic"] + (t - tick["now"])))


def marker_outlet(job: OutletsJob):
    """Open a stream of texts for any process that has markers to send.

    Raises:
        ConfigError: LSL is not installed.
    """
    info = lsl().StreamInfo(MARKERS, "Markers", 1, 0.0, "string", f"exograv-{job.token}-markers")
    _describe(info, job, [("marker", "text")])
    return lsl().StreamOutlet(info, 0, KEPT_S)


def samples(ticks: np.ndarray, fields: tuple[tuple[str, str], ...]) -> Float[np.ndarray, "tick channel"]:
    """Return time on the rig's clock and the number of the measurement, then each field joint by joint."""
    return np.column_stack([ticks["t"], ticks["sequence"], *(ticks[name] for name, _ in fields)]).astype(np.float64)


def labels(job: OutletsJob, fields: tuple[tuple[str, str], ...]) -> list[tuple[str, str]]:
    """Return name and unit of each channel of `samples`."""
    return [
        ("t", "s"),
        ("sequence", "1"),
        *((f"{name}/{joint}", unit) for name, unit in fields for joint in job.joints),
    ]


def _numbers(job: OutletsJob, columns: _Columns):
    channels, rate = labels(job, columns.fields), 1.0 / job.period_s
    source = f"exograv-{job.token}-{columns.kind.lower()}"
    info = lsl().StreamInfo(columns.name, columns.kind, len(channels), rate, "double64", source)
    _describe(info, job, channels)
    return lsl().StreamOutlet(info, 0, KEPT_S)


def _describe(info, job: OutletsJob, channels: list[tuple[str, str]]) -> None:
    """Add the description, with the names of the XDF meta-data conventions (github.com/sccn/xdf/wiki/Meta-Data)."""
    description = info.desc()
    acquisition = description.append_child("acquisition")
    acquisition.append_child_value("manufacturer", "exograv")
    acquisition.append_child_value("model", job.rig)
    clock = description.append_child("synchronization")
    clock.append_child_value("time_source", "CLOCK_MONOTONIC of the computer that runs the machine, at the measurement")
    clock.append_child_value("can_drop_samples", "true")
    parent = description.append_child("channels")
    for label, unit in channels:
        channel = parent.append_child("channel")
        channel.append_child_value("label", label)
        channel.append_child_value("unit", unit)
