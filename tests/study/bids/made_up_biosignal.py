"""Made-up device with a known signal, a clock that drifts, stamps that jitter, and lost samples."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from exograv.recording import Recording
from exograv.recording.encoding import empty_ticks
from exograv.recording.stream_block import StreamBlock

BEGINS_S = 5.0
"""Time of the first tick on the rig's clock [s]."""

AHEAD_S = 7e4
"""Lead of CLOCK_MONOTONIC over the rig's clock [s]."""

TOPIC = "/lsl/device"
AMPLITUDE_UV = 100.0


def truth(t: np.ndarray, channel: int = 0, highest_Hz: float = 60.0) -> np.ndarray:
    """Signal at times of the session [µV]: 30 sines of incommensurate frequencies."""
    rng = np.random.default_rng(1000 + channel)
    frequencies, phases = rng.uniform(1.0, highest_Hz, 30), rng.uniform(0.0, 2.0 * np.pi, 30)
    waves = (np.sin(2.0 * np.pi * f * t + phase) for f, phase in zip(frequencies, phases, strict=True))
    return AMPLITUDE_UV / np.sqrt(15.0) * sum(waves)


@dataclass(frozen=True)
class MadeUpDevice:
    """Device that samples `truth` evenly by its own clock."""

    kind: str = "EEG"
    topic: str = TOPIC
    rate_Hz: float = 250.0
    seconds: float = 60.0
    channels: int = 2
    drift: float = 50e-6
    """Drift of the device's clock against CLOCK_MONOTONIC [s/s]."""

    rig_drift: float = -20e-6
    """Drift of the session's clock against CLOCK_MONOTONIC [s/s]."""

    jitter_s: float = 0.0
    """Standard deviation of the stamps [s]."""

    correction_s: float = 5e-5
    """Standard deviation of the corrections [s]."""

    lost: tuple[tuple[float, float], ...] = ()
    """Parts without samples, from and to [s of the session]."""

    reconnects_s: float = np.inf
    """Time of a new connection with another clock [s of the session]."""

    unit: str = "uV"
    labels: tuple[str, ...] = ("Cz", "Pz")
    extra: str = ""
    """Further description in XML."""

    seed: int = 0
    begins_s: float = 0.5
    _offsets: dict[int, float] = field(default_factory=lambda: {1: -3000.0, 2: 17.0})

    def monotonic(self, t: np.ndarray) -> np.ndarray:
        """CLOCK_MONOTONIC at times of the session."""
        return AHEAD_S + t * (1.0 + self.rig_drift)

    def clock(self, monotonic: np.ndarray, connection: int) -> np.ndarray:
        """Clock of the device."""
        return self._offsets[connection] + monotonic * (1.0 + self.drift)

    @property
    def t(self) -> np.ndarray:
        """Times of the samples that arrive, on the session's clock [s]."""
        period = 1.0 / self.rate_Hz / (1.0 + self.drift) / (1.0 + self.rig_drift)
        t = BEGINS_S + self.begins_s + np.arange(int(self.seconds * self.rate_Hz)) * period
        for begin, end in self.lost:
            t = t[(t < begin) | (t >= end)]
        return t

    def values(self, t: np.ndarray) -> np.ndarray:
        """Samples in the unit of the stream."""
        scale = {"uV": 1.0, "mV": 1e-3, "V": 1e-6}.get(self.unit, 1.0)
        return np.column_stack([scale * truth(t, k) for k in range(self.channels)]).astype(np.float32)

    def blocks(self, samples: int = 25) -> Iterator[StreamBlock]:
        """Yield what arrives."""
        rng, all_t = np.random.default_rng(self.seed), self.t
        for connection in (1, 2):
            t = all_t[(all_t >= self.reconnects_s) == (connection == 2)]
            stamps = self.clock(self.monotonic(t), connection) + self.jitter_s * rng.standard_normal(len(t))
            received, values = self.monotonic(t) + 0.01, self.values(t)
            for k in range(0, len(t), samples):
                part = slice(k, k + samples)
                yield StreamBlock(float(received[part][-1]), connection, stamps[part], values[part])

    def notes(self) -> list[dict[str, Any]]:
        """Messages of `/stream`."""
        unit = f"<unit>{self.unit}</unit>" if self.unit else ""
        channels = "".join(f"<channel><label>{label}</label>{unit}</channel>" for label in self.labels)
        xml = (
            f"<info><name>device of Mustermann</name><type>{self.kind}</type>"
            f"<channel_count>{self.channels}</channel_count><nominal_srate>{self.rate_Hz}</nominal_srate>"
            f"<channel_format>float32</channel_format><desc><channels>{channels}</channels>{self.extra}</desc></info>"
        )
        head = {"t": 0.0, "monotonic": 0.0, "topic": self.topic, "kind": "connected", "text": ""}
        return [{**head, "connection": number, "xml": xml} for number in (1, 2)]

    def corrections(self) -> list[dict[str, Any]]:
        """Messages of `/correction`: one in 5 s."""
        rng, found = np.random.default_rng(self.seed + 1), list[dict[str, Any]]()
        all_t = BEGINS_S + np.arange(0.0, self.seconds + 10.0, 5.0)
        for t, monotonic in zip(all_t.tolist(), self.monotonic(all_t).tolist(), strict=True):
            connection = 2 if t >= self.reconnects_s else 1
            remote = float(self.clock(np.array(monotonic), connection))
            offset = monotonic - remote + self.correction_s * rng.standard_normal()
            head = {"t": t, "topic": self.topic, "connection": connection, "asked": monotonic, "answered": monotonic}
            found.append({**head, "remote": remote, "offset": offset, "uncertainty": 1e-4})
        return found

    def recording(self) -> Recording:
        """Return a recording with the messages and some ticks."""
        t = BEGINS_S + np.arange(0.0, self.seconds + 10.0, 1.0)
        ticks = empty_ticks(len(t), 1)
        ticks["t"] = ticks["now"] = t
        ticks["monotonic"] = self.monotonic(t)
        messages = {"/stream": self.notes(), "/correction": self.corrections()}
        return Recording(Path("run.mcap"), {"joints": []}, ticks, None, messages)


def lags_of(values_uV: np.ndarray, t: np.ndarray, window: int, channel: int = 0) -> np.ndarray:
    """Delay of a signal against the truth in each window [s], by least squares of the first order."""
    step = 1e-5
    slope = (truth(t + step, channel) - truth(t - step, channel)) / (2.0 * step)
    away = values_uV - truth(t, channel)
    parts = range(0, len(t) - window + 1, window)
    return np.array(
        [-(slope[k : k + window] @ away[k : k + window]) / np.sum(slope[k : k + window] ** 2) for k in parts]
    )
