"""Envelopes of recorded EMG at given times, as shares of a contraction: signals for an identification."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy import signal

from exograv.errors import RecordingError
from exograv.recording import read_topics
from exograv.recording.device_stream import DeviceStream
from exograv.study.biosignal_channels import channels_of
from exograv.study.even_times import placed_stretches
from exograv.study.folder.stream_settings import StreamSettings

from .emg_amplitude import emg_streams, filters_of, unusable

ENVELOPE_HZ = 4.0
"""Corner of the low-pass filter of the rectified signal; muscles build up torque in about 0.1 s."""

STRONG = 95.0
"""Percentile of the envelope that counts as the size of a contraction: its highest values are noise [%]."""

Times = Float[np.ndarray, " sample"]
Interval = tuple[float, float]
"""First and last time [s]."""


@dataclass(frozen=True)
class EmgEnvelopes:
    """Envelopes of all EMG channels of a recording."""

    labels: tuple[str, ...]
    values: Float[np.ndarray, "sample channel"]
    """Size above rest, as a share of the size in the contraction [-]; NaN where samples are missing."""


def envelopes_at(
    path: Path, t: Times, rest_s: Interval, contraction_s: Interval, power_line_Hz: float | None
) -> EmgEnvelopes:
    """Return the envelopes of the EMG streams in a recording.

    Args:
        path: The recording.
        t: Times on the machine's clock, as in the ticks of the recording [s].
        rest_s: Interval in which the muscles rest, on the same clock [s].
        contraction_s: Interval with a maximum voluntary contraction of every muscle, one after the other [s].
        power_line_Hz: Frequency of the mains that a notch removes; None for no notch.

    Raises:
        RecordingError: There is no EMG, its times are not known, or an interval has no samples.
    """
    recording = read_topics(path, ("/stream", "/correction"))
    labels, columns = list[str](), list[Times]()
    for stream in emg_streams(path, recording, {}, lambda: None):
        channels = channels_of(stream, "EMG", StreamSettings())
        why = channels if isinstance(channels, str) else unusable(stream)
        if isinstance(channels, str) or why:
            raise RecordingError(f"{path}: the EMG stream '{stream.topic}' cannot be used: {why}.")
        chosen = [k for k, one in enumerate(channels) if one.type == "EMG"]
        shown = [envelope(stream, chosen, power_line_Hz, at) for at in (t, _grid(rest_s), _grid(contraction_s))]
        for place, k in enumerate(chosen):
            columns.append(_share(path, channels[k].name, *(one[:, place] for one in shown)))
            labels.append(channels[k].name)
    if not labels:
        raise RecordingError(f"{path} has no EMG stream. Record one with --record-stream, of the LSL type EMG.")
    return EmgEnvelopes(tuple(labels), np.column_stack(columns))


def _grid(interval_s: Interval) -> Times:
    return np.arange(*interval_s, 0.1 / ENVELOPE_HZ)


def _share(
    path: Path,
    label: str,
    shown: Times,
    rest: Float[np.ndarray, " resting"],
    contraction: Float[np.ndarray, " contracting"],
) -> Times:
    for name, values in (("rest", rest), ("contraction", contraction)):
        if not np.isfinite(values).any():
            raise RecordingError(f"{path}: the channel '{label}' has no samples in the interval of the {name}.")
    low, high = float(np.nanmedian(rest)), float(np.nanpercentile(contraction, STRONG))
    if high <= low:
        raise RecordingError(
            f"{path}: the channel '{label}' is not larger in the contraction ({high:.3g}) than at rest ({low:.3g}). "
            "Check the two intervals, and the electrodes."
        )
    return (shown - low) / (high - low)


def envelope(
    stream: DeviceStream, channels: Sequence[int], power_line_Hz: float | None, t: Times
) -> Float[np.ndarray, "sample channel"]:
    """Return the size of the signal of some channels at the times `t`, in their unit; NaN where samples are missing."""
    found = np.full((len(t), len(channels)), np.nan)
    rate_Hz = stream.nominal_rate_Hz
    filters = filters_of(rate_Hz, power_line_Hz)
    smooth = np.asarray(signal.butter(2, ENVELOPE_HZ, fs=rate_Hz, output="sos"))
    for stretch in placed_stretches(stream, stream.stamps, stream.connection):
        inside = (t >= stretch.t[0]) & (t <= stretch.t[-1])
        if len(stretch.t) < rate_Hz or not inside.any():
            continue
        values = np.asarray(stream.values[stretch.first : stretch.first + len(stretch.t)], float)[:, list(channels)]
        sizes = signal.sosfiltfilt(smooth, np.abs(signal.sosfiltfilt(filters, values, axis=0)), axis=0)
        found[inside] = np.column_stack([np.interp(t[inside], stretch.t, column) for column in sizes.T])
    return found
