"""`exograv dev amplifier`: a simulated amplifier that publishes EEG and EMG over Lab Streaming Layer."""

import socket
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.options import AmplifierOptions
from exograv.runtime.lsl.library import lsl

from .electrodes import ANALOG, EEG_HZ, EMG_HZ, TRIGGER, EegElectrodes, EmgElectrodes
from .pulse_line import BYTES_MAX, TO_AMPLIFIER, Effort, Pulse, true_time

CHUNK_S = 0.02
"""Time between two chunks [s]."""

DELAY_S = 0.03
"""Age of a sample when it is sent [s]: a pulse on its way then still reaches its sample."""

BRACKET_S, BRACKETS_MAX = 20e-6, 100
"""Longest time between two readings of the true clock around one of LSL's [s], and number of attempts."""

EEG, EMG = "exograv-eeg", "exograv-emg"

OTHER_TYPES = {TRIGGER: "TRIG", ANALOG: "MISC"}
"""Types of channels that are no electrodes, by label."""


@dataclass(frozen=True)
class AmplifierResult:
    """Result of `exograv dev amplifier`."""

    samples: dict[str, int]
    """Number of sent samples by stream."""
    pulses: list[float]
    """Times of the pulses on CLOCK_BOOTTIME [s]."""


class _Stream:
    """Stream of one kind of electrodes."""

    def __init__(self, name: str, kind: str, rate_Hz: float, electrodes: EegElectrodes | EmgElectrodes, begun: float):
        info = lsl().StreamInfo(name, kind, len(electrodes.labels), rate_Hz, "float32", f"{name}-simulated")
        channels = info.desc().append_child("channels")
        for label in electrodes.labels:
            channel = channels.append_child("channel")
            channel.append_child_value("label", label)
            channel.append_child_value("unit", "none" if label in OTHER_TYPES else "microvolts")
            channel.append_child_value("type", OTHER_TYPES.get(label, kind))
        self.name, self._rate_Hz, self._electrodes, self._begun = name, rate_Hz, electrodes, begun
        self.count, self._outlet = 0, lsl().StreamOutlet(info)

    def send(self, now: float) -> None:
        """Send the samples until `now` on the true clock [s]."""
        until = int((now - self._begun) * self._rate_Hz)
        if until <= self.count:
            return
        times = self._begun + np.arange(self.count, until) / self._rate_Hz
        values = self._electrodes.samples(times).astype(np.float32)
        self._outlet.push_chunk(values, _stamps(times).tolist())
        self.count = until


def run_amplifier(options: AmplifierOptions, say: Callable[[str], object]) -> AmplifierResult:
    """Publish EEG and EMG until Ctrl-C, or for `--seconds`.

    Raises:
        ConfigError: LSL is not installed, or the port is in use.
    """
    lsl()
    random = np.random.default_rng([options.seed, 61])
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.bind(("127.0.0.1", options.port))
        except OSError as error:
            raise ConfigError(
                f"UDP port {options.port} cannot be used: {error.strerror}. Give another --port."
            ) from error
        begun = true_time()
        eeg, emg = EegElectrodes(random), EmgElectrodes(random, options.channels)
        streams = (_Stream(EEG, "EEG", EEG_HZ, eeg, begun), _Stream(EMG, "EMG", EMG_HZ, emg, begun))
        say(f"Streams {EEG} and {EMG} are published. Ctrl-C ends.")
        pulses = list[float]()
        try:
            while options.seconds is None or true_time() - begun < options.seconds:
                for message in _heard(line, CHUNK_S):
                    if isinstance(message, Pulse):
                        pulses.append(message.t)
                        for electrodes in (eeg, emg):
                            electrodes.pulses.add(message.t)
                    else:
                        emg.feel(np.array(message.torque_Nm))
                for stream in streams:
                    stream.send(true_time() - DELAY_S)
        except KeyboardInterrupt:
            say("The amplifier is off.")
        return AmplifierResult({stream.name: stream.count for stream in streams}, pulses)


def _heard(line: socket.socket, within_s: float) -> list[Pulse | Effort]:
    """Return the messages of the next time [s]; datagrams that are no message are left out."""
    messages, ends = list[Pulse | Effort](), true_time() + within_s
    while (left := ends - true_time()) > 0.0:
        line.settimeout(left)
        try:
            messages.append(TO_AMPLIFIER.validate_json(line.recv(BYTES_MAX)))
        except TimeoutError:
            break
        except ValueError:
            continue
    return messages


def _stamps(times: np.ndarray) -> np.ndarray:
    """Return the times on LSL's clock of this process, which may be another computer's."""
    between, true, stamp = _reading()
    for _ in range(BRACKETS_MAX):
        if between < BRACKET_S:
            break
        between, true, stamp = _reading()
    return stamp + (times - true)


def _reading() -> tuple[float, float, float]:
    """Read both clocks: the uncertainty, the true time and LSL's time [s]."""
    before, stamp, after = true_time(), lsl().local_clock(), true_time()
    return after - before, 0.5 * (before + after), stamp
