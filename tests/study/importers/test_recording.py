"""A recording of a task becomes rows with its counts, and a remark for each of its problems."""

from pathlib import Path

import numpy as np
import pytest
from tests.study.made_up_sessions import BEGUN_S, ZEROS, run_records, settings, touch, write_session

from exograv.recording import RecordingWriter
from exograv.study.dataset.tables import frame
from exograv.study.folder.columns import SESSIONS, TOUCHES, WINDOWS
from exograv.study.importers.imported_session import Imported
from exograv.study.importers.recording import import_recording

KEY = {"participant": "K9RR9PR", "protocol": "training", "session": 1}


def imported(tmp_path: Path, **more) -> Imported:
    return import_recording(write_session(tmp_path / "run.mcap", settings("K9RR9PR"), **more))


def test_rows_fit_the_contract(tmp_path: Path):
    found = imported(tmp_path)
    frame(TOUCHES, [{**KEY, **row} for row in found.touches])
    frame(WINDOWS, [{**KEY, **row} for row in found.windows])
    frame(SESSIONS, [{**KEY, **found.session, "source": "a", "sha256": "b"}])


def test_touches_and_windows_are_those_of_the_records(tmp_path: Path):
    found = imported(tmp_path)
    assert [row["is_accepted"] for row in found.touches] == [True, True, True, False, False]
    assert [(row["touches"], row["rejected"]) for row in found.windows] == [(2, 0), (1, 1)]
    assert (found.session["touches"], found.session["rejected"], found.session["windows_complete"]) == (3, 2, 2)
    assert found.session["is_complete"]
    assert found.session["remark"] is None
    assert (found.said.participant, found.said.protocol, found.said.session) == ("K9RR9PR", "training", 1)


def test_times_count_from_the_first_tick_also_where_a_page_had_another_clock(tmp_path: Path):
    rig, console = imported(tmp_path), imported(tmp_path, shift=77.5)
    assert [row["t_s"] for row in rig.touches] == pytest.approx([12.0, 14.0, 22.0, 24.0, 26.0])
    assert [row["t_s"] for row in console.touches] == pytest.approx([row["t_s"] for row in rig.touches])
    assert rig.windows[0]["opened_s"] == pytest.approx(10.0)


def test_a_touch_that_was_sent_twice_is_one(tmp_path: Path):
    again = touch(BEGUN_S + 12.0, 2, 1, is_accepted=False, reason="repeated")
    found = imported(tmp_path, records=[*run_records(), again])
    pages = [(row["page"], row["sequence"]) for row in found.touches]
    assert len(pages) == len(set(pages)) == 5


def test_a_screen_without_calibration_has_no_millimetres_and_says_so(tmp_path: Path):
    found = imported(tmp_path, records=run_records(pitch_mm=None))
    assert found.session["pitch_x_mm"] is None
    assert "no values in millimetres" in found.session["remark"]


def test_a_clock_that_goes_back_or_leaps_is_counted(tmp_path: Path):
    t = BEGUN_S + 0.1 * np.arange(310)
    t[100:] += 20.0
    t[200:] -= 50.0
    found = imported(tmp_path, times=t)
    assert found.session["clock_jumps"] == 2
    assert "jumped ahead: 2" in found.session["remark"]


def test_the_leap_to_where_a_run_went_on_is_none(tmp_path: Path):
    t = BEGUN_S + 0.1 * np.arange(310)
    t[155:] += 300.0
    # The arm is attached again before the task continues.
    resumed = {"kind": "paused", "t": float(t[155]) + 8.0, "why": "interrupted"}
    records = [one for one in run_records() if one["t"] < t[154]]
    found = imported(tmp_path, times=t, records=[*records, resumed])
    assert found.session["clock_jumps"] == 0


def test_ticks_that_are_missing_are_counted_by_their_numbers(tmp_path: Path):
    path = tmp_path / "run.mcap"
    with RecordingWriter(path, ("shoulder", "elbow"), settings("K9RR9PR")) as recording:
        for k in (1, 2, 3, 7, 8, 10):
            recording.tick(0.001 * k, closure_slope=0.0, tick_us=1.0, sequence=k, **ZEROS)
    session = import_recording(path).session
    assert (session["ticks"], session["ticks_lost"]) == (6, 4)
    assert session["remark"] == "The recording holds no run of a task."


def test_a_window_that_was_broken_off_is_an_attempt_of_its_own(tmp_path: Path):
    records = run_records()
    records[4] = {**records[4], "is_complete": False, "by": "pause"}
    found = imported(tmp_path, records=records)
    assert [row["is_complete"] for row in found.windows] == [False, True]
    assert found.session["windows_complete"] == 1
    assert "to their end: 1" in found.session["remark"]


def test_in_flight_a_window_has_the_median_of_what_the_aircraft_felt(tmp_path: Path):
    path = tmp_path / "flight.mcap"
    with RecordingWriter(path, ("shoulder", "elbow"), settings("K9RR9PR", "flight")) as recording:
        recording.tick(BEGUN_S, closure_slope=0.0, tick_us=1.0, **ZEROS)
        for record in run_records():
            recording.write("/task", record["t"], {"kind": record["kind"], "record": record})
        for t, g in ((9.0, 1.8), (11.0, 0.02), (12.0, 0.03), (13.0, 0.01), (16.0, 1.8)):
            recording.write("/aircraft", BEGUN_S + t, {"g": [0.0, 0.0, g], "parabola": 1, "announcement": ""})
    assert [row["g_median"] for row in import_recording(path).windows] == [pytest.approx(0.02), None]


def test_what_a_twin_or_a_model_did_is_simulated(tmp_path: Path):
    assert not imported(tmp_path).session["is_simulated"]
    twin = write_session(tmp_path / "twin.mcap", settings("K9RR9PR", disturbance_level=2))
    assert import_recording(twin).session["is_simulated"]


def test_a_cut_recording_gives_what_is_before_and_no_file_name(tmp_path: Path):
    path = write_session(tmp_path / "Schmidt.mcap", settings("K9RR9PR"), times=BEGUN_S + 0.001 * np.arange(30_000))
    content = path.read_bytes()
    path.write_bytes(content[:-2000])
    session = import_recording(path).session
    assert "ends abruptly" in session["remark"]
    assert "Schmidt" not in session["remark"]
    assert session["ticks"] > 0
