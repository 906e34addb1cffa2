"""The amplitude of EMG is that of the muscle: neither movement nor the mains, in the window by the robot's clock."""

import numpy as np
import pytest
from tests.study.bids.made_up_biosignal import BEGINS_S, TOPIC, MadeUpDevice

from exograv.recording.device_stream import DeviceStream, joined
from exograv.study.folder.stream_settings import StreamSettings
from exograv.study.measures.emg_amplitude import amplitudes_of
from exograv.study.measures.recordings import Window

RATE_HZ = 1000.0
MAINS = StreamSettings(power_line_Hz=50.0)
WINDOWS = [Window(k + 1, 1, BEGINS_S + begin, BEGINS_S + begin + 10.0, ()) for k, begin in enumerate((3.0, 15.0))]
SD_UV = (20.0, 5.0)
"""Standard deviation of the muscle's noise in the two windows [µV]."""


def muscle(t: np.ndarray) -> np.ndarray:
    noise = np.random.default_rng(0).standard_normal(len(t))
    return np.where(t < WINDOWS[0].closed_s + 1.0, *SD_UV) * noise


def stream(values: np.ndarray, device: MadeUpDevice) -> DeviceStream:
    object.__setattr__(device, "values", lambda t: values[np.searchsorted(device.t, t - 1e-6)])
    recording = device.recording()
    notes, corrections = recording.messages("/stream"), recording.messages("/correction")
    return joined(TOPIC, "float32", [*device.blocks()], notes, corrections, recording.ticks)


def device(**changes: object) -> MadeUpDevice:
    given = {"kind": "EMG", "rate_Hz": RATE_HZ, "seconds": 30.0, "labels": ("BB", "TB"), **changes}
    return MadeUpDevice(**given)


def amplitudes(added: tuple[float, float], stated: StreamSettings, **changes: object) -> np.ndarray:
    """Return amplitudes (window, channel) of noise with an added sine of a frequency [Hz] and amplitude [µV]."""
    some = device(**changes)
    frequency, size = added
    values = muscle(some.t) + size * np.sin(2.0 * np.pi * frequency * some.t)
    rows = amplitudes_of(stream(np.column_stack([values, 2.0 * values]), some), stated, WINDOWS)
    assert not isinstance(rows, str)
    return np.array([row["amplitude_uV"] for row in rows]).reshape(-1, 2)


def test_the_amplitude_is_the_mean_of_the_rectified_noise():
    found = amplitudes((0.0, 0.0), StreamSettings())
    # White noise up to 500 Hz loses 20 Hz of its band; E|x| of Gaussian noise is its deviation times sqrt(2 / pi).
    expected = np.outer(np.array(SD_UV) * np.sqrt(480.0 / 500.0 * 2.0 / np.pi), [1.0, 2.0])
    assert np.allclose(found, expected, rtol=0.03)


@pytest.mark.parametrize(("frequency", "size"), [(2.0, 500.0), (50.0, 100.0), (150.0, 100.0)])
def test_movement_and_mains_change_the_amplitude_by_less_than_a_tenth(frequency: float, size: float):
    clean = amplitudes((0.0, 0.0), MAINS)
    assert np.allclose(amplitudes((frequency, size), MAINS), clean, rtol=0.1)


def test_without_a_stated_mains_the_mains_stay():
    assert amplitudes((50.0, 100.0), StreamSettings())[1, 0] > 40.0


def test_a_gap_in_a_window_leaves_the_window_out_but_not_a_short_one():
    begins = WINDOWS[0].opened_s + 2.0
    assert len(amplitudes((0.0, 0.0), MAINS, lost=((begins, begins + 0.5),))) == 2
    assert len(amplitudes((0.0, 0.0), MAINS, lost=((begins, begins + 3.0),))) == 1


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"unit": ""}, "unit_uV"), ({"rate_Hz": 100.0}, "at least 200 are needed")],
)
def test_a_stream_without_amplitude_says_why(changes: dict[str, object], why: str):
    some = device(**changes)
    found = amplitudes_of(stream(np.ones((len(some.t), 2)), some), StreamSettings(), WINDOWS)
    assert isinstance(found, str)
    assert why in found
