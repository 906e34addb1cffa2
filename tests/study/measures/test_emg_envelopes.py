"""Envelopes of recorded EMG are shares of a contraction at the machine's times, whatever the gain of a channel."""

from pathlib import Path

import numpy as np
import pytest
from tests.study.bids.made_up_biosignal import BEGINS_S, MadeUpDevice
from tests.study.bids.small_study import write_recording

from exograv import ExogravError, Recording

RATE_HZ, SECONDS = 1000.0, 40.0
REST, CONTRACTION, WORK = ((BEGINS_S + a, BEGINS_S + b) for a, b in ((1.0, 6.0), (7.0, 12.0), (14.0, 38.0)))
REST_UV, STRONG_UV = 3.0, 200.0
T = np.arange(*WORK, 0.02)


def effort(t: np.ndarray) -> np.ndarray:
    """Share of a contraction [-]: rest, a contraction, then work that waxes and wanes."""
    share = 0.3 + 0.25 * np.sin(2.0 * np.pi * 0.2 * t)
    return np.select([t < REST[1] + 0.5, t < CONTRACTION[1] + 0.5], [0.0, 1.0], share)


def recorded(path: Path, **changes: object) -> Path:
    device = MadeUpDevice(**{
        "kind": "EMG", "topic": "/lsl/emg", "rate_Hz": RATE_HZ, "seconds": SECONDS, "labels": ("BB", "TB"), **changes,
    })  # fmt: skip
    noise = np.random.default_rng(0).standard_normal((len(device.t), 2))
    values = (REST_UV + STRONG_UV * effort(device.t))[:, None] * noise * (1.0, 7.0)
    object.__setattr__(device, "values", lambda t: values[np.searchsorted(device.t, t - 1e-6)].astype(np.float32))
    return write_recording(path, with_devices=True, biosignals=(device,))


def test_an_envelope_is_the_share_of_a_contraction_whatever_the_gain(tmp_path: Path):
    found = Recording(recorded(tmp_path / "a.mcap")).emg(T, REST, CONTRACTION)
    assert list(found.columns) == ["BB", "TB"]
    off = found.to_numpy() - effort(T)[:, None]
    assert np.abs(off.mean(axis=0)).max() < 0.06  # strong noise of the contraction raises its 95th percentile
    assert np.corrcoef(found["BB"], effort(T))[0, 1] > 0.9


def test_an_envelope_at_rest_is_nothing(tmp_path: Path):
    found = Recording(recorded(tmp_path / "a.mcap")).emg(np.arange(*REST, 0.02), REST, CONTRACTION)
    assert np.abs(found.to_numpy()).max() < 0.03


@pytest.mark.parametrize(
    ("changes", "rest", "text"),
    [
        ({"kind": "EEG"}, REST, "has no EMG stream"),
        ({"rate_Hz": 100.0}, REST, "at least 200 are needed"),
        ({}, (BEGINS_S + 300.0, BEGINS_S + 310.0), "no samples in the interval of the rest"),
        ({}, CONTRACTION, "is not larger in the contraction"),
        ({"lost": ((WORK[0] + 2.0, WORK[0] + 5.0),)}, REST, "EMG samples are missing at"),
    ],
)
def test_emg_that_cannot_be_used_is_refused_with_the_reason(
    tmp_path: Path, changes: dict[str, object], rest: tuple[float, float], text: str
):
    other = CONTRACTION if rest != CONTRACTION else (WORK[0], WORK[1])
    with pytest.raises(ExogravError, match=text):
        Recording(recorded(tmp_path / "a.mcap", **changes)).emg(T, rest, other)
