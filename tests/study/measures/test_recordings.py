"""A recording's windows get their own ticks for any size of pieces, and the carried share is correct."""

from pathlib import Path

import numpy as np
import pytest
from tests.study.made_up_sessions import touch

from exograv.recording import RecordingWriter
from exograv.recording.encoding import tick_dtype
from exograv.study.measures.recordings import Window, effort, read_measures, windowed

from .test_reaches import CYCLE_S, cycles

KEY = {"participant": "AAAA", "protocol": "training", "session": 1}
JOINTS = ("shoulder_flexion", "elbow_flexion")


def ticks(t: np.ndarray, level: float = 0.0, torque_Nm: float = 3.0) -> np.ndarray:
    rows = np.zeros(len(t), tick_dtype(2))
    rows["t"], rows["gravity_level"], rows["arm_share"], rows["tau_measured"] = t, level, 1.0, torque_Nm
    return rows


@pytest.mark.parametrize("size", [1, 7, 100, 1000])
def test_windows_get_their_own_ticks_in_pieces_of_any_size(size: int):
    t = np.arange(0.0, 5.0, 0.01)
    windows = [Window(1, 1, 1.0, 2.0, ()), Window(2, 1, 3.0, 3.5, ())]
    pieces = [ticks(t[k : k + size]) for k in range(0, len(t), size)]
    found = list(windowed(pieces, windows))
    assert [window.window for window, _ in found] == [1, 2]
    for window, rows in found:
        np.testing.assert_array_equal(rows["t"], t[(t >= window.opened_s) & (t <= window.closed_s)])


def test_a_window_without_a_tick_is_left_out_and_the_last_one_is_not():
    t = np.arange(0.0, 2.0, 0.01)
    windows = [Window(1, 1, -5.0, -4.0, ()), Window(2, 1, 1.5, 9.0, ())]
    assert [window.window for window, _ in windowed([ticks(t)], windows)] == [2]


def test_a_machine_at_lunar_weight_carries_the_rest():
    assert effort(ticks(np.arange(9.0), level=0.16))["carried_share"] == pytest.approx(0.84)
    assert effort(ticks(np.arange(9.0)))["motor_torque_rms_Nm"] == pytest.approx(3.0)
    assert np.isnan(effort(ticks(np.arange(9.0), level=np.nan))["carried_share"])


def write_session(path: Path, n: int = 4, settings: dict | None = None, shift_s: float = 0.0) -> Path:
    """Write one window in which two joints go to the target and back; the recording begins at 100 s on its own clock.

    `shift_s` is the delay of the computer's clock, which a console's records have, behind the rig's clock.
    """
    motion, touches = cycles(n, rate_Hz=200.0)
    with RecordingWriter(path, JOINTS, settings or {}) as recording:

        def say(kind: str, t: float, **record: object) -> None:
            record = {"kind": kind, "t": t - shift_s, "window": 1, "attempt": 1, **record}
            recording.write("/task", t, {"kind": kind, "record": record})

        say("window_opened", 100.0, by="clock", gravity_level=0.0)
        for t, q in zip(100.0 + motion.t, motion.path, strict=True):
            zero = dict.fromkeys(("v", "current", "tau_feedforward", "tau_desired", "tau_commanded"), np.zeros(2))
            measured = {"q_measured": q, "q_reference": q, "tau_measured": np.full(2, 2.0)}
            recording.tick(t, closure_slope=0.0, tick_us=1.0, gravity_level=0.0, arm_share=1.0, **zero, **measured)
        for k, t in enumerate(touches):
            record = touch(100.0 + t - shift_s, k, 1, is_accepted=k != 1)
            recording.write("/task", 100.0 + t, {"kind": "touch", "record": record})
        say("window_closed", 100.0 + n * CYCLE_S, by="clock", is_complete=True, marks=[])
    return path


def test_a_recording_tells_the_reaches_of_touches_that_count_and_nothing_of_a_hand_that_nobody_computed(tmp_path: Path):
    rows = read_measures(write_session(tmp_path / "a.mcap"), KEY).rows
    by_name = {name: [row["value"] for row in rows if row["measure"] == name] for name in {r["measure"] for r in rows}}
    assert len(by_name["joint_path_rad"]) == 3
    assert by_name["motor_torque_rms_Nm"] == pytest.approx([2.0])
    assert by_name["end_posture_scatter_deg"] == pytest.approx([0.0], abs=0.1)
    assert not [name for name in by_name if name.startswith("hand")]
    assert {row["sequence"] for row in rows if row["measure"] == "joint_sparc"} == {0, 2, 3}


def test_a_console_whose_computer_has_another_clock_changes_nothing(tmp_path: Path):
    same, other = (read_measures(write_session(tmp_path / f"{shift}.mcap", shift_s=shift), KEY) for shift in (0.0, 5e4))
    assert other.rows == same.rows
