"""Mean amplitude of EMG in each window: band-passed, freed from the mains, rectified."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy import signal

from exograv.recording import Recording, read_topics, tick_pieces
from exograv.recording.device_stream import DeviceStream, clock_ticks, joined
from exograv.recording.stream_block import StreamBlock
from exograv.recording.stream_pieces import other_pieces
from exograv.study.biosignal_channels import Stated, channels_of, statements_on, type_of
from exograv.study.even_times import Stretch, placed_stretches
from exograv.study.folder.columns import KEY, Column
from exograv.study.folder.stream_settings import StreamSettings
from exograv.study.sync import ARRIVAL_S

from .recordings import Window, complete_windows
from .table import Row

EMG = (
    *KEY,
    Column("window", "int64", "-", "number of the window, from 1"),
    Column("attempt", "int64", "-", "number of the attempt at the window, from 1"),
    Column("channel", "string", "-", "label of the EMG channel"),
    Column("amplitude_uV", "float64", "µV", "mean of the rectified signal in the window"),
)
"""Columns of the table of amplitudes."""

LOW_HZ = 20.0
"""Corner of the high-pass filter: below it, EMG of a moving arm is mostly movement of electrodes and cables.

Source: De Luca et al. 2010, J Biomech 43:1573.
"""

ORDER = 4
NOTCH_WIDTH_HZ = 2.0
"""Width of each notch at the mains and its multiples [Hz]."""

RATE_MIN_HZ = 200.0
"""Slowest stream whose amplitude is computed."""

MARGIN_S = 1.0
"""Time around a window that the filters need to settle."""

COVERED_MIN = 0.9
"""Share of a window that must have samples."""


@dataclass(frozen=True)
class EmgAmplitudes:
    """Amplitudes of one session."""

    rows: list[Row]
    """Rows of the table `EMG`."""

    remarks: tuple[str, ...]
    """Reasons why a stream of EMG has no amplitudes."""


def emg_amplitudes(path: Path, key: dict[str, Any], stated: Stated, tell: Callable[[], object]) -> EmgAmplitudes:
    """Compute the amplitude of each EMG channel in each complete window of a recording.

    Args:
        path: The recording.
        key: Participant, protocol and session.
        stated: Statements of the study about streams.
        tell: Called before samples are read.

    Raises:
        RecordingError: The recording cannot be read.
    """
    recording = read_topics(path, ("/task", "/stream", "/correction"))
    remarks, rows = list[str](), list[Row]()
    for stream in emg_streams(path, recording, stated, tell):
        found = amplitudes_of(stream, statements_on(stream, stated), complete_windows(recording))
        if isinstance(found, str):
            remarks.append(found)
        else:
            rows += [{**key, **row} for row in found]
    return EmgAmplitudes(rows, tuple(remarks))


def emg_streams(path: Path, recording: Recording, stated: Stated, tell: Callable[[], object]) -> list[DeviceStream]:
    """Return the EMG streams with all samples; ticks relate the clocks."""
    notes, corrections = recording.messages("/stream"), recording.messages("/correction")
    empty = [
        joined(topic, "", (), notes, corrections, np.empty(0)) for topic in {note["topic"]: None for note in notes}
    ]
    topics = {one.topic for one in empty if type_of(one, statements_on(one, stated)) == "EMG"}
    if not topics:
        return []
    tell()
    blocks: dict[str, list[StreamBlock]] = {topic: [] for topic in topics}
    for topic, block in other_pieces(path):
        if topic in blocks and isinstance(block, StreamBlock):
            blocks[topic].append(block)
    pieces = [clock_ticks(ticks) for ticks in tick_pieces(path)]
    if not pieces:
        return []
    ticks = np.concatenate(pieces)
    return [joined(topic, "", of, notes, corrections, ticks) for topic, of in blocks.items() if of]


def amplitudes_of(stream: DeviceStream, stated: StreamSettings, windows: Sequence[Window]) -> list[Row] | str:
    """Return the amplitudes of a stream, or the reason why there are none.

    Args:
        stream: Stream with samples.
        stated: Statements of the study on it.
        windows: Windows of the session.
    """
    channels = channels_of(stream, "EMG", stated)
    if isinstance(channels, str):
        return channels
    if why := unusable(stream):
        return why
    stretches = placed_stretches(stream, stream.stamps, stream.connection)
    filters, rows = filters_of(stream.nominal_rate_Hz, stated.power_line_Hz), list[Row]()
    chosen = [k for k, one in enumerate(channels) if one.type == "EMG"]
    for window in windows:
        means = _mean_rectified(stream, stretches, window, chosen, filters)
        for k, mean in zip(chosen, means.tolist(), strict=True):
            if np.isfinite(mean) and mean > 0.0:
                place = {"window": window.window, "attempt": window.attempt}
                rows.append({**place, "channel": channels[k].name, "amplitude_uV": channels[k].scale * mean})
    return rows


def unusable(stream: DeviceStream) -> str:
    """Return the reason why a stream of EMG has no amplitudes at known times; empty if it has them."""
    if stream.nominal_rate_Hz < RATE_MIN_HZ:
        return f"it has {stream.nominal_rate_Hz:g} samples per second; at least {RATE_MIN_HZ:g} are needed"
    delay = stream.received - stream.monotonic
    if not np.isfinite(delay).any() or not np.isfinite(stream.ticks["monotonic"]).any():
        return "its time on the robot's clock is not known"
    if not ARRIVAL_S[0] <= np.nanmedian(delay) <= ARRIVAL_S[1]:
        return "it does not stamp by LSL's clock, so its time is not known"
    return ""


def filters_of(rate_Hz: float, power_line_Hz: float | None) -> Float[np.ndarray, "section 6"]:
    """Return the high-pass filter, and a notch at each multiple of the mains, as second-order sections."""
    sections = [np.asarray(signal.butter(ORDER, LOW_HZ, "highpass", fs=rate_Hz, output="sos"))]
    if power_line_Hz is not None:
        multiples = np.arange(power_line_Hz, 0.45 * rate_Hz, power_line_Hz).tolist()
        notches = [signal.tf2sos(*signal.iirnotch(at, at / NOTCH_WIDTH_HZ, rate_Hz)) for at in multiples]
        sections += [np.asarray(one) for one in notches]
    return np.concatenate(sections)


def _mean_rectified(
    stream: DeviceStream,
    stretches: Sequence[Stretch],
    window: Window,
    channels: Sequence[int],
    filters: Float[np.ndarray, "section 6"],
) -> Float[np.ndarray, " channel"]:
    """Return the mean of the rectified signals in a window; NaN if samples are missing."""
    total, count = np.zeros(len(channels)), 0
    for stretch in stretches:
        first, end = np.searchsorted(stretch.t, [window.opened_s - MARGIN_S, window.closed_s + MARGIN_S])
        t = stretch.t[first:end]
        if len(t) < RATE_MIN_HZ * MARGIN_S:
            continue
        values = np.asarray(stream.values[stretch.first + first : stretch.first + end], float)[:, list(channels)]
        filtered = signal.sosfiltfilt(filters, values, axis=0)
        is_in = (t >= window.opened_s) & (t <= window.closed_s)
        total += np.abs(filtered[is_in]).sum(0)
        count += int(np.count_nonzero(is_in))
    expected = (window.closed_s - window.opened_s) * stream.nominal_rate_Hz
    return total / count if count >= COVERED_MIN * expected and count else np.full(len(channels), np.nan)
