"""Signals of a simulated amplifier: EEG at rest, EMG of the muscles' torque, trigger channel, and analog input.

The signals have the form of real ones (spectrum, size, growth with effort), so that recording, export and analysis can
be tried. They model no brain, and EMG follows the torque of a freedom and not a muscle.
"""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

Signals = Float[np.ndarray, "sample channel"]
Times = Float[np.ndarray, " sample"]

EEG_HZ, EMG_HZ = 250.0, 1000.0
EEG_LABELS = ("Fz", "C3", "Cz", "C4", "P3", "Pz", "P4", "Oz")
TRIGGER = "TRIG"
"""Name of the channel that is 1 during a pulse, and 0 otherwise."""

ANALOG = "AUX"
"""Name of the analog input: a sample is the share of the time since the sample before in which the pulse is high.

The converter of an amplifier takes such means. They show the edge of a pulse between two samples.
"""

PULSE_S = 0.01
"""Duration of a pulse [s], as of a trigger box: a pulse of one sample may be lost when samples are resampled."""

EEG_SD_uV, ALPHA_HZ, ALPHA_uV = 10.0, 10.0, 8.0
"""Standard deviation of the background, and the alpha rhythm: order of resting EEG, assumed."""

BACKGROUND_S = 0.05
"""Correlation time of the background [s], assumed: power falls above 3 Hz."""

EMG_REST_uV, EMG_uV_PER_NM = 3.0, 15.0
"""Standard deviation of surface EMG at rest, and its growth with torque: order of surface EMG, assumed."""

LINE_HZ, LINE_uV = 50.0, 2.0
"""Interference of the mains in each channel, assumed."""


@dataclass
class Pulses:
    """Pulses on trigger and analog input, which may be announced shortly before or after their first sample was due."""

    rate_Hz: float
    _waiting: list[float] = field(default_factory=list)
    _analog: list[float] = field(default_factory=list)
    _until: float = -np.inf
    """End of the last pulse on the trigger channel [s]."""

    def add(self, t: float) -> None:
        """Add a pulse at the time `t` [s]."""
        self._waiting.append(t)
        self._analog.append(t)

    def in_samples(self, times: Times) -> Signals:
        """Return trigger and analog input in the next samples."""
        return np.column_stack([self._trigger(times), self._shares(times)])

    def _trigger(self, times: Times) -> Times:
        """Return the channel: a pulse begins in the first sample at or after it, and lasts `PULSE_S`."""
        found = (times < self._until).astype(float)
        begun = sorted(t for t in self._waiting if len(times) and t <= times[-1])
        self._waiting = [t for t in self._waiting if t not in begun]
        for t in begun:
            first = times[int(np.searchsorted(times, t))]
            self._until = max(self._until, first + PULSE_S)
            found[(times >= first) & (times < self._until)] = 1.0
        return found

    def _shares(self, times: Times) -> Times:
        found, period = np.zeros(len(times)), 1.0 / self.rate_Hz
        for t in self._analog:
            high_s = np.minimum(times, t + PULSE_S) - np.maximum(times - period, t)
            found = np.maximum(found, np.clip(high_s / period, 0.0, 1.0))
        self._analog = [t for t in self._analog if len(times) == 0 or t + PULSE_S > times[-1]]
        return found


def pulse_times(times: Times, channel: Times) -> Float[np.ndarray, " pulse"]:
    """Return the times at which pulses begin, from a trigger channel [s]: of the first sample after each."""
    return times[np.flatnonzero(np.diff(channel > 0.5, prepend=False) & (channel > 0.5))]


def edge_times(times: Times, channel: Times) -> Float[np.ndarray, " pulse"]:
    """Return the times at which pulses begin, from an analog input [s]: between two samples, by the first share."""
    first = np.flatnonzero((channel > 0.0) & (np.roll(channel, 1) <= 0.0))
    first = first[first > 0]
    return times[first] - channel[first] * (times[first] - times[first - 1])


class EegElectrodes:
    """EEG of a person at rest [µV]; its last channels are trigger and analog input."""

    labels = (*EEG_LABELS, TRIGGER, ANALOG)

    def __init__(self, random: np.random.Generator):
        """Begin with a background of this generator."""
        self._random, self._before = random, EEG_SD_uV * random.standard_normal(len(EEG_LABELS))
        self.pulses = Pulses(EEG_HZ)

    def samples(self, times: Times) -> Signals:
        """Return the next samples at the times [s]."""
        stays = np.exp(-1.0 / (EEG_HZ * BACKGROUND_S))
        steps = EEG_SD_uV * np.sqrt(1.0 - stays**2) * self._random.standard_normal((len(times), len(EEG_LABELS)))
        background = np.empty_like(steps)
        for k, step in enumerate(steps):
            self._before = background[k] = stays * self._before + step
        rhythm = ALPHA_uV * np.sin(2.0 * np.pi * ALPHA_HZ * times)[:, None] * np.linspace(0.2, 1.0, len(EEG_LABELS))
        return np.column_stack([background + rhythm + _mains(times), self.pulses.in_samples(times)])


class EmgElectrodes:
    """Surface EMG [µV], a channel per freedom of the arm; its size grows with the muscles' torque."""

    def __init__(self, random: np.random.Generator, channels: int):
        """Begin with muscles at rest."""
        self._random, self._torque_Nm = random, np.zeros(channels)
        self.pulses = Pulses(EMG_HZ)

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the channels."""
        return (*(f"EMG{k + 1}" for k in range(len(self._torque_Nm))), TRIGGER, ANALOG)

    def feel(self, torque_Nm: Float[np.ndarray, " freedom"]) -> None:
        """Take the torque of the muscles from now on [N·m]."""
        count = min(len(torque_Nm), len(self._torque_Nm))
        self._torque_Nm[:count] = torque_Nm[:count]

    def samples(self, times: Times) -> Signals:
        """Return the next samples at the times [s]."""
        size = EMG_REST_uV + EMG_uV_PER_NM * np.abs(self._torque_Nm)
        noise = size * self._random.standard_normal((len(times), len(size)))
        return np.column_stack([noise + _mains(times), self.pulses.in_samples(times)])


def _mains(times: Times) -> Float[np.ndarray, "sample one"]:
    return LINE_uV * np.sin(2.0 * np.pi * LINE_HZ * times)[:, None]
