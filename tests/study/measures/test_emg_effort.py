"""Effort is relative to a reference contraction, is compared within people, and is read again only after a change."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.study.bids.small_study import CODES, STREAMS, write_recording, write_study
from tests.study.made_up_study import made_up_study, study_data

from exograv.study.dataset.tables import Tables, frame, read_tables
from exograv.study.folder.columns import WINDOWS
from exograv.study.folder.stream_settings import StreamSettings
from exograv.study.measures.emg_amplitude import EMG
from exograv.study.measures.emg_effort import EmgData, measure_emg, muscle_effort, relative_efforts
from exograv.study.measures.study_data import StudyData

REFERENCE = StreamSettings(contraction_window=1)
LEVELS = {1: 1.0, 2: 0.0, 3: 1.0, 4: 0.0, 5: 0.4}
"""Felt share of the weight by window; window 1 is the reference contraction."""

RATIO = 0.6
"""Effort in weightless windows divided by that at 1 g."""


def halves(people: int) -> dict[str, int]:
    return {"trained": people // 2, "untrained": people - people // 2}


def made_up(
    people: int, ratio: float = RATIO, streams: dict[str, StreamSettings] | None = None, sealed: bool = False
) -> tuple[EmgData, StudyData]:
    """Return amplitudes of people with different gains per person and channel, half of them in each group."""
    study = study_data(made_up_study(halves(people), windows=1, touches=1, is_sealed=sealed))
    rng, rows, windows = np.random.default_rng(0), [], []
    for k, code in enumerate(study.tables.participants["participant"]):
        gains = dict(zip("ab", rng.lognormal(3.0, 1.0, 2), strict=True))
        key = {"participant": code, "protocol": "flight", "session": 1}
        for window, level in LEVELS.items():
            place = {**key, "window": window, "attempt": 1}
            more = {
                "opened_s": 0.0,
                "opened_by": "clock",
                "is_complete": True,
                "marks": "",
                "touches": 0,
                "rejected": 0,
            }
            windows.append({**place, "gravity_level": level, **more})
            effort = 1.0 if window == 1 else 0.3 * (ratio if level == 0.0 else 1.0) * np.exp(0.02 * k)
            rows += [{**place, "channel": name, "amplitude_uV": gain * effort} for name, gain in gains.items()]
    tables = Tables(study.tables.touches, frame(WINDOWS, windows), study.tables.sessions, study.tables.participants)
    settings = study.settings.model_copy(update={"streams": {"EMG": REFERENCE} if streams is None else streams})
    return EmgData(frame(EMG, rows), ()), StudyData(settings, tables, study.measures, study.traces)


def test_the_ratio_of_the_conditions_is_found_whatever_the_gain_of_a_channel():
    data, study = made_up(people=8)
    found = muscle_effort(data, study)
    assert found is not None
    assert found.paired is not None
    assert found.paired.ratio == pytest.approx(RATIO)
    assert (found.weightless_windows, found.earth_windows) == (16, 8)  # window 5 is neither
    assert found.by_channel == {"a": pytest.approx(RATIO), "b": pytest.approx(RATIO)}
    assert found.paired.p == pytest.approx(2 / 2**8)


def test_the_groups_are_compared_by_people():
    data, study = made_up(people=8)
    found = muscle_effort(data, study)
    assert found is not None
    assert found.groups is not None
    assert found.groups.names == tuple(study.settings.groups)[:2]
    assert found.groups.interval.low is not None
    assert 0.8 < found.groups.ratio < 1.25
    data, study = made_up(people=8, sealed=True)
    found = muscle_effort(data, study)
    assert found is not None
    assert found.groups is None


@pytest.mark.parametrize(
    ("streams", "why"),
    [
        ({"EMG": StreamSettings()}, "no reference contraction"),
        ({"x": REFERENCE, "y": StreamSettings(contraction_window=2)}, "several reference contractions"),
        ({"EMG": StreamSettings(contraction_window=9)}, "have no reference contraction"),
    ],
)
def test_without_a_reference_nothing_is_compared_and_the_reason_is_told(streams: dict[str, StreamSettings], why: str):
    found = muscle_effort(*made_up(people=4, streams=streams))
    assert found is not None
    assert found.paired is None
    assert why in " ".join(found.left_out)


def test_the_reference_of_another_protocol_is_that_of_the_person():
    data, _ = made_up(people=2)
    contraction = data.amplitudes[data.amplitudes["window"] == 1].assign(protocol="contraction")
    contraction = contraction.assign(amplitude_uV=contraction["amplitude_uV"] * 2.0)
    both = pd.concat([data.amplitudes, contraction], ignore_index=True)
    stated = {"EMG": StreamSettings(contraction_window=1, contraction_protocol="contraction")}
    own, _ = relative_efforts(data.amplitudes, {"EMG": REFERENCE})
    other, _ = relative_efforts(both, stated)
    other = [one.log_effort for one in other if one.window != 1]
    assert other == pytest.approx([one.log_effort - np.log(2.0) for one in own])


def test_a_study_without_emg_has_no_effort():
    study = study_data(made_up_study(halves(2), windows=1, touches=1))
    assert muscle_effort(EmgData(frame(EMG, []), ()), study) is None


def test_a_recording_is_read_again_only_after_a_change_of_it_or_of_the_statements(tmp_path: Path):
    made = lambda path: write_recording(path, "flight", with_devices=True)  # noqa: E731
    folder = write_study(tmp_path / "study", ((CODES[0], "flight", 1, made),))
    tables, read = read_tables(folder), list[str]()

    def amplitudes(stated: dict[str, StreamSettings]) -> Sequence[float]:
        read.clear()
        return measure_emg(folder, tables, stated, read.append).amplitudes["amplitude_uV"].tolist()

    first = amplitudes(STREAMS)
    assert len(first) == 2  # one window, two channels
    assert len(read) == 1
    assert amplitudes(STREAMS) == first
    assert read == []
    doubled = {"EMG": STREAMS["EMG"].model_copy(update={"unit_uV": 2000.0})}
    assert amplitudes(doubled) == pytest.approx([2.0 * one for one in first])
    assert len(read) == 1
