"""The files of a session state what was recorded, each at its time, in the terms of BIDS."""

import gzip
import json
from pathlib import Path

import mne_bids
import numpy as np
import pytest

from exograv.recording import read_recording
from exograv.study.bids.checking import problems_of, read_rows
from exograv.study.dataset.tables import Tables, read_tables, write_tables
from exograv.study.folder.study_folder import StudyFolder

from .made_up_biosignal import BEGINS_S, MadeUpDevice, lags_of
from .small_study import (
    BIOSIGNALS,
    CODES,
    JOINTS,
    MADE,
    copied,
    ecg_stamps,
    export,
    swing,
    ticks,
    write_recording,
    write_study,
)

FLIGHT = f"sub-{CODES[0]}/ses-flight01"
FLIGHT_STEM = f"sub-{CODES[0]}_ses-flight01"
CUT = f"sub-{CODES[1]}/ses-familiarisation02"
HALF_DECIMAL = 0.6e-5


def motion_of(root: Path, system: str) -> dict[str, np.ndarray]:
    """Return the columns by name."""
    stem = root / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-{system}"
    _, channels = read_rows(stem.with_name(stem.name + "_channels.tsv"))
    return columns_of(stem.with_name(stem.name + "_motion.tsv"), [channel["name"] for channel in channels])


def columns_of(path: Path, names: list[str]) -> dict[str, np.ndarray]:
    table = np.genfromtxt(path, delimiter="\t", missing_values="n/a")
    return dict(zip(names, table.T, strict=True))


