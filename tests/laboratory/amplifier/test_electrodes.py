"""Signals of the simulated amplifier: each pulse is in one sample, and EMG grows with torque."""

import numpy as np
import pytest

from exograv.laboratory.amplifier.electrodes import (
    EEG_HZ,
    EMG_HZ,
    EegElectrodes,
    EmgElectrodes,
    Pulses,
    edge_times,
    pulse_times,
)


@pytest.mark.parametrize("chunk", [1, 5, 100])
def test_a_pulse_begins_in_the_first_sample_at_or_after_it_and_lasts_as_long_in_any_chunks(chunk: int):
    pulses, times = Pulses(EEG_HZ), np.arange(1000) / EEG_HZ
    told = [0.0, 0.9991, 2.5002]
    for t in told:
        pulses.add(t)
    channels = np.concatenate([pulses.in_samples(times[k : k + chunk]) for k in range(0, len(times), chunk)])
    channel = channels[:, 0]
    begun = pulse_times(times, channel)
    assert begun == pytest.approx([0.0, 1.0, 2.504])
    assert times[channel > 0.5] == pytest.approx([t for first in begun for t in first + np.array([0.0, 0.004, 0.008])])
    assert edge_times(times, channels[:, 1]) == pytest.approx(told, abs=1e-9)


def test_a_pulse_that_is_announced_late_is_in_the_next_sample():
    pulses, times = Pulses(EEG_HZ), np.arange(10) / EEG_HZ
    assert not pulses.in_samples(times[:5]).any()
    pulses.add(0.0)
    assert pulses.in_samples(times[5:])[:, 0].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]


def test_emg_of_a_freedom_grows_with_its_torque_and_not_with_that_of_others():
    electrodes = EmgElectrodes(np.random.default_rng(0), 2)
    rest = electrodes.samples(np.arange(5000) / EMG_HZ).std(axis=0)
    electrodes.feel(np.array([0.0, -4.0]))
    effort = electrodes.samples(np.arange(5000, 10_000) / EMG_HZ).std(axis=0)
    assert effort[0] == pytest.approx(rest[0], rel=0.1)
    assert effort[1] > 8.0 * rest[1]


def test_eeg_in_chunks_is_eeg_at_once():
    times = np.arange(500) / EEG_HZ
    whole = EegElectrodes(np.random.default_rng(3)).samples(times)
    parts = EegElectrodes(np.random.default_rng(3))
    assert np.array_equal(whole, np.concatenate([parts.samples(times[:123]), parts.samples(times[123:])]))