def sidecar(root: Path, name: str) -> dict:
    return json.loads((root / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_{name}.json").read_text())


def test_the_motion_is_that_of_the_ticks(exported: Path):
    motion = motion_of(exported, "exo")
    is_there = np.isfinite(motion["shoulder_flexion_angle"])
    expected = np.rad2deg(swing(BEGINS_S + motion["latency"]))
    inside = is_there & (motion["latency"] > 0.1) & (motion["latency"] < 11.8)
    assert np.allclose(motion["shoulder_flexion_angle"][inside], expected[inside], atol=0.02)  # the filter's error, deg
    assert np.allclose(motion["elbow_flexion_torque_commanded"][is_there], 3.0, atol=HALF_DECIMAL)
    assert np.array_equal(~is_there, (motion["latency"] > 3.9995) & (motion["latency"] < 4.1495))


def test_torque_latency_and_angles_have_the_words_of_bids(exported: Path):
    _, channels = read_rows(exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-exo_channels.tsv")
    kinds = {channel["name"]: (channel["type"], channel["units"]) for channel in channels}
    assert kinds["latency"] == ("LATENCY", "s")
    for joint in JOINTS:
        assert kinds[f"{joint}_angle"] == ("JNTANG", "deg")
        assert kinds[f"{joint}_velocity"] == ("MISC", "deg/s")
        assert kinds[f"{joint}_torque_measured"] == ("MISC", "N m")


@pytest.mark.parametrize(("system", "starts", "last"), [("hand", 0.0, 0.198), ("aircraft", 0.5, 0.196133)])
def test_other_points_have_their_own_beginning(exported: Path, system: str, starts: float, last: float):
    motion = motion_of(exported, system)
    assert motion["latency"][0] == 0.0
    assert sidecar(exported, f"tracksys-{system}_motion")["StartTime"] == pytest.approx(starts)
    assert list(motion.values())[-1][-1] == pytest.approx(last, abs=HALF_DECIMAL)
    onsets = {
        name: read_rows(exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-{name}_events.tsv")[1]
        for name in ("exo", system)
    }
    for own, other in zip(onsets["exo"], onsets[system], strict=True):
        assert float(other["onset"]) == pytest.approx(float(own["onset"]) - starts)


def test_a_device_is_on_the_robots_clock_with_its_gap(exported: Path):
    path = exported / FLIGHT / "motion" / f"{FLIGHT_STEM}_task-pointing_tracksys-exo_recording-ECG_physio.tsv.gz"
    latency, lead = columns_of(path, ["latency", "lead"]).values()
    is_there = np.isfinite(lead)
    about = sidecar(exported, "tracksys-exo_recording-ECG_physio")
    assert about["Columns"] == ["latency", "leadII"]
    assert about["StartTime"] == pytest.approx(1.0, abs=1e-6)
    assert about["RowsWithoutSample"] == np.count_nonzero(~is_there) == 125
    assert np.allclose(latency[is_there] + BEGINS_S + 1.0, ecg_stamps(), atol=2e-6)
    assert np.array_equal(lead[is_there], np.arange(np.count_nonzero(is_there)))
    assert np.allclose(np.diff(latency), 1 / 250.0, atol=2e-6)
    assert gzip.decompress(path.read_bytes())[:2] == b"0\t"
    assert path.read_bytes()[3:8] == bytes(5)  # neither name nor time


@pytest.mark.parametrize("device", BIOSIGNALS, ids=lambda device: device.kind)
def test_mne_opens_a_biosignal_on_the_clock_of_the_touches(exported: Path, device: MadeUpDevice):
    path = mne_bids.BIDSPath(
        subject=CODES[0], session="flight01", task="pointing", datatype=device.kind.lower(), root=exported
    )
    raw = mne_bids.read_raw_bids(path, verbose="ERROR")
    assert raw.ch_names == (["Cz", "Pz"] if device.kind == "EEG" else ["BB", "TB"])
    assert set(raw.get_channel_types()) == {device.kind.lower()}
    onsets = raw.annotations.onset[raw.annotations.description == "touch"]
    first_t = BEGINS_S + 3.5 - onsets[0]  # the first touch was 3.5 s after the first tick
    assert np.allclose(np.diff(onsets), [2.0], atol=1e-5)
    is_there = (raw.times < 2.3) | ((raw.times > 3.0) & (raw.times < 10.0))
    for channel, values in enumerate(1e6 * raw.get_data()):
        lags = lags_of(values[is_there][50:], first_t + raw.times[is_there][50:], 500, channel)
        assert np.abs(lags).max() < 1e-3
    assert ("BAD_ACQ_SKIP" in raw.annotations.description[:-1]) == bool(device.lost)


def test_biosignals_are_not_physiological_recordings_too(exported: Path):
    names = {path.name.rpartition("_")[0].rpartition("recording-")[2] for path in exported.rglob("*_physio.tsv.gz")}
    assert names == {"ECG"}
    rows = {row["filename"]: row["acq_time"] for row in read_rows(exported / FLIGHT / f"{FLIGHT_STEM}_scans.tsv")[1]}
    assert rows[f"eeg/{FLIGHT_STEM}_task-pointing_eeg.bdf"].startswith("2026-03-02T09:30:00.50")


def test_every_touch_has_its_row_and_its_reason(exported: Path, small_study: StudyFolder):
    touches = read_tables(small_study).touches
    rows = [row for path in sorted(exported.glob("sub-*/ses-*/beh/*_beh.tsv")) for row in read_rows(path)[1]]
    assert len(rows) == len(touches)
    rejected = touches["is_accepted"].tolist().count(False)
    assert [row["reason"] for row in rows if row["accepted"] == "false"] == ["bounce"] * rejected
    uncalibrated = read_rows(next(exported.glob("sub-*/ses-familiarisation01/beh/*_beh.tsv")))[1]
    assert {row["deviation_mm"] for row in uncalibrated} == {"n/a"}
    assert {row["deviation_px"] for row in uncalibrated} == {"12", "30", "31"}


def test_a_recording_that_was_cut_gives_what_is_left_and_says_so(exported: Path, small_study: StudyFolder):
    stem = exported / CUT / "motion" / f"{CUT.replace('/', '_')}_task-pointing_tracksys-exo"
    about = json.loads(stem.with_name(stem.name + "_motion.json").read_text())
    source = small_study.session(CODES[1], "familiarisation", 2) / "run.mcap"
    assert about["TickCount"] == len(read_recording(source).ticks) < 12_000
    assert "ends abruptly" in about["SourceRemark"]


def test_what_is_simulated_is_called_so_everywhere(exported: Path):
    assert "SIMULATED" in json.loads((exported / "dataset_description.json").read_text())["Name"]
    assert "nobody took part" in (exported / "README.md").read_text()
    for path in exported.glob("sub-*/ses-*/*/*.json"):
        if not path.name.endswith("_channels.json"):
            assert json.loads(path.read_text())["Simulated"] is True
    for path in exported.glob("sub-*/ses-*/*_scans.tsv"):
        assert {row["simulated"] for row in read_rows(path)[1]} == {"true"}


def test_acquisition_is_told_where_somebody_told_it(exported: Path):
    rows = read_rows(exported / FLIGHT / f"{FLIGHT_STEM}_scans.tsv")[1]
    times = {row["filename"].rpartition("tracksys-")[2]: row["acq_time"] for row in rows}
    assert times["exo_motion.tsv"] == "2026-03-02T09:30:00.000000"
    assert times["aircraft_motion.tsv"] == "2026-03-02T09:30:00.500000"
    assert {row["acq_time"] for row in read_rows(exported / CUT / f"{CUT.replace('/', '_')}_scans.tsv")[1]} == {"n/a"}


@pytest.mark.parametrize(("rate", "rows"), [(1000.0, 12_000), (128.0, 1500), (50.0, 600), (5000.0, 12_000)])
def test_the_rate_that_is_wanted_is_met_by_whole_ticks(tmp_path: Path, rate: float, rows: int):
    study = write_study(tmp_path / "study", MADE[:1])
    assert export(study, tmp_path / "bids", rate_Hz=rate).motion_rows == rows
    assert problems_of(tmp_path / "bids") == []


def test_a_session_without_a_recording_has_touches_and_events(small_study: StudyFolder, tmp_path: Path):
    study = copied(small_study, tmp_path / "study")
    tables = read_tables(study)
    sessions = tables.sessions.assign(kind="csv", rate_Hz=np.nan, is_simulated=False)
    write_tables(study, Tables(tables.touches, tables.windows, sessions, tables.participants))
    export(study, tmp_path / "bids")
    assert not list((tmp_path / "bids").rglob("*_motion.tsv"))
    assert len(list((tmp_path / "bids").rglob("beh/*_events.tsv"))) == 4
    assert problems_of(tmp_path / "bids") == []


def test_devices_keep_their_time_where_the_robots_clock_stood_still(tmp_path: Path):
    rows = ticks()
    rows["monotonic"][5055:] += 0.040  # forty periods that the twin missed
    study = write_study(
        tmp_path / "study",
        ((CODES[0], "flight", 1, lambda path: write_recording(path, "flight", with_devices=True, rows=rows)),),
    )
    export(study, tmp_path / "bids")
    path = next((tmp_path / "bids").rglob("*_physio.tsv.gz"))
    latency, lead = columns_of(path, ["latency", "lead"]).values()
    (stream,) = (one for one in read_recording(next(study.sources.rglob("*.mcap"))).streams if one.kind == "ECG")
    t = stream.t[np.concatenate([[True], np.diff(np.maximum.accumulate(stream.t)) > 0.0])]
    assert np.allclose(latency[np.isfinite(lead)], t - t[0], atol=2e-6)
